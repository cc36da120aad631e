"""ST maps: per pixel of one picture, where to sample the other. One is the frame, the other has no distortion.

The picture without distortion has the size and the camera matrix of the frame. Maps hold the lens alone, not the pose.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array
from worker.calibration.geometry.lens import Lens

StMap = NDArray[np.float32]
# Value of pixels that nothing is behind: outside of every picture, and no NaN, which compositors spread.
NOWHERE = -1.0


def undistorting(lens: Lens) -> StMap:
    """Return, per pixel of the picture without distortion, where to sample the frame (H, W, 2); see `_st_map`."""
    inverse = np.linalg.inv(lens.matrix)

    def sample(pixels: Array) -> Array:
        return lens.distort(_linear(inverse, pixels))

    return _st_map(lens.size, sample)


def distorting(lens: Lens) -> StMap:
    """Return, per pixel of the frame, where to sample the undistorted picture (H, W, 2); see `_st_map`."""

    def sample(pixels: Array) -> Array:
        return _linear(lens.matrix, lens.undistort(pixels))

    return _st_map(lens.size, sample)


def _st_map(size: tuple[int, int], sample: Callable[[Array], Array]) -> StMap:
    """Return (x + 0.5) / width and (y + 0.5) / height of the pixel to sample: 0..1 from the top left corner.

    Pixel centres are at integers, as everywhere in the engine.
    """
    width, height = size
    found = np.empty((height, width, 2), np.float32)
    # Rows at a time: memory is bounded by the stripe, not by the picture.
    stripe = 64
    for top in range(0, height, stripe):
        rows = np.arange(top, min(top + stripe, height))
        pixels = np.stack(np.meshgrid(np.arange(width), rows), axis=-1).astype(float)
        found[rows] = np.nan_to_num((sample(pixels) + 0.5) / [width, height], nan=NOWHERE)
    return found


def _linear(matrix: NDArray[np.floating[Any]], points: Array) -> Array:
    """Map points (..., 2) by an upper triangular matrix (3, 3) with last row 0, 0, 1."""
    return points @ matrix[:2, :2].T + matrix[:2, 2]
