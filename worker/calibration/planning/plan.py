"""Plan of an installation: what each camera would see of a field, and how exactly it would be calibrated.

The covariance is the engine's own, of the lines that the cameras would see (`refinement.expected_errors`); only the
measurements are expected ones.
"""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.line_measurement import Measurements
from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.derivatives import pixel_jacobian
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.visibility import VisibleLines
from worker.calibration.planning.ground_errors import ground_error_jacobian, sigmas
from worker.calibration.planning.line_state import LineState, expect_measurements
from worker.calibration.refinement.expected_errors import ErrorModel
from worker.calibration.refinement.uncertainty import GroundSigma, Sigma

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class CameraPlan:
    """Plan of one camera. Maps (H, W) lie on the grid of the plan, NaN where the camera sees nothing.

    `sigma` of the pose that a calibration answers for the lens as given, `refined` of the one found with its lens,
    `by_measurement` of one whose lens and field are known to the last digit. `place_m`: sigma of a player's place on
    the ground, `calibrated_m` the part of it by pose, lens and field, `measured_m` the part of that by the measurement
    of the lines alone. `px_per_metre` across the line of sight, `px_per_metre_along` it. `measured`: the expected
    measurements, and `line_m` the length of each marking (K,) that they stand for. `markings`: how well pose and lens
    together know where markings are, None where none is in view: what the gate asks.
    """

    camera: Camera
    sigma: Sigma
    refined: Sigma
    by_measurement: Sigma
    place_m: Array
    calibrated_m: Array
    measured_m: Array
    px_per_metre: Array
    px_per_metre_along: Array
    measured: Measurements
    line_m: Array
    markings: GroundSigma | None

    @property
    def seen(self) -> Mask:
        """True (H, W) where the camera sees the ground."""
        return np.isfinite(self.place_m)

    @property
    def share(self) -> float:
        """Share of the field in view, 0..1."""
        return float(self.seen.mean())


@dataclass(frozen=True)
class PairPlan:
    """Plan of two cameras that see some of the same ground: `seen` (H, W).

    `stitch_m`: distance between the places where they put the same ground, root of the mean square over what both see;
    `line_m` (K,): of each marking, what both measure.
    """

    first: str
    second: str
    seen: Mask
    stitch_m: float
    line_m: Array


@dataclass(frozen=True)
class Plan:
    """Plan of all cameras, made by `planner`.

    `xy` (H, W, 2): centres of the cells of its maps, m, row by row from the far touchline.
    """

    pitch: Field
    state: LineState
    hidden: float
    xy: Array
    cameras: Sequence[CameraPlan]
    pairs: Sequence[PairPlan]
    planner: "Planner"

    @property
    def cell_m2(self) -> float:
        """Area of a cell, m²."""
        return self.pitch.length * self.pitch.width / (self.xy.shape[0] * self.xy.shape[1])

    @cached_property
    def place_m(self) -> Array:
        """Sigma (H, W) of a player's place by the camera that knows it best, m; NaN where none sees the ground."""
        return np.fmin.reduce([one.place_m for one in self.cameras])

    @cached_property
    def px_per_metre(self) -> Array:
        """Pixels (H, W) per metre in the camera that resolves a place best."""
        return np.fmax.reduce([one.px_per_metre for one in self.cameras])

    @property
    def coverage(self) -> NDArray[np.intp]:
        """Number (H, W) of cameras that see each cell."""
        return np.sum([one.seen for one in self.cameras], axis=0)


def plan(pitch: Field, cameras: Sequence[Camera], state: LineState, hidden: float = 0.0) -> Plan:
    """Return the plan of cameras at their poses, `hidden` a share of all lines that something covers."""
    return Planner(pitch, cameras, state, hidden).plan()


def field_cells(pitch: Field) -> Array:
    """Return the centres (H, W, 2) of about square cells of a field, m, row by row from the far touchline."""
    columns = 50
    rows = max(round(columns * pitch.width / pitch.length), 1)
    x = ((np.arange(columns) + 0.5) / columns - 0.5) * pitch.length
    y = (0.5 - (np.arange(rows) + 0.5) / rows) * pitch.width
    return np.stack(np.meshgrid(x, y), axis=-1)


