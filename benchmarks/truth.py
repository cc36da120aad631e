"""Errors of poses, in the paper's four figures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from benchmarks.scenes import Scene
from worker.calibration.geometry.camera import Camera, inside
from worker.calibration.geometry.lens import Lens
from worker.calibration.geometry.rotation import rotation_angles_deg

GRID_M = 0.5


@dataclass(frozen=True)
class Errors:
    """`stitch_px` (1 px = 10 cm; None for one camera), `shift_cm` (TrE), `turn_deg` (RoE), `iou` in 0..1.

    None, all but the first, for what stitches without finding poses.
    """

    stitch_px: float | None
    shift_cm: float | None = None
    turn_deg: float | None = None
    iou: float | None = None


def errors(scene: Scene, found: Sequence[Camera]) -> Errors:
    """Means over the cameras; stitch: the worst pair."""
    pairs = [_apart_px(scene, i, j, found) for i, j in overlapping(scene)]
    shifts, turns = zip(*(apart(a, b) for a, b in zip(found, scene.cameras, strict=True)), strict=True)
    return Errors(
        max(pairs) if pairs else None,
        100 * float(np.mean(shifts)),
        float(np.mean(turns)),
        float(np.mean([_seen_iou(scene, a, b) for a, b in zip(found, scene.real, strict=True)])),
    )


def apart(a: Camera, b: Camera) -> tuple[float, float]:
    """Between two poses: metres, degrees."""
    return (
        float(np.linalg.norm(a.pose.position - b.pose.position)),
        float(rotation_angles_deg(a.pose.rotation, b.pose.rotation)),
    )


def placed(scene: Scene, camera: Camera, pixel: np.ndarray) -> np.ndarray:
    """Return the place on the roof (x, y) where a camera puts a pixel (2,)."""
    ray = camera.rays(pixel)
    height = 0.0
    for _ in range(30):
        ground = camera.pose.position + ray * (height - camera.pose.position[2]) / ray[2]
        height = scene.pitch.lift(ground[None, :2])[0, 2]
    return ground[:2]


def overlapping(scene: Scene) -> list[tuple[int, int]]:
    """The pairs of cameras that see the pitch centre, or some marking, together."""
    return [(i, j) for i, j in combinations(range(len(scene.cameras)), 2) if _common(scene, i, j) is not None]


def apart_by_homography_px(scene: Scene, i: int, j: int, homography: np.ndarray) -> float:
    """The stitch error where the undistorted picture of camera j is laid onto that of camera i by (3, 3)."""
    point = _common(scene, i, j)
    assert point is not None, "cameras that overlap were asked for"
    first, second = (scene.real[k].project(point[None])[0] for k in (i, j))
    laid = homography @ _pinhole(scene.cameras[j].intrinsics, second)
    ray = np.linalg.solve(scene.cameras[i].intrinsics.matrix, laid)
    back = scene.cameras[i].intrinsics.distort(ray[:2] / ray[2])
    return 10 * float(np.linalg.norm(placed(scene, scene.real[i], first) - placed(scene, scene.real[i], back)))


def _pinhole(lens: Lens, pixel: np.ndarray) -> np.ndarray:
    """Return a pixel (2,) in the undistorted picture, (3,) homogeneous."""
    return lens.matrix @ np.append(lens.undistort(pixel), 1.0)


def _apart_px(scene: Scene, i: int, j: int, found: Sequence[Camera]) -> float:
    """Distance between where two cameras put what both see of the pitch centre, 1 px = 10 cm."""
    point = _common(scene, i, j)
    assert point is not None, "cameras that overlap were asked for"
    first, second = (placed(scene, found[k], scene.real[k].project(point[None])[0]) for k in (i, j))
    return 10 * float(np.linalg.norm(first - second))


def _common(scene: Scene, i: int, j: int) -> np.ndarray | None:
    """The pitch centre, or the point of a marking nearest to it that both cameras see; None where there is none."""
    points = np.concatenate([scene.pitch.lift(np.zeros((1, 2))), scene.pitch.line_points().position])
    seen = np.all([inside(scene.real[k].project(points), scene.real[k].intrinsics.size, 20) for k in (i, j)], axis=0)
    if not seen.any():
        return None
    return min(points[seen], key=lambda point: float(np.hypot(*point[:2])))


def _seen_iou(scene: Scene, found: Camera, true: Camera) -> float:
    """IoU of the parts of the pitch that are in the picture by the found and by the true pose."""
    half = np.array([scene.pitch.length, scene.pitch.width]) / 2
    x, y = np.meshgrid(np.arange(-half[0], half[0], GRID_M), np.arange(-half[1], half[1], GRID_M))
    points = scene.pitch.lift(np.stack([x.ravel(), y.ravel()], axis=1))
    a, b = (inside(camera.project(points), camera.intrinsics.size) for camera in (found, true))
    return float((a & b).sum() / max((a | b).sum(), 1))
