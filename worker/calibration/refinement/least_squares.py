"""Least squares of the refinement: line measurements of several views, with their unknown errors of paint and ground.

The offset of a measured line point from where its view expects it is (docs/model.md, 2)

    offset = J d + across e + up (h + r) + noise

with d the changes of all dense unknowns, h the height of the smooth ground under the point, and (e, r) what this point
of the paint is off by, across the line and upwards, whatever the view. That pair is one unknown of each line point,
shared by all views that measure it, and eliminated in closed form: so two cameras that see the same paint know it
together, and no measurement counts twice.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.line_measurement import PAINT_M, Measurements
from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.ground import Ground
from worker.calibration.geometry.lens import LENS_PARAMETERS
from worker.calibration.geometry.parameters import FieldParameter, LensParameter, Parameter
from worker.calibration.refinement.unknowns import Unknowns
from worker.calibration.robust import USUAL, Weigh, tukey_weights

FEWEST_MEASUREMENTS = 30
CLUSTER_POINTS = 40
"""Number of line points (25 cm apart) whose errors of paint, lens and measurement are taken as one."""
LEAST_NOISE = 0.2
"""Least part of the expected errors by which the gradient varies: no picture is perfect."""


@dataclass(frozen=True)
class Rows:
    """M measurements of one view, linearised at its pose.

    `offset` (M,) px, measured minus expected; `jacobian` (M, n) of it by the dense unknowns `columns` (n,); `across`
    and `up` (M,) px per metre of paint that lies beside its place, or above it; `noise_px` (M,); `trust` (M,) 0..1;
    `point` (M,): which of the line points. They are made of `measured`.
    """

    offset: Array
    columns: NDArray[np.intp]
    jacobian: Array
    across: Array
    up: Array
    noise_px: Array
    trust: Array
    point: NDArray[np.intp]
    measured: Measurements

    def shifted(self, changes: Array, heights: Array, unknowns: Unknowns) -> "Rows":
        """Return the rows after changes (D,) of the dense unknowns, on a ground of `heights` (K,).

        The misfit is smaller where a lens that was wrong has been corrected.
        """
        offset = self.offset + self.jacobian @ changes[self.columns]
        residual = offset - self.up * unknowns.ground.under_points(heights, self.point)
        noise_px = replace(self.measured, misfit_px=misfit_px(residual, self.measured)).noise_px
        return replace(self, offset=offset, noise_px=noise_px)

    @classmethod
    def of(cls, positions: Array, camera: Camera, view: int, measured: Measurements, unknowns: Unknowns) -> "Rows":
        """Return the rows of view number `view`; `positions` (N, 3): places of the field's line points."""
        here = positions[measured.index]
        parameters = unknowns.parameters_of(view)
        columns = np.array([*range(*unknowns.pose(view).indices(len(unknowns))), *(n for n, _ in parameters)], np.intp)
        by_pose = measured.jacobian(camera, here)
        by_parameters = _by_parameters(by_pose, here, camera, measured, [parameter for _, parameter in parameters])
        jacobian = np.concatenate([by_pose, by_parameters], axis=1)
        offset = measured.offset(camera, here)
        known = np.isfinite(offset) & np.isfinite(jacobian).all(axis=1)
        measured = measured[known]
        return cls(
            offset[known],
            columns,
            jacobian[known],
            measured.px_per_metre,
            measured.px_per_metre_up,
            measured.noise_px,
            measured.trust,
            measured.index,
            measured,
        )


def _by_parameters(
    by_pose: Array, points: Array, camera: Camera, measured: Measurements, parameters: Sequence[Parameter]
) -> Array:
    """Jacobian (M, E) of the offsets from `points` (M, 3) by parameters of lens and field, px per unit of each.

    `by_pose` (M, 6): that by the pose.
    """
    jacobian = np.empty((len(measured), len(parameters)))
    lens = {at: LENS_PARAMETERS.index(p.name) for at, p in enumerate(parameters) if isinstance(p, LensParameter)}
    if lens:
        jacobian[:, list(lens)] = measured.lens_jacobian(camera, points)[:, list(lens.values())]
    for at, parameter in enumerate(parameters):
        if isinstance(parameter, FieldParameter):
            # A point that moves is a camera that moves the other way.
            jacobian[:, at] = -np.sum(by_pose[:, 3:] * parameter.shift[measured.index], axis=1)
    return jacobian


