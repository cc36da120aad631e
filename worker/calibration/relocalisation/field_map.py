"""Maps of a field's markings for a search over all poses: points to project, and distances on the ground."""

from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array
from worker.calibration.geometry.field import Field, Marking
from worker.calibration.relocalisation.line_view import labelled_places


@dataclass(frozen=True)
class FieldMap:
    """Points (N, 3) m along the markings; `joined` (N,): True where the next point continues the same marking.

    `nearest` (rows, columns, 2): from the nearest paint to each cell of the ground, m; the cell of row 0, column 0 has
    its centre at `origin` (2,) m and cells are `cell_m` wide. `lines_along_x`: y (m) of the straight lines that run
    along x; `lines_along_y`: x (m) of those along y; `between_circles` (R, 2) m: from each to others of its size.
    `every`: the points are one in so many of those of the whole map.
    """

    points: NDArray[np.float32]
    joined: NDArray[np.bool_]
    nearest: NDArray[np.float32]
    origin: Array
    cell_m: float
    lines_along_x: Array
    lines_along_y: Array
    between_circles: Array
    half_size: Array
    every: int = 1

    @classmethod
    def of(cls, field: Field) -> "FieldMap":
        """Return the map of a field, its roof included; spots are too small to be seen from afar."""
        lines = [marking for marking in field.markings() if not marking.spot]
        fine_m = 0.1
        fine = [_resampled(line, fine_m) for line in lines]
        # Approximate number of points on the markings that each pose of a population projects.
        step = max(fine_m, fine_m * sum(len(points) for points in fine) / 420)
        coarse = [_resampled(line, step) for line in lines]
        everywhere = np.concatenate(fine)
        half = np.abs(everywhere).max(axis=0)
        # Approximate number of cells of the map of distances along the field; never finer than 5 cm.
        cell = max(0.05, 2 * float(half.max()) / 700)
        # Least length of a straight piece, as a part of the longer side of the field: shorter ones (ticks, dashes) name
        # no line that an image line could be.
        shortest = 0.03 * 2 * float(half.max())
        # Margin of the map of distances beside the markings of the field.
        beyond_m = 6.0
        return cls(
            field.lift(np.concatenate(coarse)).astype(np.float32),
            np.concatenate([np.arange(len(points)) < len(points) - 1 for points in coarse]),
            _from_nearest(everywhere, -half - beyond_m, half + beyond_m, cell),
            -half - beyond_m,
            cell,
            _straight(lines, 0, shortest),
            _straight(lines, 1, shortest),
            _between_circles([marking.centre for marking in lines if marking.closed]),
            half,
        )

    def to_paint(self, x: Array, y: Array) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """Return the vectors (2, ...) m from the nearest paint to the cells of ground places, and True on the map."""
        rows, columns = self.nearest.shape[:2]
        left, lowest = self.origin.tolist()
        column = np.floor((x - left) / self.cell_m + 0.5)
        row = np.floor((y - lowest) / self.cell_m + 0.5)
        within = (column >= 0) & (row >= 0) & (column < columns) & (row < rows)
        column, row = (np.where(within, one, 0).astype(np.intp) for one in (column, row))
        # `take` from a flat array is ten times as fast as two indices.
        vectors = self.nearest.reshape(-1, 2).take(row * columns + column, axis=0)
        return np.moveaxis(vectors, -1, 0), within

    @cached_property
    def thinned(self) -> "FieldMap":
        """The map with every fourth of its points, to rank many hypotheses by."""
        at = np.arange(0, len(self.points) - 4, 4)
        joined = np.logical_and.reduce([self.joined[at + ahead] for ahead in range(4)])
        return replace(self, points=self.points[at], joined=joined, every=4 * self.every)

    @cached_property
    def is_symmetric(self) -> bool:
        """True if the field turned by half a turn looks the same, so that each view has a twin."""
        turned = -self.points[:, :2].astype(float)
        beside, _ = self.to_paint(turned[:, 0], turned[:, 1])
        return bool(np.linalg.norm(beside, axis=0).max() < 0.3)


def _resampled(line: Marking, step: float) -> Array:
    """Return points (n, 2) about every `step` metres on the centre of a marking, both ends included."""
    along = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(line.centre, axis=0), axis=1))]
    at = np.linspace(0.0, along[-1], max(2, round(along[-1] / step) + 1))
    return np.stack([np.interp(at, along, line.centre[:, axis]) for axis in (0, 1)], axis=1)


def _from_nearest(paint: Array, low: Array, high: Array, cell: float) -> NDArray[np.float32]:
    """Return the vector (m) from the nearest of the painted places (n, 2) to each cell between two corners."""
    columns, rows = (np.ceil((high - low) / cell).astype(int) + 1).tolist()
    free = np.ones((rows, columns), np.uint8)
    column, row = np.rint((paint - low) / cell).astype(int).T
    free[row, column] = 0
    _, label = cv2.distanceTransformWithLabels(free, cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    here = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1)
    return ((here - labelled_places(np.asarray(label), free)) * cell).astype(np.float32)


def _straight(lines: list[Marking], axis: int, shortest: float) -> Array:
    """Return the places where straight pieces along an axis cross the other one, each value once."""
    found = set()
    for line in lines:
        for start, end in zip(line.centre[:-1], line.centre[1:], strict=True):
            if abs(end[1 - axis] - start[1 - axis]) < 1e-6 and abs(end[axis] - start[axis]) >= shortest:
                found.add(round(float(start[1 - axis]), 3))
    return np.array(sorted(found))


def _between_circles(closed: list[Array]) -> Array:
    """Return the moves (R, 2) from each circle among closed polylines (n, 2) to others of its size."""
    middles = [line[:-1].mean(axis=0) for line in closed]
    radii = [np.linalg.norm(line - middle, axis=1) for line, middle in zip(closed, middles, strict=True)]
    # Difference of radii below which circles are of one size.
    alike_m = 0.05
    circles = [
        (middle, radius.mean()) for middle, radius in zip(middles, radii, strict=True) if np.ptp(radius) < alike_m
    ]
    moves = [
        there - here
        for here, one in circles
        for there, other in circles
        if here is not there and abs(one - other) < alike_m
    ]
    return np.unique(np.round(moves, 3), axis=0) if moves else np.zeros((0, 2))
