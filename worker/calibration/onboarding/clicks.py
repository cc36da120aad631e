"""Clicks on points of the field in a picture, and whether they can fix a pose at all."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, inside
from worker.calibration.geometry.lens import Lens

FEWEST_CLICKS = 4


@dataclass(frozen=True)
class Clicks:
    """Clicked points: `names` (N), `world` (N, 3) metres, `pixel` (N, 2)."""

    names: tuple[str, ...]
    world: Array
    pixel: Array

    def __len__(self) -> int:
        return len(self.names)

    def __getitem__(self, chosen: NDArray[np.bool_] | NDArray[np.intp]) -> "Clicks":
        index = np.arange(len(self))[chosen]
        return Clicks(tuple(self.names[i] for i in index), self.world[index], self.pixel[index])

    def swapped(self, first: int, second: int) -> "Clicks":
        """Return the clicks with the labels of two exchanged."""
        order = np.arange(len(self))
        order[[first, second]] = second, first
        return Clicks(tuple(self.names[i] for i in order), self.world[order], self.pixel)

    @property
    def distinct(self) -> int:
        """Number of different points of the world."""
        return len(np.unique(np.round(self.world, 3), axis=0))

    def on_one_line(self, but: str = "") -> str | None:
        """Return why the clicks fix no pose, and what to do, if they lie on one line, or all but one do; None if not.

        With a camera that could turn around a line, whatever one more click says is believed, right or wrong. `but`:
        clicks that are not among these, in words.
        """
        every = _line(self)
        if every is not None:
            return f"all {every.of}{but} {every.lie}: {every.add}"
        for number, name in enumerate(self.names):
            others = _line(self[np.arange(len(self)) != number])
            if others is not None:
                but = f"{but} and {name}" if but else f" but {name}"
                return f"all {others.of}{but} {others.lie}, and nothing would show a mistake in {name}: {others.add}"
        return None


@dataclass(frozen=True)
class _Line:
    """Words about points on one line: what lies there, how, and what to add."""

    of: str
    lie: str
    add: str


class UndeterminedPoseError(Exception):
    """Raised when the clicks cannot fix a pose, whatever they are worth: says what to add or to change."""


def require_a_plane(clicks: Clicks, lens: Lens) -> None:
    """Refuse sets of points that many poses fit alike."""
    if clicks.distinct < FEWEST_CLICKS:
        raise UndeterminedPoseError(
            f"{clicks.distinct} different points are too few: give at least {FEWEST_CLICKS}, better 8 or more"
        )
    outside = [n for n, seen in zip(clicks.names, inside(clicks.pixel, lens.size), strict=True) if not seen]
    if outside:
        width, height = lens.size
        raise UndeterminedPoseError(f"{_listed(outside)}: clicked outside the picture of {width}x{height} pixels")
    every = _line(clicks)
    if every is not None:
        raise UndeterminedPoseError(f"all {every.of} {every.lie}: {every.add}")


def _line(clicks: Clicks) -> _Line | None:
    # Ratio of width to length of a set of points below which they are a line.
    collinear = 0.01
    if _flatness(clicks.world) < collinear:
        return _Line("points", "lie on one line, around which the camera could turn", "add points off that line")
    if _flatness(clicks.pixel) < collinear:
        return _Line("clicks", "lie on one line of the picture", "add points nearer to and farther from the camera")
    return None


def _flatness(points: Array) -> float:
    """Return the ratio of the second to the first extent of points (N, d): 0 for a line."""
    extents = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return float(extents[1] / max(extents[0], 1e-12))


def _listed(names: Sequence[str]) -> str:
    return ", ".join(names[:5]) + (" and others" if len(names) > 5 else "")
