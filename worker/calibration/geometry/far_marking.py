"""Distance on the ground between the places where two cameras put the same pixels of the farthest marking.

Two poses with their lenses may agree to a pixel everywhere and still disagree by decimetres where the ground is far
away and seen at a flat angle. A length there says what a focal length in per cent does not.
"""

import numpy as np

from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.visibility import VisibleLines


def far_marking_shift_m(pitch: Field, camera: Camera, other: Camera) -> float | None:
    """Return the distance (m, on the ground) between the pixels of the farthest marking in view by two cameras.

    The median over the marking's points in view of `camera`, each on the level plane through it; None if there are
    none, or if most of their pixels meet the ground nowhere by the pose and lens of `other`.
    """
    points = farthest_marking(pitch, camera)
    if len(points) == 0:
        return None
    shift = np.linalg.norm(on_the_ground(other, camera.project(points), points[:, 2]) - points[:, :2], axis=1)
    median = float(np.median(np.where(np.isfinite(shift), shift, np.inf)))
    return median if np.isfinite(median) else None


def farthest_marking(pitch: Field, camera: Camera) -> Array:
    """Return the points (N, 3) in view of the marking that is farthest from a camera on average."""
    seen = VisibleLines.from_camera(pitch.line_points(), camera).points
    away = np.linalg.norm(seen.position - camera.pose.position, axis=1)
    which, count = np.unique(seen.marking, return_counts=True)
    # Arcs in the far corners are farther away than the far touchline, but only a metre long.
    long_enough = which[count >= 0.1 * count.max(initial=0)]
    farthest = max(long_enough, key=lambda number: float(away[seen.marking == number].mean()), default=None)
    return seen.position[seen.marking == farthest]


def on_the_ground(camera: Camera, pixels: Array, height: Array) -> Array:
    """Return the points (N, 2) where rays of pixels (N, 2) meet the planes z = height (N,); NaN if nowhere."""
    ray = camera.rays(pixels)
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (height - camera.pose.position[2]) / ray[:, 2]
        along = np.where(along > 0, along, np.nan)
        return np.asarray(camera.pose.position[:2] + along[:, None] * ray[:, :2])
