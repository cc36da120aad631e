"""Pictures stitched from all cameras: the preview, from a viewpoint between them, and the bird's-eye view.

Both are made the same way: for each of their pixels the point of the world behind it, for each point the pixel of each
camera (`Camera.project`), and where several cameras see it a blend with a short feather along a seam.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.draw.viewpoint import Viewpoint, world_behind
from worker.calibration.scene.camera import Array, Camera, Frame
from worker.calibration.scene.field import Field
from worker.calibration.scene.look import Look, box, ground_grid, look_through

# Least length of the pitch in the bird's-eye view, in pixels: courts are small.
BIRDSEYE_LENGTH = 800
# What no camera sees: dark grey rather than black, so that it reads as "outside" and not as "broken".
BACKDROP = 38

# The preview's geometry is computed at every n-th pixel and interpolated; the tests hold it below 0.05 px.
GEOMETRY_STEP = 4

# Two feathers along the seam, powers of how well a camera sees: a short one for detail, so that players who stand off
# the ground do not become ghosts, and a long one for the smooth part, so that no step of exposure shows in the sky.
DETAIL_SHARPNESS, SMOOTH_SHARPNESS = 60, 4
SMOOTH_BLOCK, SMOOTH_SIGMA = 16, 2.0
LARGEST_GAIN = 1.3
# Pixels this dark or bright say nothing about exposure.
EXPOSED = (16, 240)


@dataclass(frozen=True)
class Stitched:
    """A view stitched from all cameras, BGR (H, W, 3); `owner` (H, W): number of the camera that counts most, or -1."""

    picture: Frame
    owner: NDArray[np.int8]


def stitched(pitch: Field, view: Viewpoint, cameras: Sequence[Camera], frames: Mapping[str, Frame]) -> Stitched:
    """What the cameras see, from one place: pictures of two sets of poses from the same place can be compared.

    `frames[camera.id]`: BGR (height, width, 3) of the size of the camera's intrinsics.
    """
    points = world_behind(pitch, view, _every_nth_pixel(view.size))
    looks = [look_through(camera, frames[camera.id], _every_pixel(camera.project(points), view)) for camera in cameras]
    best = np.argmax([look.quality for look in looks], axis=0)
    seen = np.any([look.valid for look in looks], axis=0)
    return Stitched(_blend(looks), np.where(seen, best, -1).astype(np.int8))


def birdseye(
    pitch: Field,
    cameras: Sequence[Camera],
    frames: Mapping[str, Frame],
    pixels_per_metre: float | None = None,
    margin_m: float = 3,
) -> Frame:
    """The pitch from straight above, BGR: x to the right, y up, the pitch centre in the centre pixel.

    `pixels_per_metre`: unless said 10, and more where the pitch would come out shorter than `BIRDSEYE_LENGTH`.
    `frames[camera.id]`: BGR (height, width, 3) of the size of the camera's intrinsics.
    """
    pixels_per_metre = pixels_per_metre or max(10.0, BIRDSEYE_LENGTH / pitch.length)
    columns = round((pitch.length / 2 + margin_m) * pixels_per_metre)
    rows = round((pitch.width / 2 + margin_m) * pixels_per_metre)
    grid = ground_grid(columns, rows, 1 / pixels_per_metre)
    return _blend([look_through(camera, frames[camera.id], camera.project(pitch.lift(grid))) for camera in cameras])


def _every_nth_pixel(size: tuple[int, int]) -> Array:
    """Positions (h, w, 2) of the centres of blocks of `GEOMETRY_STEP` pixels, one block more on each side."""
    x, y = (GEOMETRY_STEP * (np.arange(-1, -(-extent // GEOMETRY_STEP) + 1) + 0.5) - 0.5 for extent in size)
    return np.stack(np.meshgrid(x, y), axis=-1)


def _every_pixel(values: Array, view: Viewpoint) -> Array:
    """Values (h, w, 2) at `_every_nth_pixel`, linearly interpolated to every pixel of a view (height, width, 2)."""
    width, height = view.size
    dense: Array = np.asarray(
        cv2.resize(values, None, fx=GEOMETRY_STEP, fy=GEOMETRY_STEP, interpolation=cv2.INTER_LINEAR), float
    )
    return dense[GEOMETRY_STEP : GEOMETRY_STEP + height, GEOMETRY_STEP : GEOMETRY_STEP + width]


def seam_weights(qualities: NDArray[np.float32], sharpness: int) -> NDArray[np.float32]:
    """Weights (cameras, H, W) that sum to 1 where any camera sees, from how well each does: the best one, feathered."""
    relative = (qualities / np.maximum(qualities.max(axis=0), 1e-9)) ** sharpness
    return relative / np.maximum(relative.sum(axis=0), 1e-9)


def _blend(looks: Sequence[Look]) -> Frame:
    gains = exposure_gains(looks)
    picture = np.full(looks[0].values.shape, BACKDROP, np.uint8)
    for look, gain in zip(looks, gains, strict=True):
        evened = cv2.transform(look.values, np.diag(gain))
        cv2.copyTo(evened, look.valid.astype(np.uint8), picture)
    overlap = np.sum([look.valid for look in looks], axis=0) > 1
    if overlap.any():
        around = box(overlap)
        shared = overlap[around]
        picture[around][shared] = _feathered([_part(look, around) for look in looks], gains)[shared]
    return picture


def _part(look: Look, around: tuple[slice, slice]) -> Look:
    return Look(look.values[around], look.valid[around], look.quality[around])


def _feathered(looks: Sequence[Look], gains: NDArray[np.float32]) -> Frame:
    """Where several cameras see: each one's part, feathered along the seam."""
    qualities = np.stack([look.quality for look in looks])
    detail, smooth = seam_weights(qualities, DETAIL_SHARPNESS), seam_weights(qualities, SMOOTH_SHARPNESS)
    picture = np.zeros(looks[0].values.shape, np.float32)
    for look, short, long, gain in zip(looks, detail, smooth, gains, strict=True):
        picture += gain * (short[..., None] * look.values + (long - short)[..., None] * _smooth_part(look))
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8)