def rows_of(
    positions: Array, cameras: Sequence[Camera], measured: Sequence[Measurements], unknowns: Unknowns
) -> list[Rows]:
    """Return the rows of all views that have enough measurements; `positions` (N, 3) of the field's line points."""
    return [
        Rows.of(positions, camera, view, found, unknowns)
        for view, (camera, found) in enumerate(zip(cameras, measured, strict=True))
        if len(found) >= FEWEST_MEASUREMENTS
    ]


@dataclass(frozen=True)
class WeightedRows:
    """Rows of several views with their weights, on a ground of known heights; M rows of all views, P line points.

    `residual` (M,) px; `points` (P,) and `at` (M,): which of the line points the rows are about; `shared` (M,): True if
    other rows are about the same one; `weight` (M,) 1 / px²: of a shared point that of the measurement alone, of
    another with all that it may be off by. `local` (M, 2) px per metre of (e, r); `precision` (P, 2, 2) of those given
    the rows, and `paint_mean` (P, 2) m. `value` (M,): the residual in units of everything it may be off by, and
    `belief` (M,), its robust weight.
    """

    rows: Sequence[Rows]
    unknowns: Unknowns
    residual: Array
    points: NDArray[np.intp]
    at: NDArray[np.intp]
    shared: NDArray[np.bool_]
    weight: Array
    local: Array
    precision: Array
    paint_mean: Array
    value: Array
    belief: Array

    def parts(self) -> list[slice]:
        """Return the slice of the M rows of each view."""
        ends = np.cumsum([0, *(len(rows.offset) for rows in self.rows)]).tolist()
        return [slice(first, last) for first, last in pairwise(ends)]

    @property
    def up(self) -> Array:
        """Pixels (M,) per metre that the ground rises under a row."""
        return self.local[:, 1]

    @property
    def schur_factor(self) -> Array:
        """Factor (M, 2) of the rank-2 term that eliminating a shared point's paint error subtracts from its rows'
        information; 0 for a point that one view alone measures."""
        factor = np.zeros((len(self.at), 2))
        at = self.at[self.shared]
        root = np.linalg.cholesky(np.linalg.inv(self.precision[at]))
        heavy = self.local[self.shared] * self.weight[self.shared, None]
        factor[self.shared] = np.sum(root * heavy[:, :, None], axis=1)
        return factor

    @property
    def residual_given_paint(self) -> Array:
        """Residuals (M,) px given the paint: with shared points at the mean place that all their rows say."""
        return self.residual - self.shared * np.sum(self.local * self.paint_mean[self.at], axis=1)


def weigh_rows(rows: Sequence[Rows], heights: Array, unknowns: Unknowns, weigh: Weigh) -> WeightedRows:
    """Weigh rows robustly: each by all that it may be off by, and those that share a point by each other.

    Where a shared point is far off in the views that see it alike, it is the paint and not the measurements: it may lie
    farther from its place, and they say no less about each other. `heights` (K,): of the ground's nodes.
    """
    ground = unknowns.ground
    point = _joined([r.point for r in rows]).astype(np.intp)
    local = np.stack([_joined([r.across for r in rows]), _joined([r.up for r in rows])], axis=1)
    residual = _joined([r.offset for r in rows]) - local[:, 1] * ground.under_points(heights, point)
    noise = _joined([r.noise_px for r in rows]) ** 2
    # Prior variance of the paint across the line, and of the ground under it beside the smooth ground, m².
    by_itself = np.array([PAINT_M**2, ground.usual_m**2])
    expected = noise + (local**2) @ by_itself
    value = residual / np.sqrt(expected)
    belief = _joined([r.trust * weigh(one) for r, one in zip(rows, _split(value, rows), strict=True)])
    points, number, seen_by = np.unique(point, return_inverse=True, return_counts=True)
    at = number.ravel()
    shared = seen_by[at] > 1
    trust = _joined([r.trust for r in rows])
    of_point = np.bincount(at, belief, len(points)) / np.maximum(np.bincount(at, trust, len(points)), 1e-12)
    # A point whose rows are all outliers may lie anywhere.
    variance = by_itself / np.clip(of_point, 1e-3, 1.0)[:, None]
    weight = np.where(shared, trust / noise, belief / expected)
    precision, paint_mean = _paint_posterior(local, weight, residual, at, variance)
    if shared.any():
        normalised = (residual - np.sum(local * paint_mean[at], axis=1)) / np.sqrt(noise)
        weight[shared] *= weigh(normalised[shared])
        precision, paint_mean = _paint_posterior(local, weight, residual, at, variance)
    return WeightedRows(
        rows, unknowns, residual, points, at, shared, weight, local, precision, paint_mean, value, belief
    )


