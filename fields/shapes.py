"""What is painted: lines, arcs and spots on the plan of a field, metres from its centre, x along and y across."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import pairwise

Point = tuple[float, float]

WHITE = "white"
COLOURS = (WHITE, "yellow", "black", "blue", "red", "green", "orange")
COLOUR_PATTERN = rf"^({'|'.join(COLOURS)}|#[0-9a-fA-F]{{6}})$"
"""Of paint: one of `COLOURS`, or `#rrggbb`."""


@dataclass(frozen=True)
class Line:
    """A polyline through `points`, the middle of the paint; `width` of the paint."""

    name: str
    points: tuple[Point, ...]
    width: float
    colour: str = WHITE

    @property
    def reach(self) -> Point:
        """How far it gets from the centre of the field along x and along y, either way."""
        return _reach(self.points)

    def mirrored(self) -> Line:
        """The same at the other end."""
        return replace(self, points=tuple(map(_other_end, self.points)))

    def shifted(self, by: Point) -> Line:
        """The same so far away."""
        return replace(self, points=tuple(_shifted(point, by) for point in self.points))

    def turned(self, by: float) -> Line:
        """The same turned about the centre of the field, counter-clockwise by so many rad."""
        return replace(self, points=tuple(_turned(point, by) for point in self.points))

    @property
    def length(self) -> float:
        """Along it."""
        return sum(math.dist(*piece) for piece in pairwise(self.points))

    def pieces(self, shares: Iterable[tuple[float, float]]) -> list[Line]:
        """Dashes of a line of two points, each between two shares of its length."""
        (x1, y1), (x2, y2) = self.points

        def at(share: float) -> Point:
            return x1 + share * (x2 - x1), y1 + share * (y2 - y1)

        return [
            replace(self, name=f"{self.name}, dash {n}", points=(at(a), at(b)))
            for n, (a, b) in enumerate(shares, start=1)
        ]


@dataclass(frozen=True)
class Arc:
    """Counter-clockwise around `centre` from angle `start` to `end` (rad, above `start`), the middle of the paint."""

    name: str
    centre: Point
    radius: float
    start: float
    end: float
    width: float
    colour: str = WHITE

    @property
    def reach(self) -> Point:
        """How far it gets from the centre of the field along x and along y, either way."""
        (x, y), quarter = self.centre, math.pi / 2
        # Its ends, and where it runs along an axis.
        level = range(math.ceil(self.start / quarter), math.floor(self.end / quarter) + 1)
        angles = [self.start, self.end, *(n * quarter for n in level)]
        return _reach([(x + self.radius * math.cos(a), y + self.radius * math.sin(a)) for a in angles])

    def mirrored(self) -> Arc:
        """The same at the other end."""
        return replace(self, centre=_other_end(self.centre), start=math.pi - self.end, end=math.pi - self.start)

    def shifted(self, by: Point) -> Arc:
        """The same so far away."""
        return replace(self, centre=_shifted(self.centre, by))

    def turned(self, by: float) -> Arc:
        """The same turned about the centre of the field, counter-clockwise by so many rad."""
        return replace(self, centre=_turned(self.centre, by), start=self.start + by, end=self.end + by)

    @property
    def length(self) -> float:
        """Along it."""
        return (self.end - self.start) * self.radius

    def pieces(self, shares: Iterable[tuple[float, float]]) -> list[Arc]:
        """Dashes, each between two shares of its length."""
        span = self.end - self.start
        return [
            replace(self, name=f"{self.name}, dash {n}", start=self.start + a * span, end=self.start + b * span)
            for n, (a, b) in enumerate(shares, start=1)
        ]


@dataclass(frozen=True)
class Spot:
    """A disc of paint."""

    name: str
    centre: Point
    diameter: float
    colour: str = WHITE

    @property
    def reach(self) -> Point:
        """How far it gets from the centre of the field along x and along y, either way."""
        return _reach([self.centre])

    def mirrored(self) -> Spot:
        """The same at the other end."""
        return replace(self, centre=_other_end(self.centre))

    def shifted(self, by: Point) -> Spot:
        """The same so far away."""
        return replace(self, centre=_shifted(self.centre, by))

    def turned(self, by: float) -> Spot:
        """The same turned about the centre of the field, counter-clockwise by so many rad."""
        return replace(self, centre=_turned(self.centre, by))


Shape = Line | Arc | Spot


def dashes(length: float, paint: float, gap: float) -> list[tuple[float, float]]:
    """Whole dashes from the middle of a length outwards: where each begins and ends, as shares of the length."""
    beside = math.floor((length / 2 - paint / 2) / (paint + gap))
    middles = [length / 2 + n * (paint + gap) for n in range(-beside, beside + 1)]
    return [((middle - paint / 2) / length, (middle + paint / 2) / length) for middle in middles]


def _reach(points: Iterable[Point]) -> Point:
    x, y = zip(*points, strict=True)
    return max(map(abs, x)), max(map(abs, y))


def _other_end(point: Point) -> Point:
    return -point[0], point[1]


def _shifted(point: Point, by: Point) -> Point:
    return point[0] + by[0], point[1] + by[1]


def _turned(point: Point, by: float) -> Point:
    (x, y), along, across = point, math.cos(by), math.sin(by)
    return along * x - across * y, across * x + along * y
