"""Population of camera hypotheses: rotations, positions, focal lengths and bends, as arrays of one length."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.arrays import Array, take_rows

FARTHEST_BENT = 0.06
"""Largest difference in bend between a hypothesis and the lens that undistorted the view."""
HALF_TURN = np.diag([-1.0, -1.0, 1.0])
"""Rotation of the field by half a turn about its centre."""


@dataclass(frozen=True)
class Hypotheses:
    """Cameras, P of them: `rotations` (P, 3, 3) world to camera, `positions` (P, 3) m, `focal_px` (P,) in view pixels.

    `bends` (P,): further distortion beyond that of the lens that undistorted the view: the part by which it puts a
    point farther from the centre at half the width of the frame, and elsewhere by the square of the distance.
    """

    rotations: Array
    positions: Array
    focal_px: Array
    bends: Array

    @classmethod
    def unbent(cls, rotations: Array, positions: Array, focal_px: Array) -> "Hypotheses":
        """Return cameras whose lenses bend as the one that undistorted the view."""
        return cls(rotations, positions, focal_px, np.zeros(len(positions)))

    def __len__(self) -> int:
        return len(self.positions)

    def __getitem__(self, chosen: NDArray[np.intp] | NDArray[np.bool_] | slice) -> "Hypotheses":
        return take_rows(self, chosen)

    @classmethod
    def joined(cls, several: "list[Hypotheses]") -> "Hypotheses":
        """Return all cameras of several populations."""
        return cls(
            np.concatenate([one.rotations for one in several] or [np.zeros((0, 3, 3))]),
            np.concatenate([one.positions for one in several] or [np.zeros((0, 3))]),
            np.concatenate([one.focal_px for one in several] or [np.zeros(0)]),
            np.concatenate([one.bends for one in several] or [np.zeros(0)]),
        )


@dataclass(frozen=True)
class LensSteps:
    """Standard deviations of the lenses of hypotheses: of the log focal length, and of the bend; 0 where known."""

    focal: float
    bend: float


LENS_KNOWN, FOCAL_SOUGHT, LENS_SOUGHT = LensSteps(0.0, 0.0), LensSteps(0.08, 0.0), LensSteps(0.08, 0.02)


def rotations_of(pan: Array, tilt: Array, roll: Array) -> Array:
    """Return rotations (..., 3, 3), world to camera: `pan` from x towards y, `tilt` below the horizon, rad."""
    (cos_pan, sin_pan), (cos_tilt, sin_tilt) = ((np.cos(angle), np.sin(angle)) for angle in (pan, tilt))
    forward = np.stack([cos_tilt * cos_pan, cos_tilt * sin_pan, -sin_tilt], axis=-1)
    right = np.stack([sin_pan, -cos_pan, np.zeros_like(pan)], axis=-1)
    down = np.stack([-sin_tilt * cos_pan, -sin_tilt * sin_pan, -cos_tilt], axis=-1)
    cosine, sine = np.cos(roll)[..., None], np.sin(roll)[..., None]
    return np.stack([cosine * right + sine * down, cosine * down - sine * right, forward], axis=-2)