def _paint_posterior(
    local: Array, weight: Array, residual: Array, at: NDArray[np.intp], variance: Array
) -> tuple[Array, Array]:
    """Return precision (P, 2, 2) and mean (P, 2), m, of each line point's paint error, all else fixed.

    `variance` (P, 2) m²: the prior of it.
    """
    count = len(variance)
    across, up = local.T
    a = 1 / variance[:, 0] + np.bincount(at, weight * across**2, count)
    b = np.bincount(at, weight * across * up, count)
    c = 1 / variance[:, 1] + np.bincount(at, weight * up**2, count)
    of_across, of_up = (np.bincount(at, weight * residual * one, count) for one in (across, up))
    # Cramer's rule: thousands of 2x2 systems by linalg.solve take several times as long.
    mean = np.stack([c * of_across - b * of_up, a * of_up - b * of_across], axis=1) / (a * c - b * b)[:, None]
    return np.stack([a, b, b, c], axis=1).reshape(-1, 2, 2), mean


@dataclass(frozen=True)
class NormalEquations:
    """Normal equations: `information` (U, U) on all unknowns and the `gradient` (U,) of half the weighted squares."""

    information: Array
    gradient: Array


def normal_equations(of: WeightedRows) -> NormalEquations:
    """Sum the normal equations over all rows, the paint error of each line point eliminated (docs/model.md, 3).

    All rows of a line point move with the ground under it, which is summed by points; poses and parameters are summed
    by views, and by pairs of views that share points.
    """
    unknowns, dense = of.unknowns, of.unknowns.dense
    factor = of.schur_factor
    information = np.zeros((len(unknowns), len(unknowns)))
    gradient = np.zeros(len(unknowns))
    weighted_residual = of.weight * of.residual_given_paint
    risen = np.stack([_summed(of.at, -of.up * factor[:, n], len(of.points)) for n in (0, 1)], axis=1)
    by_ground = -of.weight * of.up - np.sum(factor * risen[of.at], axis=1)
    alone = of.weight - np.sum(factor**2, axis=1)
    for rows, part in zip(of.rows, of.parts(), strict=True):
        columns, jacobian = rows.columns, rows.jacobian
        information[np.ix_(columns, columns)] += (jacobian * alone[part, None]).T @ jacobian
        gradient[columns] += jacobian.T @ weighted_residual[part]
        across = _by_node(unknowns.ground, rows.point, jacobian * by_ground[part, None])
        information[columns, dense:] += across.T
        information[dense:, columns] += across
    for (one, first), (other, second) in combinations(zip(of.rows, of.parts(), strict=True), 2):
        _, at, there = np.intersect1d(one.point, other.point, assume_unique=True, return_indices=True)
        together = np.sum(factor[first][at] * factor[second][there], axis=1)
        coupled = (one.jacobian[at] * together[:, None]).T @ other.jacobian[there]
        information[np.ix_(one.columns, other.columns)] -= coupled
        information[np.ix_(other.columns, one.columns)] -= coupled.T
    level = _summed(of.at, of.weight * of.up**2, len(of.points)) - np.sum(risen**2, axis=1)
    information[dense:, dense:] = _between_nodes(unknowns.ground, of.points, level)
    gradient[dense:] = _by_node(
        unknowns.ground, of.points, -_summed(of.at, of.up * weighted_residual, len(of.points))[:, None]
    )[:, 0]
    return NormalEquations(information, gradient)


