"""What is painted: lines, arcs and spots on the plan of a field, metres from its centre, x along and y across."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

Point = tuple[float, float]


@dataclass(frozen=True)
class Line:
    """A polyline through `points`, the middle of the paint; `width` of the paint."""

    name: str
    points: tuple[Point, ...]
    width: float

    @property
    def reach(self) -> Point:
        """How far it gets from the centre of the field along x and along y, either way."""
        return _reach(self.points)

    def mirrored(self) -> Line:
        """The same at the other end."""
        return Line(self.name, tuple(map(_other_end, self.points)), self.width)

    def dashes(self, paint: float, gap: float) -> list[Line]:
        """Whole dashes from the middle outwards, of a line of two points."""
        (x1, y1), (x2, y2) = self.points
        length = math.dist(*self.points)

        def at(distance: float) -> Point:
            share = distance / length
            return x1 + share * (x2 - x1), y1 + share * (y2 - y1)

        pieces = _pieces(length, paint, gap)
        return [Line(f"{self.name}, dash {n}", (at(a), at(b)), self.width) for n, (a, b) in enumerate(pieces, start=1)]


@dataclass(frozen=True)
class Arc:
    """Counter-clockwise around `centre` from angle `start` to `end` (rad, above `start`), the middle of the paint."""

    name: str
    centre: Point
    radius: float
    start: float
    end: float
    width: float

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
        return Arc(
            self.name, _other_end(self.centre), self.radius, math.pi - self.end, math.pi - self.start, self.width
        )

    def dashes(self, paint: float, gap: float) -> list[Arc]:
        """Whole dashes from the middle outwards."""
        pieces = _pieces((self.end - self.start) * self.radius, paint, gap)
        angles = [(self.start + a / self.radius, self.start + b / self.radius) for a, b in pieces]
        return [
            Arc(f"{self.name}, dash {n}", self.centre, self.radius, *between, self.width)
            for n, between in enumerate(angles, start=1)
        ]


@dataclass(frozen=True)
class Spot:
    """A disc of paint."""

    name: str
    centre: Point
    diameter: float

    @property
    def reach(self) -> Point:
        """How far it gets from the centre of the field along x and along y, either way."""
        return _reach([self.centre])

    def mirrored(self) -> Spot:
        """The same at the other end."""
        return Spot(self.name, _other_end(self.centre), self.diameter)


Shape = Line | Arc | Spot


def _reach(points: Iterable[Point]) -> Point:
    x, y = zip(*points, strict=True)
    return max(map(abs, x)), max(map(abs, y))


def _other_end(point: Point) -> Point:
    return -point[0], point[1]


def _pieces(length: float, paint: float, gap: float) -> list[tuple[float, float]]:
    beside = math.floor((length / 2 - paint / 2) / (paint + gap))
    middles = [length / 2 + n * (paint + gap) for n in range(-beside, beside + 1)]
    return [(middle - paint / 2, middle + paint / 2) for middle in middles]
