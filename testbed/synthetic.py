"""Small synthetic pictures of a pitch, painted by casting each pixel's ray to the ground: the inverse of projection."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Camera, Pose
from worker.calibration.geometry.field import Field, Marking
from worker.calibration.geometry.lens import Intrinsics

GRASS = np.array([60, 130, 70], np.float32)
PAINTS = {
    "white": np.array([235, 240, 235], np.float32),
    "blue": np.array([190, 90, 40], np.float32),
    "red": np.array([50, 40, 200], np.float32),
}
SKY = np.array([230, 200, 170], np.float32)

# Of a field that somebody has measured, as the demo's venue says it.
TAPED = {"length_m": 0.03, "width_m": 0.02}
PITCH = Field(105.0, 68.0, sigma=TAPED)
CROWNED = replace(PITCH, ridge=np.array([[-18.5, 0.0, 0.35], [18.5, 0.0, 0.35]]))
BARREL = (-0.12, 0.02, 0.0, 0.0, 0.0)
# Samples a side of a pixel, and pixels a side of a block.
SAMPLES, BLOCK = 3, 4
PATCH_M = 0.25
# How steeply a ray has to go down to meet the ground.
LEVEL = 1e-3


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


def pair_markings(distortion: tuple[float, ...] = BARREL) -> tuple[NDArray[np.float32], ...]:
    """Return what the pair sees of the markings of the crowned pitch: painted once for all tests of a process."""
    return _markings_of_pair(distortion)


def pair_frames(distortion: tuple[float, ...] = BARREL) -> tuple[NDArray[np.uint8], ...]:
    """The frames of the pair: painted once for all tests of a process."""
    return _frames_of_pair(distortion)


@cache
def _markings_of_pair(distortion: tuple[float, ...]) -> tuple[NDArray[np.float32], ...]:
    return tuple(_shared(paint_markings(CROWNED, one)) for one in pair(distortion))


@cache
def _frames_of_pair(distortion: tuple[float, ...]) -> tuple[NDArray[np.uint8], ...]:
    seen = zip(pair(distortion), pair_markings(distortion), strict=True)
    return tuple(_shared(_coloured(one, {"white": paint})) for one, paint in seen)


def _shared(picture: NDArray) -> NDArray:
    picture.flags.writeable = False
    return picture


def ground_behind(pitch: Field, camera: Camera) -> Array:
    """Points (H, W, 2) of the pitch plane behind each pixel, NaN above the horizon."""
    return _ground_at(pitch, camera, np.stack(np.indices(camera.intrinsics.size[::-1])[::-1], axis=-1))


def paint_markings(pitch: Field, camera: Camera, colour: str | None = None) -> NDArray[np.float32]:
    """The part (H, W), 0..1, of each pixel that is paint, of one colour or of any."""
    width, height = camera.intrinsics.size
    middles = _blocks(camera)
    behind = _ground_at(pitch, camera, middles)
    markings = [one for one in pitch.markings() if colour in (None, one.colour)]
    x, y = np.ascontiguousarray(behind[..., 0]), np.ascontiguousarray(behind[..., 1])
    reach = _step(x) + _step(y)
    close = [_close(one, behind, (x, y), reach + one.width) for one in markings]
    painted = np.any(close, axis=0) if close else np.zeros(behind.shape[:2], bool)
    met = _met(pitch, camera, _sampled_rays(camera, middles[painted]))
    side = BLOCK * SAMPLES
    paint = np.zeros((*middles.shape[:2], side, side), np.float32)
    for marking, its in zip(markings, close, strict=True):
        covered = _covered(marking, met[its[painted]])
        paint[its] = np.maximum(paint[its], np.nan_to_num(covered))
    sampled = paint.transpose(0, 2, 1, 3).reshape(-1, paint.shape[1] * side)
    return cv2.resize(sampled, None, fx=1 / SAMPLES, fy=1 / SAMPLES, interpolation=cv2.INTER_AREA)[:height, :width]


def _blocks(camera: Camera) -> Array:
    """Pixels (h, w, 2) in the middles of blocks of the picture: what is far from all lines is not sampled finely."""
    width, height = camera.intrinsics.size
    middle = (BLOCK - 1) / 2
    return np.stack(
        np.meshgrid(np.arange(middle, width + middle, BLOCK), np.arange(middle, height + middle, BLOCK)), -1
    )


def _sampled_rays(camera: Camera, middles: Array) -> Array:
    """Directions (n, h, w, 3) of the samples of blocks with these middles (n, 2), interpolated between nine of each.

    Lenses bend them so little within a block that a sample is off by less than a thousandth of a pixel.
    """
    nodes = np.array([-0.5, 0.0, 0.5]) * BLOCK
    rays = camera.rays(middles[:, None, None] + np.stack(np.meshgrid(nodes, nodes), axis=-1))
    along = ((np.arange(BLOCK * SAMPLES) + 0.5) / SAMPLES / BLOCK - 0.5)[:, None]
    # Lagrange's parabolas through the nodes.
    parabolas = np.hstack([along * (2 * along - 1), 1 - 4 * along**2, along * (2 * along + 1)])
    side = len(along)
    return (np.kron(parabolas, parabolas) @ rays.reshape(-1, 9, 3)).reshape(-1, side, side, 3)


def _ground_at(pitch: Field, camera: Camera, pixels: Array) -> Array:
    """Points (..., 2) of the pitch plane behind pixels (..., 2), NaN above the horizon."""
    return _met(pitch, camera, camera.rays(pixels))


def _met(pitch: Field, camera: Camera, rays: Array) -> Array:
    """Points (..., 2) of the pitch plane where rays (..., 3) of a camera meet the ground, NaN where they never do."""
    down = np.where(rays[..., 2] < -LEVEL, rays[..., 2], np.nan)
    surface = np.zeros(down.shape)
    for _ in range(1 if pitch.ridge is None else 6):
        along = (surface - camera.pose.position[2]) / down
        points = camera.pose.position[:2] + rays[..., :2] * along[..., None]
        surface = pitch.height(points)
    return points


def _close(marking: Marking, points: Array, axes: tuple[Array, Array], reach: Array) -> NDArray[np.bool_]:
    """True where a marking may reach into the blocks (h, w) with these points (h, w, 2) in their middles.

    `axes`: the points, axis by axis (h, w); `reach` (h, w): no part of a block is farther from its middle, in m.
    """
    close = np.zeros(reach.shape, bool)
    around = np.ones(reach.shape, bool)
    for at, low, high in zip(axes, marking.centre.min(axis=0), marking.centre.max(axis=0), strict=True):
        around &= np.abs(at - (low + high) / 2) < (high - low) / 2 + reach
    if not around.any():
        return close
    # Slopes are measured beside it, too.
    rows, columns = (
        slice(max(0, int(there[0]) - 2), int(there[-1]) + 3)
        for there in (np.flatnonzero(around.any(axis=1)), np.flatnonzero(around.any(axis=0)))
    )
    across, along, half_length = _place(marking, points[rows, columns])
    close[rows, columns] = (np.abs(across) < marking.width / 2 + _step(across)) & (
        np.abs(along) < half_length + _step(along)
    )
    return close


def _covered(marking: Marking, points: Array) -> Array:
    """The part of each sample (..., h, w) that a marking covers: its box filter across the line times that along it."""
    across, along, half_length = _place(marking, points)
    return _box(across, marking.width / 2) * _box(along, half_length)


def _place(marking: Marking, points: Array) -> tuple[Array, Array, float]:
    """Return the distances of points (..., 2) from the line and from its middle along it, and half its length."""
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
    return across, along, half_length


def _step(distance: Array) -> Array:
    """Return the change (..., h, w) of a distance from one sample to the next."""
    down, right = np.gradient(distance, axis=(-2, -1))
    return np.abs(down) + np.abs(right)


def _box(distance: Array, half_width: float) -> Array:
    """Return the share of a sample, as large as the distance's step, that lies within `half_width`."""
    down, right = np.gradient(distance, axis=(-2, -1))
    step = np.maximum(np.hypot(down, right), 1e-9)
    return np.clip((distance + half_width) / step + 0.5, 0, 1) - np.clip((distance - half_width) / step + 0.5, 0, 1)


