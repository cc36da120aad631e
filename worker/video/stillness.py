"""Notices pictures that stand still: a camera or an encoder that hangs sends its last picture again and again.

Every sensor has noise, so two pictures of a camera that works differ. Where encoders smooth it away one picture may be
the same as the one before; nearly all of them for a second are not.
"""

import math

import numpy as np
from numpy.typing import NDArray

Plane = NDArray[np.uint8]

# A share of pictures that change, averaged over about so long: frozen below the one, working above the other. An
# encoder that hangs on one picture still changes it a little with each whole picture, once or twice a second.
OVER_S, FROZEN, WORKING = 1.0, 0.2, 0.5
# Rows that differ in nearly all pictures that do, looked at first.
EVERY_ROW = 61


class Stillness:
    """Compares each picture with the one before."""

    def __init__(self) -> None:
        self.is_frozen = False
        self._last: Plane | None = None
        self._last_s = math.nan
        self._changing = 1.0

    def shows_new(self, luma: Plane, stream_s: float) -> bool:
        """Return True if a picture (H, W), at `stream_s`, differs from the one before and the camera is not frozen."""
        is_changed = self._last is None or not _is_same(self._last, luma)
        passed_s = max(0.0, stream_s - self._last_s) if self._last is not None else 0.0
        self._last, self._last_s = luma, stream_s
        self._changing += (is_changed - self._changing) * (1 - math.exp(-passed_s / OVER_S))
        self.is_frozen = self._changing < (WORKING if self.is_frozen else FROZEN)
        return is_changed and not self.is_frozen


def _is_same(one: Plane, other: Plane) -> bool:
    if one.shape != other.shape:
        return False
    return np.array_equal(one[::EVERY_ROW], other[::EVERY_ROW]) and np.array_equal(one, other)
