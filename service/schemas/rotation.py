"""Rotation of vectors without NumPy, for commands that must start quickly."""

import math


def rotate(rotation: list[float], vector: list[float]) -> list[float]:
    """Return a vector rotated by a Rodrigues vector (rad)."""
    angle = math.hypot(*rotation)
    if angle == 0.0:
        return list(vector)
    ax, ay, az = (component / angle for component in rotation)
    x, y, z = vector
    cos, sin = math.cos(angle), math.sin(angle)
    along = (ax * x + ay * y + az * z) * (1 - cos)
    return [
        x * cos + (ay * z - az * y) * sin + ax * along,
        y * cos + (az * x - ax * z) * sin + ay * along,
        z * cos + (ax * y - ay * x) * sin + az * along,
    ]
