"""The pitch: its markings by the template of its sport, and the roof they lie on.

Everything here describes the *centres* of lines.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from fields.landmarks import find
from fields.shapes import WHITE, Arc, Line, Shape
from fields.template import TURF_M, Template, load
from worker.calibration.geometry.arrays import Array, take_rows

FOOTBALL = load("football")
MEASURED_SPACING_M = 0.25
"""Distance between the line points that are measured."""


@dataclass(frozen=True)
class Marking:
    """A painted line of constant width: its name and the polyline (n, 2) of its centre, metres on the pitch.

    `colour`: of the paint, one of `fields.shapes.COLOURS` or `#rrggbb`.
    """

    name: str
    centre: Array
    width: float
    colour: str = WHITE

    @property
    def closed(self) -> bool:
        """True if the line ends where it begins."""
        return bool(np.allclose(self.centre[0], self.centre[-1]))

    @property
    def length(self) -> float:
        """Distance (m) between its ends."""
        return float(np.linalg.norm(self.centre[-1] - self.centre[0]))

    @property
    def spot(self) -> bool:
        """True if the marking is a disc: wider than it is long."""
        return self.length < self.width and not self.closed


@dataclass(frozen=True)
class LinePoints:
    """Points on the centres of markings, N of them.

    `position` (N, 3) metres; unit `tangent` (N, 3) along the line and unit `normal` (N, 3) across it in the surface;
    `width` (N,) of the line; `marking` (N,) which of `Field.markings()`; `colour` (N,) of its paint; `end_to_end` (N,):
    True for the middle of a short mark as a line across itself, whose width is the mark's length; `spacing` along the
    line; `uneven_m`: how far a usual ground of the sport is above or below the surface, a standard deviation.
    """

    position: Array
    tangent: Array
    normal: Array
    width: Array
    marking: NDArray[np.intp]
    colour: NDArray[np.str_]
    end_to_end: NDArray[np.bool_]
    spacing: float
    uneven_m: float = TURF_M

    def __len__(self) -> int:
        return len(self.position)

    def __getitem__(self, chosen: NDArray[np.bool_] | NDArray[np.intp]) -> "LinePoints":
        return take_rows(self, chosen)


@dataclass(frozen=True)
class Field:
    """A field of a sport, a football pitch unless said; `measures`: what else its template leaves open, in metres.

    `ridge`: the paper's p and p', (2, 3), same y and same z; None = flat. A goal line at which it ends goes over the
    crown, as in stadiums; every other one is level. `stretched_from`: the field whose dashes its
    broken lines have, and whose points all its lines, as many and stretched with them. `others`: what else is painted
    there, of no use. `sigma`: how well numbers of it are known, m, by the names of `parameters.field_parameters`.
    """

    length: float
    width: float
    line_width: float = 0.12
    ridge: Array | None = None
    template: Template = FOOTBALL
    measures: Mapping[str, float] = field(default_factory=dict)
    stretched_from: "Field | None" = None
    others: Sequence[Shape] = ()
    sigma: Mapping[str, float] = field(default_factory=dict)

    def resized(self, *, length: float | None = None, width: float | None = None) -> "Field":
        """Return the field with another length or width, point by point, ridge and all, and with as many dashes."""
        length, width = self.length if length is None else length, self.width if width is None else width
        ridge = None if self.ridge is None else self.ridge * [length / self.length, width / self.width, 1.0]
        return replace(self, length=length, width=width, ridge=ridge, stretched_from=self._unstretched)

    def drawn_anew(self) -> "Field":
        """Return the field with as many dashes and points as fit on its lines."""
        return replace(self, stretched_from=None)

    def flat(self) -> "Field":
        """Return the field without a ridge, on a plane."""
        return replace(self, ridge=None)

    def raised(self, by: float) -> "Field":
        """Return the field with its ridge raised by so many metres; a flat one gets a ridge between hips of 45°."""
        if self.ridge is not None:
            return self._with_ridge(self.ridge + [0.0, 0.0, by])
        end = max((self.length - self.width) / 2, 0.0)
        return self._with_ridge(np.array([[-end, 0.0, by], [end, 0.0, by]]))

    def _with_ridge(self, ridge: Array) -> "Field":
        # The same markings, drawn once for all heights that are tried.
        return replace(self, ridge=ridge, stretched_from=self._unstretched)

    def roofs(self) -> list["Field"]:
        """Return the field on the roofs that it may lie on: its own, or if it is flat, gables and hips of 45°.

        The ridge of a gabled field ends at its goal lines, as in stadiums. Both have no height yet.
        """
        return [self] if self.ridge is not None else [self.with_ridge_length(self.length), self.raised(0.0)]

    @property
    def ridge_height(self) -> float:
        """Height (m) of the ridge above the corners; 0 for a flat field."""
        return 0.0 if self.ridge is None else float(self.ridge[0, 2])

    @property
    def ridge_length(self) -> float:
        """Distance (m) between the ends of the ridge; for a flat field, of the ridge that `raised` would add."""
        ridge = self.raised(0.0).ridge
        assert ridge is not None
        return float(abs(ridge[1, 0] - ridge[0, 0]))

    def with_ridge_length(self, length: float) -> "Field":
        """Return the field with a ridge of this length (m) about the same middle, as far as the field has room."""
        raised = self.raised(0.0)
        assert raised.ridge is not None
        (start, end) = raised.ridge[np.argsort(raised.ridge[:, 0])]
        middle = (start[0] + end[0]) / 2
        half = min(max(length / 2, 0.0), self.length / 2 - abs(middle))
        return self._with_ridge(np.array([[middle - half, *start[1:]], [middle + half, *end[1:]]]))

    @property
    def roof_planes(self) -> list[tuple[float, float, float, float]]:
        """Planes (u, v, a, b) of the roof: at (x, y) each is (u x + v y + a) / b of the ridge's height up.

        A goal line at which the ridge ends has none: it goes over the crown.
        """
        assert self.ridge is not None
        start, end = self.ridge[np.argsort(self.ridge[:, 0])]
        half_length, half_width = self.length / 2, self.width / 2
        sides = [(0.0, 1.0, half_width, half_width + start[1]), (0.0, -1.0, half_width, half_width - start[1])]
        hips = [(1.0, 0.0, half_length, half_length + start[0]), (-1.0, 0.0, half_length, half_length - end[0])]
        # No ground falls by a crown within a metre; but a length may have been measured again since the ridge was.
        return [*sides, *(hip for hip in hips if hip[3] >= 1.0)]

    def height(self, xy: Array) -> Array:
        """Return the height (...) of the surface at (..., 2): the paper's hip roof, 0 off the field.

        Behind a goal line at which the ridge ends the ground goes on.
        """
        if self.ridge is None:
            return np.zeros(xy.shape[:-1])
        x, y = xy[..., 0], xy[..., 1]
        planes = [(a + (u * x + v * y)) / b for u, v, a, b in self.roof_planes]
        return self.ridge_height * np.clip(np.min(planes, axis=0), 0.0, 1.0)

    def lift(self, xy: Array) -> Array:
        """Return points (..., 2) of the field lifted to its surface (..., 3)."""
        return np.concatenate([xy, self.height(xy)[..., None]], axis=-1)

    def markings(self) -> list[Marking]:
        """Return all markings of the template, as centre lines."""
        return list(self._markings)

    @cached_property
    def _markings(self) -> list[Marking]:
        if self._unstretched is not self and self._unstretched._size == self._size:
            return self._unstretched._markings
        return [_marking(shape) for shape in self.template.markings(self._size, self._unstretched._size)]

    @property
    def _size(self) -> dict[str, float]:
        return {"length": self.length, "width": self.width, "line": self.line_width, **self.measures}

    @property
    def _unstretched(self) -> "Field":
        return self.stretched_from or self

    @cached_property
    def _marks(self) -> list[int]:
        return marks_with_free_ends(self.markings())

    def whole_names(self) -> list[str]:
        """Return the name of what each marking is a part of: one name for all dashes of a broken line."""
        return [self.template.whole(marking.name) for marking in self.markings()]

    def number_places(self) -> list[tuple[str, float]]:
        """Return each number that is painted on the field, and the place (m along it) of the line it stands at."""
        return self.template.number_places(self._size)

    def places(self) -> dict[str, Array]:
        """Return the named points of the template on the surface, (3,) each."""
        return {name: self.lift(np.array(point)) for name, point in self.template.places(self._size).items()}

    def place(self, name: str) -> Array:
        """Return the point (3,) of a name on the surface. Raises `fields.landmarks.UnknownLandmark`."""
        return self.lift(np.array(find(name, self.template, self._size)))

    def line_points(self, spacing: float = MEASURED_SPACING_M) -> LinePoints:
        """Return points every `spacing` metres on the centres of all markings, on the surface, with directions."""
        if spacing not in self._drawn:
            self._drawn[spacing] = self._line_points(self.markings(), self._point_counts(spacing), spacing)
        return self._drawn[spacing]

    @cached_property
    def measured_points(self) -> LinePoints:
        """Return `line_points`, and after them the middles of the marks that are measured from end to end as well.

        The sides of a mark say where it is across itself, and its ends where it is along itself. Marks are those with
        two ends beside which there is no other paint: of hash marks, dashes of rugby, the 7-metre line of handball.
        """
        counts = self._point_counts(MEASURED_SPACING_M)
        return self._line_points(self.markings(), counts, MEASURED_SPACING_M, self._unstretched._marks)

    def _point_counts(self, spacing: float) -> list[int]:
        return [fitting(marking.centre, spacing) for marking in self._unstretched.markings()]

    @cached_property
    def _drawn(self) -> dict[float, LinePoints]:
        """Line points by their spacing: a calibration asks for them dozens of times."""
        return {}

    @cached_property
    def point_shifts(self) -> dict[str, Array]:
        """Shifts (N, 3) of the measured points by a parameter, metres per metre, by its name, as far as computed."""
        return {}

    def other_points(self, spacing: float = 0.25) -> LinePoints | None:
        """Return the line points of `others`, lines that are painted there and not the field's; None without any."""
        others = [_marking(shape) for shape in self.others]
        if not others:
            return None
        return self._line_points(others, [fitting(marking.centre, spacing) for marking in others], spacing)

    def _line_points(
        self, markings: Sequence[Marking], counts: Sequence[int], spacing: float, marks: Sequence[int] = ()
    ) -> LinePoints:
        """Return `counts` points on each of the markings, and one in the middle of each of the `marks` among them."""
        positions, tangents, widths, index = [], [], [], []
        for number, (marking, count) in enumerate(zip(markings, counts, strict=True)):
            xy, along = equal_pieces(marking.centre, count)
            positions.append(xy)
            tangents.append(along)
            widths.append(np.full(len(xy), marking.width))
            index.append(np.full(len(xy), number))
        for number in marks:
            xy, along = equal_pieces(markings[number].centre, 1)
            positions.append(xy)
            tangents.append(np.stack([-along[:, 1], along[:, 0]], axis=-1))
            widths.append(np.array([markings[number].length]))
            index.append(np.array([number]))
        xy, along, which = np.concatenate(positions), np.concatenate(tangents), np.concatenate(index)
        across = np.stack([-along[:, 1], along[:, 0]], axis=-1)
        return LinePoints(
            self.lift(xy),
            self._in_surface(xy, along),
            self._in_surface(xy, across),
            np.concatenate(widths),
            which,
            np.array([marking.colour for marking in markings])[which],
            np.arange(len(which)) >= sum(counts),
            spacing,
            self.template.uneven,
        )

    def _in_surface(self, xy: Array, direction: Array, step: float = 0.01) -> Array:
        """Return unit vectors (N, 3) that follow the surface from xy (N, 2) in horizontal directions (N, 2)."""
        move = self.lift(xy + step * direction) - self.lift(xy - step * direction)
        return move / np.linalg.norm(move, axis=-1, keepdims=True)


