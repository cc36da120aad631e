"""A population of camera hypotheses: rotations, positions and focal lengths, as arrays of one length."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array

HALF_TURN = np.diag([-1.0, -1.0, 1.0])
"""Of the field about its centre."""


@dataclass(frozen=True)
class Hypotheses:
    """P cameras: `rotations` (P, 3, 3) world to camera, `positions` (P, 3) m, `focal_px` (P,) in view pixels."""

    rotations: Array
    positions: Array
    focal_px: Array

    def __len__(self) -> int:
        return len(self.positions)

    def __getitem__(self, chosen: NDArray[np.intp] | NDArray[np.bool_] | slice) -> Hypotheses:
        return Hypotheses(self.rotations[chosen], self.positions[chosen], self.focal_px[chosen])

    @classmethod
    def joined(cls, several: list[Hypotheses]) -> Hypotheses:
        """All of several populations."""
        return cls(
            np.concatenate([one.rotations for one in several] or [np.zeros((0, 3, 3))]),
            np.concatenate([one.positions for one in several] or [np.zeros((0, 3))]),
            np.concatenate([one.focal_px for one in several] or [np.zeros(0)]),
        )


def rotations_of(pan: Array, tilt: Array, roll: Array) -> Array:
    """Rotations (..., 3, 3), world to camera: `pan` of the view from x towards y, `tilt` below the horizon, rad."""
    zero = np.zeros_like(pan)
    forward = np.stack([np.cos(tilt) * np.cos(pan), np.cos(tilt) * np.sin(pan), -np.sin(tilt)], axis=-1)
    right = np.stack([np.sin(pan), -np.cos(pan), zero], axis=-1)
    down = np.cross(forward, right)
    cosine, sine = np.cos(roll)[..., None], np.sin(roll)[..., None]
    return np.stack([cosine * right + sine * down, cosine * down - sine * right, forward], axis=-2)