class Planner:
    """Expected measurements and errors of all cameras, and the ground that each of them sees."""

    def __init__(self, pitch: Field, cameras: Sequence[Camera], state: LineState, hidden: float) -> None:
        self._pitch, self._cameras, self._state, self._hidden = pitch, list(cameras), state, hidden
        self._lines, self._xy = pitch.measured_points, field_cells(pitch)
        self._ground = pitch.lift(self._xy)
        self._measured = [self._expected(camera) for camera in cameras]
        self._seen = [self._in_view(camera) for camera in cameras]
        self._model = ErrorModel(pitch, cameras)
        self.errors = self._model.expect(self._measured)
        self._jacobians = dict[int, Array]()

    def with_moved(self, moved: Mapping[int, Camera]) -> "Planner":
        """Return the planner with some cameras, by their numbers, at other poses; what the others see is the same."""
        other = copy(self)
        other._cameras, other._measured, other._seen = [*self._cameras], [*self._measured], [*self._seen]
        for number, camera in moved.items():
            other._cameras[number] = camera
            other._measured[number], other._seen[number] = self._expected(camera), self._in_view(camera)
        other._model = self._model.at_poses(other._cameras)
        other.errors = other._model.expect(other._measured)
        other._jacobians = {number: its for number, its in self._jacobians.items() if number not in moved}
        return other

    def _expected(self, camera: Camera) -> Measurements:
        return expect_measurements(self._lines, camera, self._state, self._hidden)

    def _in_view(self, camera: Camera) -> Mask:
        return camera.sees(camera.project(self._ground))

    def plan(self) -> Plan:
        """Return the plan of all cameras and pairs."""
        pairs = list(combinations(range(len(self._cameras)), 2))
        return Plan(
            self._pitch,
            self._state,
            self._hidden,
            self._xy,
            [self.camera(number) for number in range(len(self._cameras))],
            [self.pair(*pair) for pair in pairs if self.both_see(*pair).any()],
            self,
        )

    def calibrated_without(self, markings: Sequence[int]) -> list[Array]:
        """Return `CameraPlan.calibrated_m` (H, W) of each camera if some markings were not painted."""
        measured = [its[~np.isin(its.points.marking, markings)] for its in self._measured]
        covariance = self._model.expect(measured).as_given
        return [
            _on_map(seen, sigmas(self._by_ground(number), covariance, 0.0)) for number, seen in enumerate(self._seen)
        ]

    def both_see(self, first: int, second: int) -> Mask:
        """Return True (H, W) where both cameras see the ground."""
        return np.asarray(self._seen[first] & self._seen[second])

    def camera(self, number: int) -> CameraPlan:
        """Return the plan of one camera."""
        camera, errors, seen = self._cameras[number], self.errors, self._seen[number]
        jacobian = self._by_ground(number)
        uneven_m = self._pitch.template.uneven
        poses = np.zeros_like(errors.as_given)
        poses[: len(errors.by_measurement), : len(errors.by_measurement)] = errors.by_measurement
        across, along = _resolution(camera, self._ground[seen])
        return CameraPlan(
            camera,
            errors.sigma(number, errors.as_given),
            errors.sigma(number, errors.refined),
            errors.sigma(number, errors.by_measurement),
            _on_map(seen, sigmas(jacobian, errors.as_given, uneven_m)),
            _on_map(seen, sigmas(jacobian, errors.as_given, 0.0)),
            _on_map(seen, sigmas(jacobian, poses, 0.0)),
            _on_map(seen, across),
            _on_map(seen, along),
            self._measured[number],
            self._metres(self._measured[number].index),
            self._marking_sigma(number),
        )

    def pair(self, first: int, second: int) -> PairPlan:
        """Return the plan of two cameras that see some of the same ground."""
        seen = self.both_see(first, second)
        here, there = (self._by_ground(number)[seen[self._seen[number]]] for number in (first, second))
        stitch_m = sigmas(here - there, self.errors.as_given, self._pitch.template.uneven)
        common = self._metres(np.intersect1d(self._measured[first].index, self._measured[second].index))
        names = self._cameras[first].id, self._cameras[second].id
        return PairPlan(*names, seen, float(np.sqrt(np.mean(stitch_m**2))), common)

    def _marking_sigma(self, number: int) -> GroundSigma | None:
        camera = self._cameras[number]
        points = VisibleLines.from_camera(self._lines, camera).points.position
        if len(points) == 0:
            return None
        points = points[:: max(len(points) // 200, 1)]
        on_ground = self._jacobian(number, points)
        in_picture = pixel_jacobian(camera, points)[..., 3:5] @ on_ground
        metres, pixels = (sigmas(one, self.errors.refined, 0.0) for one in (on_ground, in_picture))
        return GroundSigma(metres, pixels)

    def _by_ground(self, number: int) -> Array:
        """Jacobian (N, 2, D + 1) of where a camera puts the ground that it sees, computed once."""
        if number not in self._jacobians:
            self._jacobians[number] = self._jacobian(number, self._ground[self._seen[number]])
        return self._jacobians[number]

    def _jacobian(self, number: int, points: Array) -> Array:
        """Jacobian (N, 2, D + 1) of where a camera puts points (N, 3), see `ground_error_jacobian`."""
        return ground_error_jacobian(self._pitch, self._cameras[number], number, points, self._model.unknowns)

    def _metres(self, index: NDArray[np.intp]) -> Array:
        """Return the length (K,) of each marking that is measured at line points `index` (M,), m."""
        # The ends of a mark add nothing to its length.
        index = index[~self._lines.end_to_end[index]]
        points = np.bincount(self._lines.marking[index], minlength=len(self._pitch.markings()))
        share = self._state.measured * (1 - self._hidden)
        return np.asarray(points * (self._lines.spacing * share), dtype=float)


def _on_map(seen: Mask, values: Array) -> Array:
    """Return a map (H, W) of values (N,) where the ground is seen, NaN elsewhere."""
    spread = np.full(seen.shape, np.nan)
    spread[seen] = values
    return spread


def _resolution(camera: Camera, points: Array) -> tuple[Array, Array]:
    """Return the pixels (N,) per metre of ground at points (N, 3), in the directions of most and least of them."""
    by_ground = -pixel_jacobian(camera, points)[..., 3:5]
    finest = np.asarray(np.linalg.svd(by_ground, compute_uv=False), dtype=float)
    return finest[:, 0], finest[:, 1]
