"""Plausible poses for filming a field: upright, above it and not far away."""

import math

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.arrays import Array
from worker.calibration.geometry.camera import Pose

HIGHEST_M, FARTHEST_M = 200.0, 500.0
"""Limits above the field, and from its centre."""


def films_a_field(pose: Pose) -> bool:
    """True if a camera of this pose could film a field, whatever it sees there."""
    return bool(filming_mask(pose.matrix, pose.position))


def filming_mask(matrices: Array, positions: Array) -> NDArray[np.bool_]:
    """True for each pose that could film a field: `matrices` (..., 3, 3), world to camera; `positions` (..., 3), m."""
    x, y, z = np.moveaxis(positions, -1, 0)
    stands = (z > 0) & (z <= HIGHEST_M) & (np.hypot(x, y) <= FARTHEST_M)
    right, down, forward = np.moveaxis(matrices[..., 2], -1, 0)
    upright = -down >= math.cos(math.radians(60.0)) * np.hypot(right, down)
    # Component of the view along the vertical from which a picture has no upright.
    return np.asarray(stands & np.where(np.abs(forward) > 0.95, forward < 0, upright))
