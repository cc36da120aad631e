"""Reading pictures between pixels, and reducing them."""

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Plane
from worker.calibration.geometry.ground_view import halved

MOST_ROWS = 32766
"""Most rows of a map for cv2.remap, and most columns."""
FAR_OUTSIDE = -1e6


def bilinear(image: NDArray[np.float32], pixels: Array, outside: float = 0.0) -> NDArray[np.float32]:
    """Sample an image (H, W) at pixels (..., 2); `outside` where a pixel is not in the picture or NaN."""
    flat = pixels.reshape(-1, 2)
    # Length of the rows in which any number of points is laid out.
    length = 1024
    rows = -(-len(flat) // length)
    where = np.full((2, rows * length), FAR_OUTSIDE, dtype=np.float32)
    where[:, : len(flat)] = flat.T
    values = bilinear_planes(image, where[0].reshape(rows, length), where[1].reshape(rows, length), outside)
    return values.reshape(-1)[: len(flat)].reshape(pixels.shape[:-1])


def bilinear_planes(image: NDArray[np.float32], column: Plane, row: Plane, outside: float = 0.0) -> NDArray[np.float32]:
    """Sample an image (H, W) at columns and rows (P, N) apart, N at most `MOST_ROWS`; see `bilinear`."""
    # fmax and fmin take the number where the other one is NaN.
    x, y = (
        np.fmin(np.fmax(plane, FAR_OUTSIDE), -FAR_OUTSIDE).astype(np.float32, copy=False) for plane in (column, row)
    )
    return read_planes(image, x, y, outside)


def read_planes(
    image: NDArray[np.float32], column: NDArray[np.float32], row: NDArray[np.float32], outside: float = 0.0
) -> NDArray[np.float32]:
    """Sample at columns and rows (P, N) that are all finite."""
    if column.size == 0:
        return np.empty(column.shape, dtype=np.float32)
    parts = [
        cv2.remap(image, column[some], row[some], cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=outside)
        for some in (slice(first, first + MOST_ROWS) for first in range(0, len(column), MOST_ROWS))
    ]
    return np.asarray(parts[0] if len(parts) == 1 else np.concatenate(parts), dtype=np.float32)


def read_bytes(image: NDArray[np.uint8], column: NDArray[np.float32], row: NDArray[np.float32]) -> NDArray[np.float32]:
    """Sample an image (H, W) of bytes at finite columns and rows (P, N), to whole grey levels.

    Beyond the border of the image it is the value at the border.
    """
    if column.size == 0:
        return np.empty(column.shape, dtype=np.float32)
    read = cv2.remap(image, column, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(read, dtype=np.float32)


def reduce_by_area(picture: NDArray[np.uint8], size: tuple[int, int]) -> NDArray[np.uint8]:
    """Return a picture (H, W[, C]) reduced to `size` (width, height), to means of areas.

    It is halved first where a picture of half the size is still twice too large: OpenCV halves a 4K frame three times
    as fast as it reduces it otherwise.
    """
    while picture.shape[1] >= 4 * size[0] and picture.shape[0] >= 4 * size[1]:
        picture = halved(picture)
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