def marks_with_free_ends(markings: Sequence[Marking]) -> list[int]:
    """Return the numbers of the straight markings without other paint for their own length beyond either end."""
    marks = [n for n, one in enumerate(markings) if len(one.centre) == 2 and not one.spot]
    if not marks:
        return []
    pieces = np.concatenate([np.stack([one.centre[:-1], one.centre[1:]], axis=1) for one in markings])
    counts = [len(one.centre) - 1 for one in markings]
    owner, half_width = (
        np.repeat(of_marking, counts) for of_marking in (np.arange(len(markings)), [m.width / 2 for m in markings])
    )
    ends = np.stack([markings[n].centre for n in marks])
    half_length = np.array([markings[n].length / 2 for n in marks])[:, None]
    along = (ends[:, 1] - ends[:, 0]) / (2 * half_length)
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    # Of every piece of paint by every mark: how far ahead of its middle and beside it the piece begins and ends.
    from_middle = pieces - ends.mean(axis=1)[:, None, None]
    ahead, beside = (np.einsum("mpej,mj->mpe", from_middle, axis) for axis in (along, across))
    reach = half_width + half_width[np.searchsorted(owner, marks)][:, None]
    touches = (beside.min(axis=2) < reach) & (beside.max(axis=2) > -reach) & (owner != np.array(marks)[:, None])
    at_an_end = [
        (side.max(axis=2) > half_length - half_width) & (side.min(axis=2) < 3 * half_length + half_width)
        for side in (ahead, -ahead)
    ]
    free = ~(touches & np.logical_or(*at_an_end)).any(axis=1)
    return [number for number, is_free in zip(marks, free, strict=True) if is_free]


