"""Small synthetic pictures of a pitch, painted by casting each pixel's ray to the ground: the inverse of projection."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.scene.camera import Array, Camera, Intrinsics, Pose
from worker.calibration.scene.field import Field, Marking

GRASS = np.array([60, 130, 70], np.float32)
PAINT = np.array([235, 240, 235], np.float32)
SKY = np.array([230, 200, 170], np.float32)

PITCH = Field(105.0, 68.0)
CROWNED = Field(105.0, 68.0, ridge=np.array([[-18.5, 0.0, 0.35], [18.5, 0.0, 0.35]]))
BARREL = (-0.12, 0.02, 0.0, 0.0, 0.0)
# Rows of samples.
BAND = 16


def camera(
    name: str,
    position: tuple[float, float, float],
    target: tuple[float, float],
    focal: float = 600.0,
    distortion: tuple[float, ...] = (),
    size: tuple[int, int] = (960, 540),
) -> Camera:
    """A camera that looks at a point of the ground."""
    matrix = np.array([[focal, 0, size[0] / 2 - 0.5], [0, focal, size[1] / 2 - 0.5], [0, 0, 1]])
    return Camera(name, Intrinsics(matrix, np.array(distortion), size), Pose.looking_at(position, (*target, 0.0)))


def moved(camera: Camera, rotation: tuple[float, float, float] = (0, 0, 0), by: tuple[float, float, float] = (0, 0, 0)):
    """The camera turned by a rotation vector (rad) and moved (m)."""
    return camera.with_pose(Pose(camera.pose.rotation + rotation, camera.pose.position + by))


def pair(distortion: tuple[float, ...] = BARREL) -> list[Camera]:
    """Two cameras side by side on the usual side; both see the centre circle."""
    return [
        camera("left", (-1.0, -48.0, 10.0), (-20.0, 0.0), distortion=distortion),
        camera("right", (1.0, -48.0, 10.0), (20.0, 0.0), distortion=distortion),
    ]


def ground_behind(pitch: Field, camera: Camera, oversampling: int = 1) -> Array:
    """Points (H, W, 2) of the pitch plane behind each pixel, NaN above the horizon."""
    width, height = camera.intrinsics.size
    # Rays are smooth over the picture, so they are interpolated between pixels; the ground behind them is not.
    rays = camera.rays(np.stack(np.meshgrid(np.arange(-1.0, width + 1), np.arange(-1.0, height + 1)), axis=-1))
    rays = cv2.resize(rays, None, fx=oversampling, fy=oversampling, interpolation=cv2.INTER_LINEAR)
    rays = rays[oversampling:-oversampling, oversampling:-oversampling]
    # Band by band: what the loop works on stays in the processor's cache.
    return np.concatenate([_ground_of(rays[row : row + BAND], pitch, camera) for row in range(0, len(rays), BAND)])


def _ground_of(rays: Array, pitch: Field, camera: Camera) -> Array:
    down = np.where(rays[..., 2] < -1e-3, rays[..., 2], np.nan)
    surface = np.zeros(down.shape)
    for _ in range(1 if pitch.ridge is None else 6):
        along = (surface - camera.pose.position[2]) / down
        points = camera.pose.position[:2] + rays[..., :2] * along[..., None]
        surface = pitch.height(points)
    return points


def paint_markings(pitch: Field, camera: Camera, oversampling: int = 3) -> NDArray[np.float32]:
    """The part (H, W), 0..1, of each pixel that is paint."""
    points = ground_behind(pitch, camera, oversampling)
    paint = np.zeros(points.shape[:2], np.float32)
    rough = points[::4, ::4]
    for marking in pitch.markings():
        low, high = marking.centre.min(axis=0) - 1.0, marking.centre.max(axis=0) + 1.0
        near = np.all((rough > low) & (rough < high), axis=-1)
        if near.any():
            rows, columns = 4 * np.flatnonzero(near.any(axis=1)), 4 * np.flatnonzero(near.any(axis=0))
            part = np.s_[max(rows[0] - 4, 0) : rows[-1] + 5, max(columns[0] - 4, 0) : columns[-1] + 5]
            paint[part] = np.maximum(paint[part], np.nan_to_num(_covered(marking, points[part])))
    return cv2.resize(paint, camera.intrinsics.size, interpolation=cv2.INTER_AREA)


def _covered(marking: Marking, points: Array) -> Array:
    """The part of each sample that a marking covers: its box filter across the line times the one along it."""
    start, end = marking.centre[0], marking.centre[-1]
    if len(marking.centre) == 2:
        direction = (end - start) / np.linalg.norm(end - start)
        along = (points - (start + end) / 2) @ direction
        across = (points - (start + end) / 2) @ np.array([-direction[1], direction[0]])
        half_length = np.linalg.norm(end - start) / 2
    else:
        # An arc: its circle goes through three of its points.
        a, b, c = marking.centre[[0, len(marking.centre) // 3, 2 * len(marking.centre) // 3]]
        centre = np.linalg.solve(2 * np.array([b - a, c - a]), [b @ b - a @ a, c @ c - a @ a])
        radius = np.linalg.norm(a - centre)
        middle = marking.centre[len(marking.centre) // 2] - centre
        offset = points - centre
        across = np.linalg.norm(offset, axis=-1) - radius
        angle = np.arctan2(middle[0] * offset[..., 1] - middle[1] * offset[..., 0], offset @ middle)
        along = angle * radius
        half_length = np.linalg.norm(np.diff(marking.centre, axis=0), axis=1).sum() / 2
        if marking.closed:
            along = np.zeros_like(along)
    if marking.spot:
        across, along, half_length = np.hypot(across, along), np.zeros_like(along), 1.0
    return _box(across, marking.width / 2) * _box(along, half_length)


def _box(distance: Array, half_width: float) -> Array:
    """How much of a sample of the size of the distance's step lies within `half_width`."""
    down, right = np.gradient(distance)
    step = np.maximum(np.hypot(down, right), 1e-9)
    return np.clip((distance + half_width) / step + 0.5, 0, 1) - np.clip((distance - half_width) / step + 0.5, 0, 1)


def paint_frame(pitch: Field, camera: Camera, exposure: float = 1.0) -> NDArray[np.uint8]:
    """White lines on grass under a sky, BGR."""
    paint = paint_markings(pitch, camera, oversampling=2)[..., None]
    sky = np.isnan(ground_behind(pitch, camera)).any(axis=-1)[..., None]
    picture = np.where(sky, SKY, GRASS + (PAINT - GRASS) * paint)
    return np.clip(exposure * picture, 0, 255).astype(np.uint8)
