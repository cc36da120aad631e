"""Contrast of markings: the colour channel in which each stands out from its ground, and whether it is brighter or
darker there.

Green is looked at first: lenses put blue and red elsewhere, up to some pixels towards the edges of the picture (the
violet side of white lines), and the intrinsics are those of green. But blue paint on wood and orange paint on turf can
be as bright in green as their ground.
"""

from collections.abc import Sequence
from enum import IntEnum
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from fields.shapes import WHITE
from worker.calibration.detection.frame_fusion import Sway, median
from worker.calibration.detection.sampling import read_planes
from worker.calibration.geometry.camera import Frame


class Channel(IntEnum):
    """Channel of a frame by its index in BGR, and its brightness."""

    BLUE = 0
    GREEN = 1
    RED = 2
    LUMA = 3


LUMA_SHARES = (0.0722, 0.7152, 0.2126)
"""Shares of blue, green and red in luma, the brightness that video carries for each pixel (BT.709): mostly green."""
CONTRASTS = tuple((channel, sign) for channel in (Channel.GREEN, Channel.RED, Channel.BLUE) for sign in (1, -1))
"""Pairs of a channel and a sign: a marking is brighter (1) or darker (-1) than its ground there. The first pair that
its paint allows is the usual one."""
PAINT = {
    "yellow": (0.1, 0.8, 0.9),
    "black": (0.1, 0.1, 0.1),
    "blue": (0.7, 0.3, 0.1),
    "red": (0.1, 0.1, 0.8),
    "green": (0.2, 0.6, 0.1),
    "orange": (0.1, 0.5, 0.9),
}
"""Reflectance (blue, green, red) of paint by its name, 0..1."""


class PixelReader(Protocol):
    """Picture that is read between its pixels, at given places only."""

    def read(self, channel: int, column: NDArray[np.float32], row: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the brightness (P, N) 0..255 in a channel, at columns and rows (P, N); NaN outside."""
        ...


class Channels:
    """Colour channels of the frames of one camera: for several frames their median, without what walks by.

    `swayed`: how each of several lies beside that still view.
    """

    def __init__(self, frames: Sequence[Frame], swayed: Sequence[Sway] = ()) -> None:
        self._frames = frames
        self._swayed = swayed
        self._read: dict[int, NDArray[np.float32]] = {}

    def __getitem__(self, channel: int) -> NDArray[np.float32]:
        """Return the brightness (H, W) 0..255 in one channel, computed once."""
        if channel not in self._read:
            self._read[channel] = median([_plane(frame, channel) for frame in self._frames], self._swayed)
        return self._read[channel]

    def read(self, channel: int, column: NDArray[np.float32], row: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the brightness (P, N) between the pixels, see `PixelReader`."""
        return read_planes(self[channel], column, row, outside=np.nan)


def _plane(frame: Frame, channel: int) -> NDArray[np.uint8]:
    """Return one channel (H, W) of a frame, its pixels beside each other."""
    if channel == Channel.LUMA:
        return np.asarray(cv2.transform(frame, np.array([LUMA_SHARES])), dtype=np.uint8)
    return np.asarray(cv2.extractChannel(frame, channel), dtype=np.uint8)


def possible_signs(colour: str, channel: int) -> tuple[int, ...]:
    """Return the signs that paint of a colour can have in a channel: brighter (1) or darker (-1) than its ground.

    White allows both: it is what a marking is called unless somebody has said otherwise.
    """
    if colour == WHITE:
        return (1, -1)
    # Reflectance below which paint is hardly ever brighter than its ground in a channel; on ice anything can be darker.
    return (-1,) if _reflectance(colour)[channel] < 0.25 else (1, -1)


def _reflectance(colour: str) -> tuple[float, float, float]:
    if colour.startswith("#"):
        red, green, blue = (int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5))
        return blue, green, red
    return PAINT[colour]
