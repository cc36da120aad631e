"""Thin bright or dark streaks in a picture, by direction and width: all that a line is before anything is learnt."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Frame
from worker.calibration.geometry.visibility import VisibleLines

DIRECTIONS = 8
"""Number of directions in which streaks are looked for; between two of them little is lost."""
BESIDE_PX = 3
"""Distance from the middle of a streak at which its surroundings are read."""
LEVELS = 3
ALONG_PX = 3
"""Length, to either side, over which a streak is averaged."""
LEAST_CONTRAST = 5.0
"""Least contrast of a streak, of 255: fainter ones are texture, and nothing after this could measure them."""


@dataclass(frozen=True)
class Streaks:
    """Contrast (levels, directions, H, W) of pixels against both of their sides, level by level."""

    strength: tuple[NDArray[np.uint8], ...]

    @classmethod
    def of(cls, picture: Frame) -> "Streaks":
        """Return the streaks of a picture (H, W, 3), in all directions and widths."""
        levels = [_streaks(picture)]
        for level in range(1, LEVELS):
            smaller = cv2.resize(picture, None, fx=0.5**level, fy=0.5**level, interpolation=cv2.INTER_AREA)
            levels.append(_streaks(np.asarray(smaller, dtype=np.uint8)))
        return cls(tuple(levels))

    def widened(self, by_px: int) -> "Streaks":
        """Return the streaks dilated: every pixel has the strongest one within half of `by_px`."""
        return Streaks(
            tuple(
                np.stack([cv2.dilate(plane, np.ones((by_px // 2**level | 1,) * 2, np.uint8)) for plane in planes])
                for level, planes in enumerate(self.strength)
            )
        )

    def read(self, lines: VisibleLines, pixels: Array) -> NDArray[np.float32]:
        """Return the strength (N, K) at pixels (N, K, 2) of streaks with the widths and directions of N lines."""
        level, direction = level_of(lines.width_px), direction_of(lines.normal)[:, None]
        values = np.zeros(pixels.shape[:-1], np.float32)
        for number, planes in enumerate(self.strength):
            chosen = np.flatnonzero(level == number)
            if len(chosen) == 0:
                continue
            _, height, width = planes.shape
            column, row = (np.floor((pixels[chosen, :, axis] + 0.5) / 2**number).astype(np.int32) for axis in (0, 1))
            inside = (column >= 0) & (row >= 0) & (column < width) & (row < height)
            here = planes[direction[chosen], np.where(inside, row, 0), np.where(inside, column, 0)]
            values[chosen] = np.where(inside, here, 0)
        return values


def _streaks(picture: Frame) -> NDArray[np.uint8]:
    """Return the strength (directions, H, W) of streaks whose normals are at multiples of 180° / `DIRECTIONS`.

    The channel that shows each best counts: blue paint on wood and orange paint on turf are as bright as their ground.
    """
    border = BESIDE_PX + ALONG_PX + 2
    height, width, _ = picture.shape
    result = np.empty((DIRECTIONS, height, width), np.uint8)
    around = ((border, border), (border, border), (0, 0))
    padded = np.pad(cv2.GaussianBlur(picture, (3, 3), 0), around, mode="edge").astype(np.uint8)
    for number in range(DIRECTIONS):
        angle = np.pi * number / DIRECTIONS
        normal = np.array([np.cos(angle), np.sin(angle)])
        along = np.rint(ALONG_PX * np.array([-normal[1], normal[0]])).astype(int)
        across = np.rint(BESIDE_PX * normal).astype(int)
        both = cv2.addWeighted(_moved(padded, along, ALONG_PX), 0.5, _moved(padded, -along, ALONG_PX), 0.5, 0)
        line = np.asarray(cv2.addWeighted(both, 2 / 3, _moved(padded, 0 * along, ALONG_PX), 1 / 3, 0), dtype=np.uint8)
        inner, one, other = (_moved(line, side * across, BESIDE_PX + 2) for side in (0, 1, -1))
        bright = cv2.min(cv2.subtract(inner, one), cv2.subtract(inner, other))
        dark = cv2.min(cv2.subtract(one, inner), cv2.subtract(other, inner))
        blue, green, red = cv2.split(cv2.max(bright, dark))
        result[number] = cv2.max(cv2.max(blue, green), red)
    return result


def _moved(padded: NDArray[np.uint8], by: NDArray[np.intp], border: int) -> NDArray[np.uint8]:
    height, width, _ = padded.shape
    return padded[border + by[1] : height - border + by[1], border + by[0] : width - border + by[0]]


def level_of(width_px: Array) -> NDArray[np.intp]:
    """Return the level (N,) in which lines of a width (N,) are looked for."""
    # Widest lines of a level; wider ones are looked for in a picture half as large, or again half of that.
    return np.clip(np.ceil(np.log2(np.maximum(width_px, 1e-3) / 2.5)), 0, LEVELS - 1).astype(np.intp)


def direction_of(normal: Array) -> NDArray[np.intp]:
    """Return the direction (N,) in which lines with these normals (N, 2) are looked for."""
    angle = np.arctan2(normal[:, 1], normal[:, 0])
    return np.rint(angle / (np.pi / DIRECTIONS)).astype(np.intp) % DIRECTIONS
