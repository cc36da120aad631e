"""Templates: the markings and the named points of a field, by its measures.

A file gives the `[size]` (length, width, line, and what else differs between fields of the sport), the `[measures]`
that follow from it, and then

- `uneven`, how far a usual ground is above or below its plane, a standard deviation in metres, that of turf unless
  given;
- `[[marking]]`, once, and `[[end]]`, at the left end (x < 0) and mirrored at the right one, `{end}` in its name: each a
  `line` through points, an `arc` counter-clockwise around `centre` from the direction of `start` to that of `end`, with
  the distance of `start` as radius, a `circle` or a `spot`; a line and an arc may have a `dash` of `paint` and `gap`.
  A `colour` is white unless given, and `rows` say that a marking is there again and again: each a `step` along x and
  along y and a `count`, rows of rows where there are several. A line of no length is not painted: so may a measure
  leave one out;
- `[points]` and `[end_points]`: names that people use for points, at nominal places, the outer edges of lines where the
  law measures to them. A name with `{distance}` stands for all points at that many metres;
- `[numbers]`, see `fields.numbers`.

Places are pairs of what `fields.measures` reads. Those of markings are the middle of the paint.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

from fields.measures import value
from fields.numbers import PaintedNumbers
from fields.shapes import WHITE, Arc, Line, Point, Shape, Spot, dashes

FILES = Path(__file__).parent
NAMES = tuple(sorted(path.stem for path in FILES.glob("*.toml")))
END = "{end}"
TURF_M = 0.015
"""Standard deviation of the height of turf.

