"""Reading pictures between pixels."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.scene.camera import Array, Plane

ROW = 1024
"""cv2.remap takes maps of at most 32767 rows and columns: any number of points is laid out in rows of this length."""
FAR_OUTSIDE = -1e6


def bilinear(image: NDArray[np.float32], pixels: Array, outside: float = 0.0) -> NDArray[np.float32]:
    """Values (...) of an image (H, W) at pixels (..., 2); `outside` where a pixel is not in the picture or NaN."""
    flat = pixels.reshape(-1, 2)
    if len(flat) == 0:
        return np.empty(pixels.shape[:-1], dtype=np.float32)
    rows = -(-len(flat) // ROW)
    where = np.full((2, rows * ROW), FAR_OUTSIDE, dtype=np.float32)
    where[:, : len(flat)] = flat.T
    values = bilinear_planes(image, where[0].reshape(rows, ROW), where[1].reshape(rows, ROW), outside)
    return values.reshape(-1)[: len(flat)].reshape(pixels.shape[:-1])


def bilinear_planes(image: NDArray[np.float32], column: Plane, row: Plane, outside: float = 0.0) -> NDArray[np.float32]:
    """The same for columns and rows (P, N) apart, each side of them at most 32767."""
    # fmax and fmin take the number where the other one is NaN.
    x, y = (
        np.fmin(np.fmax(plane, FAR_OUTSIDE), -FAR_OUTSIDE).astype(np.float32, copy=False) for plane in (column, row)
    )
    values = cv2.remap(image, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=outside)
    return np.asarray(values, dtype=np.float32)
