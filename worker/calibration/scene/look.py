"""What a camera's picture shows at places of the world: sampled at any grid, at the level of detail that calls for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.scene.camera import Array, Camera, inside
from worker.calibration.scene.field import Field

Mask = NDArray[np.bool_]


def ground_grid(columns: int, rows: int, step_m: float, centre: tuple[float, float] = (0.0, 0.0)) -> Array:
    """Pitch points (2 rows + 1, 2 columns + 1, 2) every `step_m` around `centre`: x to the right, y up."""
    x = centre[0] + step_m * np.arange(-columns, columns + 1)
    y = centre[1] + step_m * np.arange(rows, -rows - 1, -1)
    return np.stack(np.meshgrid(x, y), axis=-1)


@dataclass(frozen=True)
class Look:
    """One camera's part of a picture: values (H, W[, C]), where they are valid, and how well the camera sees there."""

    values: NDArray[Any]
    valid: Mask
    quality: NDArray[np.float32]


def look_through(camera: Camera, image: NDArray[Any], pixels: Array) -> Look:
    """Sample a camera's image at pixels (H, W, 2), each at the level of detail that its surroundings call for."""
    valid = inside(pixels, camera.intrinsics.size)
    x, y = (np.ascontiguousarray(pixels[..., axis], np.float32) for axis in (0, 1))
    area = _footprint(x, y)
    level = np.clip(np.floor(0.5 * np.log2(np.maximum(area, 1.0))), 0, 5).astype(np.uint8)
    values = np.zeros((*valid.shape, *image.shape[2:]), image.dtype)
    x[~valid] = y[~valid] = 0
    for number in np.unique(level[valid]):
        small = _shrink(image, 1 << int(number))
        scale = small.shape[1] / image.shape[1], small.shape[0] / image.shape[0]
        place = (x + 0.5) * scale[0] - 0.5, (y + 0.5) * scale[1] - 0.5
        sampled = cv2.remap(small, *place, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        chosen = valid & (level == number)
        values[chosen] = sampled[chosen]
    # 1 in the middle of the camera's picture, next to 0 at its border; the better, the finer it resolves the point.
    width, height = camera.intrinsics.size
    middle = (1 - np.abs(2 * x / (width - 1) - 1)) * (1 - np.abs(2 * y / (height - 1) - 1))
    quality = np.where(valid, np.maximum(middle, 1e-6) * np.sqrt(np.maximum(area, 1e-6)), 0)
    return Look(values, valid, quality)


def ground_view(pitch: Field, camera: Camera, image: NDArray[Any], grid_xy: Array) -> tuple[NDArray[Any], Mask]:
    """What a camera shows at points of the pitch: values (H, W[, C]) at (H, W, 2) metres, and where it sees them.

    `image`: uint8 or float32 (height, width[, C]) of the size of the camera's intrinsics. Values are means over about
    the area between the points of the grid where that is coarser than the image.
    """
    pixels = camera.project(pitch.lift(grid_xy))
    seen = look_through(camera, image, pixels)
    return seen.values, seen.valid & camera.sees(pixels)


def _footprint(x: NDArray[np.float32], y: NDArray[np.float32]) -> NDArray[np.float32]:
    """Area (H, W) in source pixels of each pixel of the picture, from source positions x, y (H, W); 0 where NaN."""
    (x_down, x_right), (y_down, y_right) = np.gradient(x), np.gradient(y)
    return np.nan_to_num(np.abs(x_right * y_down - y_right * x_down), nan=0.0, posinf=0.0)


def _shrink(image: NDArray[Any], factor: int) -> NDArray[Any]:
    if factor == 1:
        return image
    return cv2.resize(image, (image.shape[1] // factor, image.shape[0] // factor), interpolation=cv2.INTER_AREA)