def _by_node(ground: Ground, points: NDArray[np.intp], values: Array) -> Array:
    """Distribute values (M, n) at line points (M,) over the nodes (K, n) of the ground under them."""
    node, share = ground.node[points].ravel(), ground.share[points]
    by_column = [_summed(node, (share * column[:, None]).ravel(), len(ground)) for column in values.T]
    return np.stack(by_column, axis=1) if by_column else np.zeros((len(ground), 0))


def _between_nodes(ground: Ground, points: NDArray[np.intp], values: Array) -> Array:
    """Return the sum (K, K) over line points (P,) of a value (P,) times the outer square of their shares."""
    node, share, size = ground.node[points], ground.share[points], len(ground)
    pair = node[:, :, None] * size + node[:, None, :]
    squares = values[:, None, None] * share[:, :, None] * share[:, None, :]
    return _summed(pair.ravel(), squares.ravel(), size * size).reshape(size, size)


def _summed(at: NDArray[np.intp], values: Array, size: int) -> Array:
    """Return sums (size,) of values (M,) by their index (M,)."""
    return np.asarray(np.bincount(at, values, size), dtype=float)


def error_of_measurement(of: WeightedRows, information: Array) -> Array:
    """Return the covariance (U, U) of the gradient by the residuals themselves, clustered by ten metres of line.

    Neighbours on a line share the error of its paint and of the lens, so they are not as many as they seem (the
    sandwich of Liang and Zeger, 1986). On top, a fifth of what their expected errors say.
    """
    by_cluster = _cluster_gradients(of)
    usual = float(np.sum(of.belief**2) / max(float(np.sum(of.belief)), 1e-12))
    return np.asarray(by_cluster.T @ by_cluster + LEAST_NOISE * usual * information)


def _cluster_gradients(of: WeightedRows) -> Array:
    """Return the part (C, U) of the gradient of each ten metres of line, over all views."""
    unknowns, ground = of.unknowns, of.unknowns.ground
    clusters, cluster_of = np.unique(of.points // CLUSTER_POINTS, return_inverse=True)
    count, size = len(clusters), len(ground)
    cluster, weighted_residual = cluster_of[of.at], of.weight * of.residual_given_paint
    gradients = np.zeros((count, len(unknowns)))
    for rows, part in zip(of.rows, of.parts(), strict=True):
        for column, derivatives in zip(rows.columns, rows.jacobian.T, strict=True):
            gradients[:, column] += _summed(cluster[part], derivatives * weighted_residual[part], count)
    node, share = ground.node[of.points], ground.share[of.points]
    risen = -_summed(of.at, of.up * weighted_residual, len(of.points))
    pair = cluster_of[:, None] * size + node
    gradients[:, unknowns.dense :] = _summed(pair.ravel(), (share * risen[:, None]).ravel(), count * size).reshape(
        -1, size
    )
    return gradients


def _joined(parts: Sequence[Array | NDArray[np.intp]]) -> Array:
    return np.concatenate([*parts, np.empty(0)])


def _split(values: Array, rows: Sequence[Rows]) -> list[Array]:
    return np.split(values, np.cumsum([len(r.offset) for r in rows])[:-1]) if rows else []


def rms_px(positions: Array, camera: Camera, measured: Measurements) -> float | None:
    """Return the rms distance of the lines of one camera from the field's `positions` (N, 3), without outliers.

    None where it has too few.
    """
    if len(measured) < FEWEST_MEASUREMENTS:
        return None
    offset = measured.offset(camera, positions[measured.index])
    known = np.isfinite(offset)
    offset, sigma = offset[known], measured.sigma_px[known]
    counted = tukey_weights(offset / sigma) > 0
    return float(np.sqrt(np.mean(offset[counted] ** 2)))


def misfit_px(offset: Array, measured: Measurements) -> float:
    """Return the further error, in px, that makes the usual offset (M,) of measurements the expected one.

    0 where noise, paint and ground explain them. By the median: outliers say nothing of how well a lens is known.
    """
    known = np.isfinite(offset)
    if not known.any():
        return 0.0
    offset, measured = offset[known], measured[known]
    explained = measured.sigma_px**2 - measured.misfit_px**2 * measured.alike
    # The further variance that makes each offset a usual one; half of them need less than their median.
    needed = ((offset / USUAL) ** 2 - explained) / measured.alike
    return float(np.sqrt(max(np.median(needed), 0.0)))