FIFA's and World Rugby's tests allow a centimetre under a straightedge of three metres.
"""


@dataclass(frozen=True)
class Extent:
    """Default of a length of a field, and its least and largest values, in metres.

    `chosen`: True if the rules leave it to each ground, so that a default is a guess.
    """

    default: float
    least: float
    most: float
    what: str = ""
    chosen: bool = False


@dataclass(frozen=True)
class Template:
    """The field of a sport. `size`: the lengths that differ between fields, among them `length`, `width` and `line`.

    `uneven`: how far a usual ground of this sport is above or below its plane, or its roof, a standard deviation in
    metres.
    """

    source: str = ""
    uneven: float = TURF_M
    size: Mapping[str, Extent] = field(default_factory=dict)
    measures: Mapping[str, str | float] = field(default_factory=dict)
    marking: Sequence[Mapping[str, Any]] = ()
    end: Sequence[Mapping[str, Any]] = ()
    points: Mapping[str, Sequence[str | float]] = field(default_factory=dict)
    end_points: Mapping[str, Sequence[str | float]] = field(default_factory=dict)
    numbers: PaintedNumbers | None = None

    def known(self, size: Mapping[str, float]) -> dict[str, float]:
        """Return every measure by its name: those of `size`, or their defaults, and those that follow from them."""
        known = {name: extent.default for name, extent in self.size.items()} | dict(size)
        for name, expression in self.measures.items():
            known[name] = value(expression, known)
        return known

    def markings(self, size: Mapping[str, float], dashed: Mapping[str, float] | None = None) -> list[Shape]:
        """Return all markings: those that are there once, then those of the left end, then of the right one.

        `dashed`: a size near this one whose dashes these are, stretched: as many, and each the same one.
        """
        known = self.known(size)
        nominal = known if dashed is None else self.known(dashed)
        once, left = (
            [shape for entry in entries for shape in _shapes(entry, known, nominal)]
            for entries in (self.marking, self.end)
        )
        return [*once, *(_at(end, shape) for end in ("left", "right") for shape in left)]

    def number_places(self, size: Mapping[str, float]) -> list[tuple[str, float]]:
        """Return each number that is painted and the place of its line along the field; those of both ends."""
        known = self.known(size)
        left = {} if self.numbers is None else {text: value(x, known) for text, x in self.numbers.text.items()}
        return [(text, place) for text, x in left.items() for place in sorted({x, -x})]

    def whole(self, name: str) -> str:
        """Return the name of the whole marking: the broken line of a dash, the row of a mark, or `name` itself."""
        entries = [entry["name"] for entry in self.marking]
        entries += [entry["name"].replace(END, end) for entry in self.end for end in ("left", "right")]
        return max((one for one in entries if f"{name}, ".startswith(f"{one}, ")), key=len, default=name)

    def places(self, size: Mapping[str, float]) -> dict[str, Point]:
        """Return the place of each named point, but for those with `{distance}`."""
        return dict(self._places(self.known(size), measured=False))

    def places_at(self, size: Mapping[str, float], distance: float) -> dict[str, Point]:
        """Return the places of the points with `{distance}` in their names, by these names."""
        return dict(self._places(self.known(size) | {"distance": distance}, measured=True))

    def _places(self, known: Mapping[str, float], *, measured: bool) -> Iterator[tuple[str, Point]]:
        for name, place in self.points.items():
            if ("{distance}" in name) == measured:
                yield name, _point(place, known)
        for end, sign in (("left", 1), ("right", -1)):
            for name, place in self.end_points.items():
                if ("{distance}" in name) == measured:
                    x, y = _point(place, known)
                    yield name.replace(END, end), (sign * x, y)


@cache
def load(name: str) -> Template:
    """Return a template by its name, one of `NAMES`."""
    content = tomllib.loads((FILES / f"{name}.toml").read_text())
    size = {key: Extent(**extent) for key, extent in content["size"].items()}
    numbers = PaintedNumbers(**content["numbers"]) if "numbers" in content else None
    return Template(**content | {"size": size, "numbers": numbers})


def _at(end: str, shape: Shape) -> Shape:
    return replace(shape if end == "left" else shape.mirrored(), name=shape.name.replace(END, end))


def _shapes(entry: Mapping[str, Any], known: Mapping[str, float], nominal: Mapping[str, float]) -> list[Shape]:
    shape = _whole(entry, known)
    if not isinstance(shape, Spot) and shape.length == 0:
        return []
    if "dash" not in entry or isinstance(shape, Spot):
        return _rows(shape, entry.get("rows", ()), known)
    usual = _whole(entry, nominal)
    assert not isinstance(usual, Spot)
    paint, gap = (value(entry["dash"][part], nominal) for part in ("paint", "gap"))
    return [*shape.pieces(dashes(usual.length, paint, gap))]


def _rows(shape: Shape, rows: Sequence[Mapping[str, Any]], known: Mapping[str, float]) -> list[Shape]:
    if not rows:
        return [shape]
    row, *further = rows
    x, y = _point(row["step"], known)
    again = [replace(shape.shifted((n * x, n * y)), name=f"{shape.name}, {n + 1}") for n in range(row["count"])]
    return [one for each in again for one in _rows(each, further, known)]


def _whole(entry: Mapping[str, Any], known: Mapping[str, float]) -> Shape:
    name, width, colour = entry["name"], value(entry.get("width", "line"), known), entry.get("colour", WHITE)
    match entry:
        case {"line": points}:
            return Line(name, tuple(_point(point, known) for point in points), width, colour)
        case {"arc": {"centre": centre, "start": start, "end": end}}:
            return _arc(name, _point(centre, known), _point(start, known), _point(end, known), width, colour)
        case {"circle": {"centre": centre, "radius": radius}}:
            return Arc(name, _point(centre, known), value(radius, known), 0.0, 2 * math.pi, width, colour)
        case {"spot": {"centre": centre, "diameter": diameter}}:
            return Spot(name, _point(centre, known), value(diameter, known), colour)
        case _:
            raise ValueError(f"{name} is neither a line, an arc, a circle nor a spot")


def _arc(name: str, centre: Point, start: Point, end: Point, width: float, colour: str) -> Arc:
    first, last = (math.atan2(y - centre[1], x - centre[0]) for x, y in (start, end))
    return Arc(
        name, centre, math.dist(centre, start), first, last if last > first else last + 2 * math.pi, width, colour
    )


def _point(place: Sequence[str | float], known: Mapping[str, float]) -> Point:
    x, y = place
    return value(x, known), value(y, known)
