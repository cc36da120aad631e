"""Plausible poses for filming a field: upright, above it and not far away."""

from __future__ import annotations

import math

from worker.calibration.geometry.camera import Pose

HIGHEST_M, FARTHEST_M = 200.0, 500.0
"""Limits above the field, and from its centre."""
STEEPEST_ROLL_DEG = 60.0
STRAIGHT_DOWN = 0.95
"""Component of the view along the vertical from which a picture has no upright."""


def films_a_field(pose: Pose) -> bool:
    """True if a camera of this pose could film a field, whatever it sees there."""
    x, y, z = pose.position
    if not (0 < z <= HIGHEST_M and math.hypot(x, y) <= FARTHEST_M):
        return False
    right, down, forward = pose.matrix[:, 2]
    if abs(forward) > STRAIGHT_DOWN:
        return bool(forward < 0)
    return bool(-down >= math.cos(math.radians(STEEPEST_ROLL_DEG)) * math.hypot(right, down))
