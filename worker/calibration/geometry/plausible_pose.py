"""Plausible poses for filming a field: upright, above it and not far away."""

import math

from worker.calibration.geometry.camera import Pose

HIGHEST_M, FARTHEST_M = 200.0, 500.0
"""Limits above the field, and from its centre."""


def films_a_field(pose: Pose) -> bool:
    """True if a camera of this pose could film a field, whatever it sees there."""
    x, y, z = pose.position
    if not (0 < z <= HIGHEST_M and math.hypot(x, y) <= FARTHEST_M):
        return False
    right, down, forward = pose.matrix[:, 2]
    # Component of the view along the vertical from which a picture has no upright.
    if abs(forward) > 0.95:
        return bool(forward < 0)
    return bool(-down >= math.cos(math.radians(60.0)) * math.hypot(right, down))
