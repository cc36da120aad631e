"""The pitch: its markings by the Laws of the Game, and the roof they lie on.

Dimensions are those of IFAB, Laws of the Game, Law 1. Lines belong to the areas they bound, so the outer edge of a
boundary line is the nominal distance and its centre lies half a line width inside. Everything here describes the
*centres* of lines.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches

import numpy as np
from numpy.typing import NDArray

from worker.calibration.camera import Array

CENTRE_CIRCLE_RADIUS_M = 9.15
PENALTY_AREA_DEPTH_M = 16.5
PENALTY_AREA_HALF_WIDTH_M = 20.16
GOAL_AREA_DEPTH_M = 5.5
GOAL_AREA_HALF_WIDTH_M = 9.16
PENALTY_MARK_DISTANCE_M = 11.0
CORNER_ARC_RADIUS_M = 1.0
GOAL_HALF_WIDTH_M = 3.66
GOAL_HEIGHT_M = 2.44
SPOT_RADIUS_M = 0.11
ARC_STEP_M = 0.05
LEAST_HIP_M = 0.5
"""A ridge ends so far from the goal lines at least: a roof has no upright sides."""


@dataclass(frozen=True)
class Marking:
    """A painted line of constant width: its name and the polyline (n, 2) of its centre, metres on the pitch."""

    name: str
    centre: Array
    width: float

    @property
    def closed(self) -> bool:
        """Whether the line ends where it begins."""
        return bool(np.allclose(self.centre[0], self.centre[-1]))


@dataclass(frozen=True)
class LinePoints:
    """Points on the centres of markings, N of them.

    `position` (N, 3) metres; unit `tangent` (N, 3) along the line and unit `normal` (N, 3) across it in the surface;
    `width` (N,) of the line; `marking` (N,) which of `Field.markings()`; `spacing` along the line.
    """

    position: Array
    tangent: Array
    normal: Array
    width: Array
    marking: NDArray[np.intp]
    spacing: float

    def __len__(self) -> int:
        return len(self.position)

    def __getitem__(self, chosen: NDArray[np.bool_] | NDArray[np.intp]) -> LinePoints:
        return LinePoints(
            self.position[chosen],
            self.tangent[chosen],
            self.normal[chosen],
            self.width[chosen],
            self.marking[chosen],
            self.spacing,
        )


@dataclass(frozen=True)
class Field:
    """A football pitch. `ridge`: the paper's p and p', (2, 3), same y and same z; None = flat."""

    length: float
    width: float
    line_width: float = 0.12
    ridge: Array | None = None

    def flat(self) -> Field:
        """The same pitch on a plane."""
        return Field(self.length, self.width, self.line_width, None)

    def raised(self, by: float) -> Field:
        """The same pitch with a ridge that is higher by so many metres; a flat one gets a ridge between hips of 45°."""
        if self.ridge is not None:
            return replace(self, ridge=self.ridge + [0.0, 0.0, by])
        end = max((self.length - self.width) / 2, 0.0)
        return replace(self, ridge=np.array([[-end, 0.0, by], [end, 0.0, by]]))

    @property
    def ridge_height(self) -> float:
        """Of the ridge above the corners; 0 of a flat pitch."""
        return 0.0 if self.ridge is None else float(self.ridge[0, 2])

    @property
    def ridge_length(self) -> float:
        """Between the ends of the ridge; of a flat pitch, of the ridge that `raised` would give it."""
        ridge = self.raised(0.0).ridge
        assert ridge is not None
        return float(abs(ridge[1, 0] - ridge[0, 0]))

    def with_ridge_length(self, length: float) -> Field:
        """The same pitch with the ends of its ridge so far apart, as far as the pitch has room, around where it was."""
        raised = self.raised(0.0)
        assert raised.ridge is not None
        (start, end) = raised.ridge[np.argsort(raised.ridge[:, 0])]
        middle = (start[0] + end[0]) / 2
        half = min(max(length / 2, 0.0), self.length / 2 - abs(middle) - LEAST_HIP_M)
        return replace(raised, ridge=np.array([[middle - half, *start[1:]], [middle + half, *end[1:]]]))

    def height(self, xy: Array) -> Array:
        """Height (...) of the surface at (..., 2): the paper's four-plane hip roof; 0 off the pitch."""
        if self.ridge is None:
            return np.zeros(xy.shape[:-1])
        start, end = self.ridge[np.argsort(self.ridge[:, 0])]
        top, ridge_y = start[2], start[1]
        half_length, half_width = self.length / 2, self.width / 2
        x, y = xy[..., 0], xy[..., 1]
        # Each plane goes through two corners at z = 0 and the ridge (or one of its ends): relative height 0..1.
        planes = np.stack(
            [
                (half_width + y) / (half_width + ridge_y),
                (half_width - y) / (half_width - ridge_y),
                (half_length + x) / (half_length + start[0]),
                (half_length - x) / (half_length - end[0]),
            ]
        )
        return top * np.clip(planes.min(axis=0), 0.0, 1.0)

    def lift(self, xy: Array) -> Array:
        """Points (..., 2) on the pitch to the surface (..., 3)."""
        return np.concatenate([xy, self.height(xy)[..., None]], axis=-1)

    def markings(self) -> list[Marking]:
        """All markings of Law 1, as centre lines."""
        half_line = self.line_width / 2
        x_goal = self.length / 2 - half_line
        y_touch = self.width / 2 - half_line
        lines = [
            self._line("near touchline", (-x_goal, -y_touch), (x_goal, -y_touch)),
            self._line("far touchline", (-x_goal, y_touch), (x_goal, y_touch)),
            self._line("halfway line", (0, -y_touch), (0, y_touch)),
            self._arc("centre circle", (0, 0), CENTRE_CIRCLE_RADIUS_M - half_line, 0, 2 * np.pi),
            self._spot("centre mark", (0, 0)),
        ]
        for side, name in ((-1, "left"), (1, "right")):
            lines += self._end(side, name)
        return lines

    def _end(self, side: int, name: str) -> list[Marking]:
        """The markings of one half: goal line, both areas, mark, arc and corner arcs."""
        half_line = self.line_width / 2
        goal = self.length / 2
        y_touch = self.width / 2 - half_line

        def area(label: str, depth: float, half_width: float) -> list[Marking]:
            x_back, x_front = side * (goal - half_line), side * (goal - depth + half_line)
            y = half_width - half_line
            return [
                self._line(f"{name} {label}, near side", (x_back, -y), (x_front, -y)),
                self._line(f"{name} {label}, front", (x_front, -y), (x_front, y)),
                self._line(f"{name} {label}, far side", (x_front, y), (x_back, y)),
            ]

        mark = side * (goal - PENALTY_MARK_DISTANCE_M)
        radius = CENTRE_CIRCLE_RADIUS_M - half_line
        # The arc begins where it leaves the penalty area, and points to the pitch centre.
        opening = np.arccos((PENALTY_AREA_DEPTH_M - half_line - PENALTY_MARK_DISTANCE_M) / radius)
        towards_centre = np.pi if side > 0 else 0.0
        corner = CORNER_ARC_RADIUS_M - half_line
        lines = [
            self._line(
                f"{name} goal line",
                (side * (goal - half_line), -y_touch),
                (side * (goal - half_line), y_touch),
            ),
            *area("penalty area", PENALTY_AREA_DEPTH_M, PENALTY_AREA_HALF_WIDTH_M),
            *area("goal area", GOAL_AREA_DEPTH_M, GOAL_AREA_HALF_WIDTH_M),
            self._spot(f"{name} penalty mark", (mark, 0)),
            self._arc(f"{name} penalty arc", (mark, 0), radius, towards_centre - opening, towards_centre + opening),
        ]
        for y_side, label in ((-1, "near"), (1, "far")):
            # A quarter circle around the corner flag, inside the pitch.
            facing = np.arctan2(-y_side, -side)
            centre = (side * goal, y_side * self.width / 2)
            lines.append(
                self._arc(f"{name} {label} corner arc", centre, corner, facing - np.pi / 4, facing + np.pi / 4)
            )
        return lines

    def _line(self, name: str, start: tuple[float, float], end: tuple[float, float]) -> Marking:
        return Marking(name, np.array([start, end], dtype=float), self.line_width)

    def _arc(self, name: str, centre: tuple[float, float], radius: float, start: float, end: float) -> Marking:
        count = max(8, int(np.ceil(abs(end - start) * radius / ARC_STEP_M)))
        angle = np.linspace(start, end, count + 1)
        return Marking(
            name,
            np.stack([centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle)], -1),
            self.line_width,
        )

    def _spot(self, name: str, centre: tuple[float, float]) -> Marking:
        # A spot is a line as wide as itself and next to nothing long.
        offset = np.array([SPOT_RADIUS_M / 4, 0.0])
        return Marking(name, np.array([centre - offset, centre + offset]), 2 * SPOT_RADIUS_M)

    def line_points(self, spacing: float = 0.25) -> LinePoints:
        """Points every `spacing` metres on the centres of all markings, on the surface, with directions."""
        return self._line_points([fitting(marking.centre, spacing) for marking in self.markings()], spacing)

    def same_line_points(self, others: LinePoints) -> LinePoints:
        """The points that are those of a pitch of other measures: as many on each marking, as far along it."""
        counts: list[int] = np.bincount(others.marking).tolist()
        return self._line_points(counts, others.spacing)

    def _line_points(self, counts: Sequence[int], spacing: float) -> LinePoints:
        positions, tangents, widths, index = [], [], [], []
        for number, (marking, count) in enumerate(zip(self.markings(), counts, strict=True)):
            xy, along = equal_pieces(marking.centre, count)
            positions.append(xy)
            tangents.append(along)
            widths.append(np.full(len(xy), marking.width))
            index.append(np.full(len(xy), number))
        xy, along = np.concatenate(positions), np.concatenate(tangents)
        across = np.stack([-along[:, 1], along[:, 0]], axis=-1)
        return LinePoints(
            self.lift(xy),
            self._in_surface(xy, along),
            self._in_surface(xy, across),
            np.concatenate(widths),
            np.concatenate(index),
            spacing,
        )

    def _in_surface(self, xy: Array, direction: Array, step: float = 0.01) -> Array:
        """Unit vectors (N, 3) that follow the surface from xy (N, 2) in horizontal directions (N, 2)."""
        move = self.lift(xy + step * direction) - self.lift(xy - step * direction)
        return move / np.linalg.norm(move, axis=-1, keepdims=True)