def _smooth_part(look: Look) -> NDArray[np.float32]:
    """What remains of a camera's part (H, W, 3) without its detail, from the pixels it sees only."""
    rows, columns = look.valid.shape
    small = (-(-columns // SMOOTH_BLOCK), -(-rows // SMOOTH_BLOCK))
    seen = look.valid.astype(np.float32)
    weight, total = (
        cv2.GaussianBlur(cv2.resize(part, small, interpolation=cv2.INTER_AREA), (0, 0), SMOOTH_SIGMA)
        for part in (seen, look.values * seen[..., None])
    )
    mean = total / np.maximum(weight, 1e-6)[..., None]
    return cv2.resize(mean, (columns, rows), interpolation=cv2.INTER_LINEAR).astype(np.float32, copy=False)


def exposure_gains(looks: Sequence[Look]) -> NDArray[np.float32]:
    """A gain per camera and colour (cameras, 3) that makes them agree where they overlap, at most `LARGEST_GAIN`.

    From the median ratio of each pair, which players and other parallax do not move.
    """
    count = len(looks)
    # Least squares of the log gains, held near 1 so that only their differences follow the pictures.
    normal, right = 1e-3 * np.eye(count), np.zeros((count, 3))
    for i, j in combinations(range(count), 2):
        a, b = looks[i].values[::4, ::4].astype(np.float32), looks[j].values[::4, ::4].astype(np.float32)
        both = looks[i].valid[::4, ::4] & looks[j].valid[::4, ::4]
        both &= (np.minimum(a, b).min(axis=-1) > EXPOSED[0]) & (np.maximum(a, b).max(axis=-1) < EXPOSED[1])
        if both.sum() < 100:
            continue
        ratio = np.median(np.log(b[both] / a[both]), axis=0)
        normal[[i, j], [i, j]] += 1
        normal[[i, j], [j, i]] -= 1
        right[i] += ratio
        right[j] -= ratio
    gains = np.exp(np.linalg.solve(normal, right))
    return np.clip(gains, 1 / LARGEST_GAIN, LARGEST_GAIN).astype(np.float32)