def resample(polyline: Array, spacing: float) -> tuple[Array, Array]:
    """Return points about every `spacing` along a polyline (n, 2), in the middle of equal pieces, and unit tangents."""
    return equal_pieces(polyline, fitting(polyline, spacing))


def fitting(polyline: Array, spacing: float) -> int:
    """Return the number of pieces of about `spacing` in a polyline (n, 2), at least one."""
    return max(1, round(float(np.linalg.norm(np.diff(polyline, axis=0), axis=1).sum()) / spacing))


def equal_pieces(polyline: Array, count: int) -> tuple[Array, Array]:
    """Return the middles (count, 2) of equal pieces of a polyline (n, 2), and unit tangents there."""
    pieces = np.diff(polyline, axis=0)
    lengths = np.linalg.norm(pieces, axis=1)
    reached = np.concatenate([[0.0], np.cumsum(lengths)])
    at = (np.arange(count) + 0.5) * reached[-1] / count
    piece = np.clip(np.searchsorted(reached, at, side="right") - 1, 0, len(pieces) - 1)
    unit = pieces[piece] / lengths[piece, None]
    return polyline[piece] + (at - reached[piece])[:, None] * unit, unit


def _marking(shape: Shape) -> Marking:
    match shape:
        case Line():
            return Marking(shape.name, np.array(shape.points), shape.width, shape.colour)
        case Arc():
            count = max(8, int(np.ceil((shape.end - shape.start) * shape.radius / 0.05)))
            angle = np.linspace(shape.start, shape.end, count + 1)
            around = shape.radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
            return Marking(shape.name, shape.centre + around, shape.width, shape.colour)
        case _:
            # A spot is a line as wide as itself and next to nothing long.
            offset = np.array([shape.diameter / 8, 0.0])
            across = np.array([shape.centre - offset, shape.centre + offset])
            return Marking(shape.name, across, shape.diameter, shape.colour)