def resample(polyline: Array, spacing: float) -> tuple[Array, Array]:
    """Points about every `spacing` along a polyline (n, 2), in the middle of equal pieces, and unit tangents there."""
    return equal_pieces(polyline, fitting(polyline, spacing))


def fitting(polyline: Array, spacing: float) -> int:
    """How many pieces of about `spacing` a polyline (n, 2) has, at least one."""
    return max(1, round(float(np.linalg.norm(np.diff(polyline, axis=0), axis=1).sum()) / spacing))


def equal_pieces(polyline: Array, count: int) -> tuple[Array, Array]:
    """The middles (count, 2) of equal pieces of a polyline (n, 2), and unit tangents there."""
    pieces = np.diff(polyline, axis=0)
    lengths = np.linalg.norm(pieces, axis=1)
    reached = np.concatenate([[0.0], np.cumsum(lengths)])
    at = (np.arange(count) + 0.5) * reached[-1] / count
    piece = np.clip(np.searchsorted(reached, at, side="right") - 1, 0, len(pieces) - 1)
    unit = pieces[piece] / lengths[piece, None]
    return polyline[piece] + (at - reached[piece])[:, None] * unit, unit


class UnknownLandmark(ValueError):  # noqa: N818
    """No landmark of the pitch has this name; says which are like it."""


