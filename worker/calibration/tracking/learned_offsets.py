"""Offsets of pieces of line from their place in the model, learned from sights and faded by time."""

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array

FORGOTTEN_IN_S = 3600.0
"""Time after which a sight counts 1/e: the sun and the ground move a line's place within a day."""


class LearnedOffsets:
    """Offsets (N,) in px across their lines, each around zero by `beside_px` before it was seen.

    A sight is off by `noise_px`. Information fades exponentially with the time that passes, whether the piece is seen
    or not: a piece that is seen all the time has the mean of about the last hour, one that is not seen is known less
    and less, back to `beside_px` around zero.
    """

    def __init__(self, count: int, beside_px: float, noise_px: float) -> None:
        self._unknown = beside_px**-2
        self._by_sight = noise_px**-2
        self._information = np.zeros(count)
        self._sum = np.zeros(count)

    @property
    def mean(self) -> Array:
        """Expected offset of each piece (N,), px."""
        return self._sum / (self._unknown + self._information)

    @property
    def variance(self) -> Array:
        """Variance of the expected offset of each piece (N,), px²."""
        return 1 / (self._unknown + self._information)

    @property
    def are_known(self) -> NDArray[np.bool_]:
        """True for pieces (N,) that have been seen, not too long ago."""
        # Share of one fresh sight below which a piece counts as never seen.
        return self._information > 0.01 * self._by_sight

    def are_seen_as_often(self, share: float) -> NDArray[np.bool_]:
        """True for pieces (N,) seen of late at least `share`, 0..1, as often as the one seen most."""
        return self._information >= share * self._information.max()

    def learn(self, pieces: NDArray[np.intp], offsets: Array) -> None:
        """Take measured offsets (M,), px, of pieces (M,), each named once."""
        self._information[pieces] += self._by_sight
        self._sum[pieces] += offsets * self._by_sight

    def forget(self, seconds: float) -> None:
        """Let time pass."""
        kept = np.exp(-seconds / FORGOTTEN_IN_S)
        self._information *= kept
        self._sum *= kept
