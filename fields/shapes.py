"""Markings on the plan of a field: lines, arcs and spots, in metres from its centre, x along and y across."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Self

Point = tuple[float, float]

WHITE = "white"
COLOURS = (WHITE, "yellow", "black", "blue", "red", "green", "orange")
COLOUR_PATTERN = rf"^({'|'.join(COLOURS)}|#[0-9a-fA-F]{{6}})$"
"""Pattern of a colour of paint: one of `COLOURS`, or `#rrggbb`."""


class _Movable:
    """A shape that is moved by moving its points."""

    def _with_points(self, moved: Callable[[Point], Point]) -> Self:
        raise NotImplementedError

    def mirrored(self) -> Self:
        """Return the shape at the other end of the field: x is negated."""
        return self._with_points(lambda point: (-point[0], point[1]))

    def shifted(self, by: Point) -> Self:
        """Return the shape, `by` metres along x and y away."""
        return self._with_points(lambda point: (point[0] + by[0], point[1] + by[1]))

    def turned(self, by: float) -> Self:
        """Return the shape turned about the centre of the field, counter-clockwise by `by` rad."""
        along, across = math.cos(by), math.sin(by)
        return self._with_points(
            lambda point: (along * point[0] - across * point[1], across * point[0] + along * point[1])
        )


@dataclass(frozen=True)
class Line(_Movable):
    """A polyline of paint: the middle of it runs through `points`; `width` in metres."""

    name: str
    points: tuple[Point, ...]
    width: float
    colour: str = WHITE

    @property
    def reach(self) -> Point:
        """Largest distances from the centre of the field along x and along y, in metres."""
        return _reach(self.points)

    def _with_points(self, moved: Callable[[Point], Point]) -> Self:
        return replace(self, points=tuple(map(moved, self.points)))

    @property
    def length(self) -> float:
        """Length in metres."""
        return sum(math.dist(*piece) for piece in pairwise(self.points))

    def pieces(self, shares: Iterable[tuple[float, float]]) -> list[Line]:
        """Return dashes of a line of two points, each between two shares of its length."""
        (x1, y1), (x2, y2) = self.points

        def at(share: float) -> Point:
            return x1 + share * (x2 - x1), y1 + share * (y2 - y1)

        return [
            replace(self, name=f"{self.name}, dash {n}", points=(at(a), at(b)))
            for n, (a, b) in enumerate(shares, start=1)
        ]


@dataclass(frozen=True)
class Arc(_Movable):
    """An arc of paint: the middle of it runs counter-clockwise from angle `start` to `end` (rad, above `start`)."""

    name: str
    centre: Point
    radius: float
    start: float
    end: float
    width: float
    colour: str = WHITE

    @property
    def reach(self) -> Point:
        """Largest distances from the centre of the field along x and along y, in metres."""
        (x, y), quarter = self.centre, math.pi / 2
        # Its ends, and where it runs along an axis.
        level = range(math.ceil(self.start / quarter), math.floor(self.end / quarter) + 1)
        angles = [self.start, self.end, *(n * quarter for n in level)]
        return _reach([(x + self.radius * math.cos(a), y + self.radius * math.sin(a)) for a in angles])

    def _with_points(self, moved: Callable[[Point], Point]) -> Self:
        return replace(self, centre=moved(self.centre))

    def mirrored(self) -> Self:
        """Return the arc at the other end of the field."""
        return replace(super().mirrored(), start=math.pi - self.end, end=math.pi - self.start)

    def turned(self, by: float) -> Self:
        """Return the arc turned about the centre of the field, counter-clockwise by `by` rad."""
        return replace(super().turned(by), start=self.start + by, end=self.end + by)

    @property
    def length(self) -> float:
        """Length in metres."""
        return (self.end - self.start) * self.radius

    def pieces(self, shares: Iterable[tuple[float, float]]) -> list[Arc]:
        """Return dashes, each between two shares of the length of the arc."""
        span = self.end - self.start
        return [
            replace(self, name=f"{self.name}, dash {n}", start=self.start + a * span, end=self.start + b * span)
            for n, (a, b) in enumerate(shares, start=1)
        ]


@dataclass(frozen=True)
class Spot(_Movable):
    """A disc of paint."""

    name: str
    centre: Point
    diameter: float
    colour: str = WHITE

    @property
    def reach(self) -> Point:
        """Largest distances from the centre of the field along x and along y, in metres."""
        return _reach([self.centre])

    def _with_points(self, moved: Callable[[Point], Point]) -> Self:
        return replace(self, centre=moved(self.centre))


Shape = Line | Arc | Spot


def dashes(length: float, paint: float, gap: float) -> list[tuple[float, float]]:
    """Return the beginning and end of whole dashes from the middle of a length outwards, as shares of the length."""
    each_side = math.floor((length / 2 - paint / 2) / (paint + gap))
    middles = [length / 2 + n * (paint + gap) for n in range(-each_side, each_side + 1)]
    return [((middle - paint / 2) / length, (middle + paint / 2) / length) for middle in middles]


def _reach(points: Iterable[Point]) -> Point:
    x, y = zip(*points, strict=True)
    return max(map(abs, x)), max(map(abs, y))