def landmarks(pitch: Field) -> Mapping[str, Array]:
    """Points (3,) of the pitch that can be named and clicked, on its surface, where centres of lines meet.

    Left, right, near and far are as seen from the usual side (y < 0).
    """
    half_line = pitch.line_width / 2
    goal_line, touchline = pitch.length / 2 - half_line, pitch.width / 2 - half_line
    circle = CENTRE_CIRCLE_RADIUS_M - half_line
    flat: dict[str, tuple[float, float]] = {"centre mark": (0.0, 0.0)}
    for y_side, near in ((-1, "near"), (1, "far")):
        flat[f"halfway line, {near} end"] = (0.0, y_side * touchline)
        flat[f"centre circle, {near}"] = (0.0, y_side * circle)
    for side, left in ((-1, "left"), (1, "right")):
        flat[f"{left} penalty mark"] = (side * (pitch.length / 2 - PENALTY_MARK_DISTANCE_M), 0.0)
        opening = PENALTY_AREA_DEPTH_M - half_line - PENALTY_MARK_DISTANCE_M
        arc_end = float(np.sqrt(circle**2 - opening**2))
        for y_side, near in ((-1, "near"), (1, "far")):
            flat[f"{left} {near} corner"] = (side * goal_line, y_side * touchline)
            for area, depth, half_width in (
                ("penalty area", PENALTY_AREA_DEPTH_M, PENALTY_AREA_HALF_WIDTH_M),
                ("goal area", GOAL_AREA_DEPTH_M, GOAL_AREA_HALF_WIDTH_M),
            ):
                y = y_side * (half_width - half_line)
                flat[f"{left} {area}, {near} corner"] = (side * (pitch.length / 2 - depth + half_line), y)
                flat[f"{left} {area}, {near} end"] = (side * goal_line, y)
            front = side * (pitch.length / 2 - PENALTY_AREA_DEPTH_M + half_line)
            flat[f"{left} penalty arc, {near} end"] = (front, y_side * arc_end)
    return {name: pitch.lift(np.array(xy)) for name, xy in flat.items()}


def resolve_landmark(pitch: Field, name: str) -> Array:
    """The point (3,) of a landmark by its name; case, commas and spaces do not matter."""
    known = landmarks(pitch)
    for full, point in known.items():
        if _plain(full) == _plain(name):
            return point
    like = get_close_matches(name, known, n=3, cutoff=0.4) or list(known)[:3]
    raise UnknownLandmark(f"{name!r} is no point of the pitch; did you mean {' or '.join(map(repr, like))}?")


def _plain(name: str) -> str:
    return " ".join(name.replace(",", " ").lower().replace("center", "centre").split())