def paint_frame(pitch: Field, camera: Camera, exposure: float = 1.0) -> NDArray[np.uint8]:
    """Lines on grass under a sky, BGR."""
    colours = sorted({marking.colour for marking in pitch.markings()})
    return _coloured(camera, {colour: paint_markings(pitch, camera, colour) for colour in colours}, exposure)


def worn(pitch: Field, camera: Camera, frame: NDArray[np.uint8], seed: int = 0) -> NDArray[np.uint8]:
    """The frame of a camera with grass that is worn here and there, at the same places for each camera of a `seed`."""
    patches = cv2.GaussianBlur(np.random.default_rng(seed).normal(size=(500, 700)), (0, 0), 1.5)
    return _shaded(pitch, camera, frame, (0.1 * patches / patches.std()).astype(np.float32))


def mown(pitch: Field, camera: Camera, frame: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The frame of a camera with grass in light and dark stripes across the pitch, 5 m wide."""
    stripes = 0.1 * np.sign(np.sin(np.pi * (np.arange(700) - 350) * PATCH_M / 5))
    return _shaded(pitch, camera, frame, np.broadcast_to(stripes, (500, 700)).astype(np.float32))


def _shaded(pitch: Field, camera: Camera, frame: NDArray[np.uint8], shades: NDArray[np.float32]) -> NDArray[np.uint8]:
    """The frame with the ground so much lighter at each place of a map, `PATCH_M` apart around the middle."""
    rows, columns = shades.shape
    at = ground_behind(pitch, camera).astype(np.float32) / np.float32(PATCH_M)
    there = cv2.remap(shades, at[..., 0] + columns // 2, at[..., 1] + rows // 2, cv2.INTER_LINEAR)
    return np.clip(frame * (1 + np.nan_to_num(there)[..., None]), 0, 255).astype(np.uint8)


def _coloured(camera: Camera, paint: dict[str, NDArray[np.float32]], exposure: float = 1.0) -> NDArray[np.uint8]:
    width, height = camera.intrinsics.size
    down = cv2.resize(camera.rays(_blocks(camera))[..., 2], None, fx=BLOCK, fy=BLOCK)[:height, :width, None]
    picture = np.where(down < -LEVEL, GRASS, SKY)
    for colour, share in paint.items():
        picture += share[..., None] * (PAINTS[colour] - picture)
    return np.clip(exposure * picture, 0, 255).astype(np.uint8)
