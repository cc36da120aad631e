"""Ignored parts of a camera's picture: a railing, a screen, burnt-in graphics."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Ignored:
    """Polygons, (n, 2) pixels each, in a picture of `size` (width, height)."""

    polygons: Sequence[NDArray[np.floating]]
    size: tuple[int, int]

    @cached_property
    def area(self) -> NDArray[np.bool_]:
        """Mask (H, W) of the ignored pixels: those in any of the polygons, edges included."""
        area = np.zeros((self.size[1], self.size[0]), np.uint8)
        for polygon in self.polygons:
            cv2.fillPoly(area, [np.rint(polygon * 16).astype(np.int32)], 1, shift=4)
        return area > 0

    def resized(self, size: tuple[int, int]) -> "Ignored":
        """Return the same areas of the picture resized to `size` (width, height)."""
        ratio = np.array(size) / self.size
        return Ignored([(polygon + 0.5) * ratio - 0.5 for polygon in self.polygons], size)

    def at(self, pixels: NDArray[np.floating], size: tuple[int, int]) -> NDArray[np.bool_]:
        """True for ignored pixels (..., 2) of the picture shown at `size`; false outside it."""
        column, row = (
            np.nan_to_num((pixels[..., axis] + 0.5) * self.size[axis] / size[axis] - 0.5, nan=-1.0) for axis in (0, 1)
        )
        within = (column > -0.5) & (row > -0.5) & (column < self.size[0] - 0.5) & (row < self.size[1] - 0.5)
        found = np.zeros(within.shape, bool)
        found[within] = self.area[np.rint(row[within]).astype(int), np.rint(column[within]).astype(int)]
        return found
