"""Resample a camera's picture on a grid in the world, at a matching level of detail."""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Camera, inside
from worker.calibration.geometry.field import Field

Mask = NDArray[np.bool_]


def ground_grid(columns: int, rows: int, step_m: float, centre: tuple[float, float] = (0.0, 0.0)) -> Array:
    """Return field points (2 rows + 1, 2 columns + 1, 2) every `step_m` around `centre`: x to the right, y up."""
    x = centre[0] + step_m * np.arange(-columns, columns + 1)
    y = centre[1] + step_m * np.arange(rows, -rows - 1, -1)
    return np.stack(np.meshgrid(x, y), axis=-1)


def sampled(image: NDArray[Any], pixels: NDArray[np.floating[Any]], valid: Mask) -> NDArray[Any]:
    """Sample an image at pixels (H, W, 2): values (H, W[, C]), 0 where not `valid`.

    Where the pixels lie wider than those of the image, values are means over about the area between them.
    """
    x, y = (np.array(pixels[..., axis], np.float32) for axis in (0, 1))
    level = level_of_detail(pixels)
    values = np.zeros((*valid.shape, *image.shape[2:]), image.dtype)
    x[~valid] = y[~valid] = 0
    pyramid = [image]
    for number in np.unique(level[valid]):
        while len(pyramid) <= number:
            pyramid.append(halved(pyramid[-1]))
        small = pyramid[number]
        scale = small.shape[1] / image.shape[1], small.shape[0] / image.shape[0]
        chosen = valid & (level == number)
        # Far and near lie in bands of the picture.
        around = box(chosen)
        place = (x[around] + 0.5) * scale[0] - 0.5, (y[around] + 0.5) * scale[1] - 0.5
        found = cv2.remap(small, *place, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        values[around][chosen[around]] = found[chosen[around]]
    return values


def halved(image: NDArray[Any]) -> NDArray[Any]:
    """Return an image (H, W[, C]) averaged over squares of two pixels a side."""
    return cv2.resize(image, (image.shape[1] // 2, image.shape[0] // 2), interpolation=cv2.INTER_AREA)


def level_of_detail(pixels: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
    """Return how often (H, W) an image is halved before sampling at pixels (H, W, 2), neighbours in a picture."""
    x, y = (np.array(pixels[..., axis], np.float32) for axis in (0, 1))
    return np.clip(np.floor(0.5 * np.log2(np.maximum(footprint(x, y), 1.0))), 0, 5).astype(np.uint8)


def quality(size: tuple[int, int], pixels: Array) -> NDArray[np.float32]:
    """Return a weight (H, W) of a camera's pixels (H, W, 2), neighbours in a picture: 0 outside its frame of `size`.

    Largest in the middle of the frame, next to 0 at its border; larger where the camera resolves a point more finely.
    """
    x, y = (np.ascontiguousarray(pixels[..., axis], np.float32) for axis in (0, 1))
    width, height = size
    middle = (1 - np.abs(2 * x / (width - 1) - 1)) * (1 - np.abs(2 * y / (height - 1) - 1))
    found: NDArray[np.float32] = np.maximum(middle, 1e-6) * np.sqrt(np.maximum(footprint(x, y), 1e-6))
    return found


def box(mask: Mask) -> tuple[slice, slice]:
    """Return the rows and columns of the bounding box of a mask (H, W) that is not empty."""
    rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    return slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)


def ground_view(pitch: Field, camera: Camera, image: NDArray[Any], grid_xy: Array) -> tuple[NDArray[Any], Mask]:
    """Sample a camera's image at field points (H, W, 2), m: values (H, W[, C]), and a mask (H, W) of points in view.

    `image`: uint8 or float32 (height, width[, C]) of the size of the camera's intrinsics. Values are means over about
    the area between the points of the grid where that is coarser than the image.
    """
    pixels = camera.project(pitch.lift(grid_xy))
    valid = inside(pixels, camera.intrinsics.size)
    return sampled(image, pixels, valid), valid & camera.sees(pixels)


def footprint(x: NDArray[np.float32], y: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the area (H, W) in source pixels of each pixel, from source positions x, y (H, W); 0 where NaN."""
    (x_down, x_right), (y_down, y_right) = np.gradient(x), np.gradient(y)
    return np.nan_to_num(np.abs(x_right * y_down - y_right * x_down), nan=0.0, posinf=0.0)
