"""What measured lines say against poses: distances across lines, and how they change with everything unknown.

A single residual is how far a camera puts a marking from where it sees it, a stitch residual how far apart two cameras
put the same piece of line on the ground. Both are divided by their expected errors. Paint that is not where the model
has it moves both cameras' views of a line alike, so the stitch residual has only the error of the measurement.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from worker.calibration.finish.robust import Weigh, robust_scale, tukey_weights
from worker.calibration.scene.camera import Array, Camera
from worker.calibration.scene.field import Field, LinePoints
from worker.calibration.scene.ground import Ground
from worker.calibration.scene.motion import POSE_NUMBERS, pixel_slopes
from worker.calibration.scene.parameters import FIELD_STEP_M, FieldParameter, Parameter
from worker.calibration.see.line_measurement import Measurements

LEAST_SINGLE_WEIGHT = 0.02
FEWEST_MEASUREMENTS = 30
MISFIT_STEPS = 16


@dataclass(frozen=True)
class Unknowns:
    """What the lines are asked for: the poses of N cameras, E further numbers, and K heights of the ground.

    The first 6 N + E of them are `dense`: each touches many lines. A height touches those around its node.
    """

    cameras: int
    parameters: Sequence[Parameter]
    ground: Ground

    @property
    def dense(self) -> int:
        """6 N + E."""
        return POSE_NUMBERS * self.cameras + len(self.parameters)

    def around(self, pitch: Field, lines: LinePoints) -> Unknowns:
        """The same unknowns on a pitch that has been changed since."""
        parameters = [p.around(pitch, lines) if isinstance(p, FieldParameter) else p for p in self.parameters]
        return replace(self, parameters=parameters)

    def __len__(self) -> int:
        return self.dense + len(self.ground)


@dataclass(frozen=True)
class Residuals:
    """Rows of the least squares: `value` (M,) in units of its expected error, `jacobian` (M, 6 N + E), `weight` (M,).

    `point` (M,): the line point it is about; `rise` (M,): how much the value falls per metre of ground under it.
    """

    value: Array
    jacobian: Array
    weight: Array
    point: NDArray[np.intp]
    rise: Array

    def __getitem__(self, chosen: NDArray[np.bool_]) -> Residuals:
        return Residuals(*(part[chosen] for part in vars(self).values()))


def residuals(
    points: Array,
    cameras: Sequence[Camera],
    measured: Sequence[Measurements],
    unknowns: Unknowns,
    heights: Array,
    stitch_weight: float,
    weigh: Weigh,
) -> Residuals:
    """Single and stitch residuals of all cameras that have enough measurements, weighted robustly.

    `points` (N, 3): where the field has its line points; `heights` (K,) of the ground's nodes above the field. At
    `stitch_weight` 0.5 the residuals count as their expected errors say.
    """
    compared = [_Compared.build(points, cameras, index, found, unknowns) for index, found in enumerate(measured)]
    compared = [one for one in compared if len(one.measured) >= FEWEST_MEASUREMENTS]
    single_weight = max(2 * (1 - stitch_weight), LEAST_SINGLE_WEIGHT)
    parts = [_weighted(_single(one), unknowns.ground, heights, single_weight, weigh) for one in compared]
    if stitch_weight > 0:
        pairs = [_stitch(first, second) for first, second in combinations(compared, 2)]
        parts += [_weighted(pair, unknowns.ground, heights, 2 * stitch_weight, weigh) for pair in pairs]
    parts.append(_none(unknowns))
    columns = zip(*(vars(part).values() for part in parts), strict=True)
    return Residuals(*(np.concatenate(column) for column in columns))


def rms_px(points: Array, camera: Camera, measured: Measurements) -> float | None:
    """Rms of the distances of the lines of one camera from the field's `points` (N, 3), but for outliers.

    None where it has too few.
    """
    if len(measured) < FEWEST_MEASUREMENTS:
        return None
    offset = np.sum((measured.pixel - camera.project(points[measured.index])) * measured.normal, axis=1)
    known = np.isfinite(offset)
    offset, sigma = offset[known], measured.sigma_px[known]
    counted = tukey_weights(offset / sigma) > 0
    return float(np.sqrt(np.mean(offset[counted] ** 2)))


def misfit_px(points: Array, camera: Camera, measured: Measurements) -> float:
    """The further error, in px, that makes the usual distance of lines from `points` (N, 3) what is expected.

    0 where noise, paint and ground explain them. By the median: outliers say nothing of how well a lens is known.
    """
    offset = np.sum((measured.pixel - camera.project(points[measured.index])) * measured.normal, axis=1)
    known = np.isfinite(offset)
    offset, measured = offset[known], measured[known]

    def explains(misfit: float) -> bool:
        return robust_scale(offset / replace(measured, misfit_px=misfit).sigma_px) == 1.0

    if len(offset) == 0 or explains(0.0):
        return 0.0
    low, high = 0.0, 2.0 * float(np.median(np.abs(offset)))
    for _ in range(MISFIT_STEPS):
        middle = (low + high) / 2
        low, high = (low, middle) if explains(middle) else (middle, high)
    return high


@dataclass(frozen=True)
class _Compared:
    """Measurements against a pose: `offset` (M,) px, measured minus expected, and its `jacobian` (M, 6 N + E)."""

    measured: Measurements
    offset: Array
    jacobian: Array

    @classmethod
    def build(
        cls, points: Array, cameras: Sequence[Camera], index: int, measured: Measurements, unknowns: Unknowns
    ) -> _Compared:
        here = points[measured.index]
        expected = cameras[index].project(here)
        offset = np.sum((measured.pixel - expected) * measured.normal, axis=1)
        jacobian = np.zeros((len(measured), unknowns.dense))
        pose = slice(POSE_NUMBERS * index, POSE_NUMBERS * (index + 1))
        jacobian[:, pose] = -np.einsum("mij,mi->mj", pixel_slopes(cameras[index], here), measured.normal)
        for column, parameter in enumerate(unknowns.parameters, POSE_NUMBERS * unknowns.cameras):
            jacobian[:, column] = -_slope(here, cameras[index], index, measured, parameter)
        known = np.isfinite(offset) & np.isfinite(jacobian).all(axis=1)
        return cls(measured[known], offset[known], jacobian[known])


def _slope(points: Array, camera: Camera, index: int, measured: Measurements, parameter: Parameter) -> Array | float:
    """How far (M,) the expected lines at `points` (M, 3) move along their normals per unit of a parameter."""
    if isinstance(parameter, FieldParameter):
        step = FIELD_STEP_M
        ahead, behind = (camera.project(points + sign * step * parameter.shift[measured.index]) for sign in (1, -1))
    elif parameter.camera == index:
        step = parameter.step
        ahead, behind = (parameter.changed(camera, sign * step).project(points) for sign in (1, -1))
    else:
        return 0.0
    return np.asarray(np.sum((ahead - behind) * measured.normal, axis=1) / (2 * step))


def _single(side: _Compared) -> Residuals:
    """How far one camera puts the markings from where it sees them."""
    sigma = side.measured.sigma_px
    return Residuals(
        side.offset / sigma,
        side.jacobian / sigma[:, None],
        np.ones(len(sigma)),
        side.measured.index,
        side.measured.px_per_metre_up / sigma,
    )


def _stitch(first: _Compared, second: _Compared) -> Residuals:
    """How far apart two cameras put the same pieces of line on the ground."""
    index, a, b = np.intersect1d(first.measured.index, second.measured.index, return_indices=True)
    scale_a, scale_b = first.measured.px_per_metre[a], second.measured.px_per_metre[b]
    up_a, up_b = first.measured.px_per_metre_up[a], second.measured.px_per_metre_up[b]
    sigma_m = np.hypot(first.measured.noise_px[a] / scale_a, second.measured.noise_px[b] / scale_b)
    return Residuals(
        (first.offset[a] / scale_a - second.offset[b] / scale_b) / sigma_m,
        first.jacobian[a] / (scale_a * sigma_m)[:, None] - second.jacobian[b] / (scale_b * sigma_m)[:, None],
        np.ones(len(index)),
        index,
        (up_a / scale_a - up_b / scale_b) / sigma_m,
    )


def _weighted(rows: Residuals, ground: Ground, heights: Array, share: float, weigh: Weigh) -> Residuals:
    """Rows on a ground of these heights, weighted by what is then left of them."""
    value = rows.value - rows.rise * ground.under_points(heights, rows.point)
    return Residuals(value, rows.jacobian, share * weigh(value), rows.point, rows.rise)


def _none(unknowns: Unknowns) -> Residuals:
    return Residuals(np.empty(0), np.empty((0, unknowns.dense)), np.empty(0), np.empty(0, dtype=np.intp), np.empty(0))
