"""Thin bright or dark streaks in a picture, by direction and width: all that a line is before anything is learnt."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Frame
from worker.calibration.geometry.visibility import VisibleLines

DIRECTIONS = 8
"""Streaks are looked for in so many directions; between two of them little is lost."""
BESIDE_PX = 3
"""How far beside the middle of a streak its surroundings are read."""
WIDEST_PX = 2.5
"""Lines wider than that are looked for in a picture half as large, or again half of that."""
LEVELS = 3
ALONG_PX = 3
"""A streak is averaged over so much of its length, to either side."""
LEAST_CONTRAST = 5.0
"""Of 255: fainter streaks are texture, and nothing after this could measure them."""


@dataclass(frozen=True)
class Streaks:
    """How much (levels, directions, H, W) a pixel stands out from both sides; coarser levels are repeated to size."""

    strength: tuple[NDArray[np.uint8], ...]

    @classmethod
    def of(cls, picture: Frame) -> Streaks:
        """Those of a picture (H, W, 3), in all directions and widths."""
        levels = [_streaks(picture)]
        for level in range(1, LEVELS):
            smaller = cv2.resize(picture, None, fx=0.5**level, fy=0.5**level, interpolation=cv2.INTER_AREA)
            levels.append(_streaks(np.asarray(smaller, dtype=np.uint8)))
        return cls(tuple(levels))

    def widened(self, by_px: int) -> Streaks:
        """The same with every streak as strong as the strongest within half of `by_px`."""
        return Streaks(
            tuple(
                np.stack([cv2.dilate(plane, np.ones((by_px // 2**level | 1,) * 2, np.uint8)) for plane in planes])
                for level, planes in enumerate(self.strength)
            )
        )

    def read(self, lines: VisibleLines, pixels: Array) -> NDArray[np.float32]:
        """Strength (N, K) at pixels (N, K, 2) of streaks as wide as N lines and in their directions; 0 outside."""
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
    """Strength (directions, H, W) of streaks across which the normal points at multiples of 180° / `DIRECTIONS`.

    In the channel that shows each best: blue paint on wood and orange paint on turf are as bright as their ground.
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
    """The level (N,) in which lines so wide (N,) are looked for."""
    return np.clip(np.ceil(np.log2(np.maximum(width_px, 1e-3) / WIDEST_PX)), 0, LEVELS - 1).astype(np.intp)


def direction_of(normal: Array) -> NDArray[np.intp]:
    """The direction (N,) in which lines with these normals (N, 2) are looked for."""
    angle = np.arctan2(normal[:, 1], normal[:, 0])
    return np.rint(angle / (np.pi / DIRECTIONS)).astype(np.intp) % DIRECTIONS
