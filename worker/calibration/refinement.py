"""The finish: all cameras at once onto the measured lines, by a robust Gauss-Newton, and how sure that is.

Residuals are distances across lines. A single residual is how far a camera puts a marking from where it sees it, a
stitch residual how far apart two cameras put the same piece of line on the ground. Both are divided by their expected
errors; at `stitch_weight` 0.5 they count as these say. Paint and ground that are not where the model has them move
both cameras' views of a line alike, so the stitch residual has only the error of the measurement.

A weak prior holds each camera near where the search left it. Where lines tell something it changes nothing. Where they
do not (a lone touchline) it keeps the camera from running away along them, and the covariance says how little is known.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from worker.calibration.camera import Array, Camera, Pose, project, rotation_matrices, rotation_vectors
from worker.calibration.field import Field, LinePoints
from worker.calibration.linemeasurement import NOISE_PX, UNEVEN_GROUND_M, Measurements, measure_lines

SEARCH_PX = (14.0, 8.0, 5.0, 4.0, 3.0, 3.0)
"""How far from where the pose expects it a line is looked for, round by round, in pixels of a 4K frame."""
ASSESSING_SEARCH_PX = 8.0
HUBER_STEPS, TUKEY_STEPS = 6, 4
"""Per round."""
HUBER, TUKEY = 1.345, 4.685
"""Residuals, in standard deviations, where each begins to doubt: 95 % of the efficiency of least squares."""
LEAST_SINGLE_WEIGHT = 0.02
FEWEST_MEASUREMENTS = 30
CLUSTER_POINTS = 8
"""Line points (25 cm apart) whose errors of paint and measurement are taken as one."""
SWELL_M = 8.0
"""Over how far the ground keeps its error: the correlation length of `UNEVEN_GROUND_M`."""
PRIOR_RAD, PRIOR_M = 0.03, 1.0
"""Standard deviation, per axis, of where a camera is before any line is measured."""
JACOBIAN_STEP = 1e-5


Weigh = Callable[[Array], Array]
"""How much each of M residuals, in units of its expected error, is believed."""


@dataclass(frozen=True)
class Refined:
    """The finished cameras; per camera, None where it had too few measurements and stayed where it was:

    `covariance` (6, 6) of (rotation in the camera's frame rad, position m), `residual_px` the rms of its lines.
    """

    cameras: list[Camera]
    covariance: list[Array | None]
    residual_px: list[float | None]


@dataclass(frozen=True)
class Residuals:
    """Rows of the least squares: `value` (M,) in units of its expected error, `jacobian` (M, 6 N), `weight` (M,).

    `point` (M,): the line point it is about; `rise` (M,): how much the value changes per metre of ground under it.
    """

    value: Array
    jacobian: Array
    weight: Array
    point: NDArray[np.intp]
    rise: Array


def refine(
    pitch: Field,
    cameras: Sequence[Camera],
    brightness: Sequence[NDArray[np.float32]],
    responses: Sequence[NDArray[np.float32]],
    stitch_weight: float,
) -> Refined:
    """Measure the lines and move the cameras onto them, round by round with a narrower search.

    `brightness` (H, W) of each frame (`linemeasurement.brightness_of`); `responses` (H, W): segmentations in 0..1.
    """
    here = list(cameras)
    for search in SEARCH_PX:
        measured = _measure_all(pitch, here, brightness, responses, search)
        # Huber's loss has one minimum, wherever one begins; Tukey's, which outliers do not move, has several.
        for weigh in [huber_weights] * HUBER_STEPS + [tukey_weights] * TUKEY_STEPS:
            here = _step(here, cameras, measured, stitch_weight, weigh)
    # Judged by a wider search than the last round's, which could not see an error larger than itself.
    return assess(pitch, here, brightness, responses, stitch_weight)


def assess(
    pitch: Field,
    cameras: Sequence[Camera],
    brightness: Sequence[NDArray[np.float32]],
    responses: Sequence[NDArray[np.float32]],
    stitch_weight: float,
) -> Refined:
    """What the lines say of poses that are left as they are; arguments as for `refine`."""
    measured = _measure_all(pitch, cameras, brightness, responses, ASSESSING_SEARCH_PX)
    residuals = [_residual_px(camera, found) for camera, found in zip(cameras, measured, strict=True)]
    return Refined(list(cameras), _covariances(pitch.line_points(), cameras, measured, stitch_weight), residuals)


def _measure_all(
    pitch: Field,
    cameras: Sequence[Camera],
    brightness: Sequence[NDArray[np.float32]],
    responses: Sequence[NDArray[np.float32]],
    search_px: float,
) -> list[Measurements]:
    lines = pitch.line_points()
    return [
        measure_lines(lines, camera, bright, response, search_px * camera.intrinsics.relative_size)
        for camera, bright, response in zip(cameras, brightness, responses, strict=True)
    ]


def _step(
    cameras: list[Camera],
    found: Sequence[Camera],
    measured: Sequence[Measurements],
    stitch_weight: float,
    weigh: Weigh,
) -> list[Camera]:
    """One Gauss-Newton step for all cameras together; `found`: where the search left them."""
    rows = _all_residuals(cameras, measured, stitch_weight, weigh)
    weighted = rows.jacobian * rows.weight[:, None]
    # einsum rather than BLAS: the same sum to the last digit whatever the number of threads.
    normal = np.einsum("mi,mj->ij", weighted, rows.jacobian)
    gradient = np.einsum("mi,m->i", weighted, rows.value)
    prior = _prior(len(cameras))
    away = np.concatenate([_change(before, now) for before, now in zip(found, cameras, strict=True)])
    move = np.linalg.solve(normal + np.diag(prior), -gradient - prior * away)
    return [moved(camera, change) for camera, change in zip(cameras, move.reshape(-1, 6), strict=True)]


def moved(camera: Camera, change: Array) -> Camera:
    """The camera turned by change[:3] (rad, in its own frame) and shifted by change[3:] (m, in the world)."""
    rotation = rotation_vectors(rotation_matrices(change[:3]) @ camera.pose.matrix)
    return camera.with_pose(Pose(rotation, camera.pose.position + change[3:]))


def _change(before: Camera, after: Camera) -> Array:
    """The change (6,) that `moved` makes `after` of `before` with."""
    turn = rotation_vectors(after.pose.matrix @ before.pose.matrix.T)
    return np.concatenate([turn, after.pose.position - before.pose.position])


def _prior(count: int) -> Array:
    """Information (6 N,) on each number of `count` cameras before any line is measured."""
    return np.tile([PRIOR_RAD**-2] * 3 + [PRIOR_M**-2] * 3, count)


def _all_residuals(
    cameras: Sequence[Camera], measured: Sequence[Measurements], stitch_weight: float, weigh: Weigh
) -> Residuals:
    """Single and stitch residuals of all cameras that have enough measurements, weighted robustly."""
    views = [_LineView.build(camera, found) for camera, found in zip(cameras, measured, strict=True)]
    singles = [
        _single(view, index, len(cameras), max(2 * (1 - stitch_weight), LEAST_SINGLE_WEIGHT), weigh)
        for index, view in enumerate(views)
        if len(view.measured) >= FEWEST_MEASUREMENTS
    ]
    pairs = [
        _stitch(views[i], views[j], i, j, len(cameras), 2 * stitch_weight, weigh)
        for i, j in combinations(range(len(cameras)), 2)
        if min(len(views[i].measured), len(views[j].measured)) >= FEWEST_MEASUREMENTS
    ]
    parts = [*singles, *pairs, _nothing(len(cameras))]
    return Residuals(
        np.concatenate([p.value for p in parts]),
        np.concatenate([p.jacobian for p in parts]),
        np.concatenate([p.weight for p in parts]),
        np.concatenate([p.point for p in parts]),
        np.concatenate([p.rise for p in parts]),
    )


@dataclass(frozen=True)
class _LineView:
    """Measurements against a pose: `offset` (M,) px, measured minus expected, and its `jacobian` (M, 6)."""

    measured: Measurements
    offset: Array
    jacobian: Array

    @classmethod
    def build(cls, camera: Camera, measured: Measurements) -> _LineView:
        changes = np.concatenate([JACOBIAN_STEP * np.eye(6), -JACOBIAN_STEP * np.eye(6), np.zeros((1, 6))])
        poses = [moved(camera, change).pose for change in changes]
        rotations = np.stack([pose.rotation for pose in poses])
        positions = np.stack([pose.position for pose in poses])
        pixels = project(measured.points.position, rotations, positions, camera.intrinsics)
        expected = np.einsum("pmi,mi->pm", pixels, measured.normal)
        slope = (expected[:6] - expected[6:12]).T / (2 * JACOBIAN_STEP)
        offset = np.sum(measured.pixel * measured.normal, axis=1) - expected[12]
        known = np.isfinite(offset) & np.isfinite(slope).all(axis=1)
        return cls(measured[known], offset[known], -slope[known])


def _single(view: _LineView, index: int, count: int, share: float, weigh: Weigh) -> Residuals:
    """How far one camera puts the markings from where it sees them."""
    sigma = view.measured.sigma_px
    value = view.offset / sigma
    jacobian = np.zeros((len(value), 6 * count))
    jacobian[:, 6 * index : 6 * index + 6] = view.jacobian / sigma[:, None]
    rise = view.measured.px_per_metre_up / sigma
    return Residuals(value, jacobian, share * weigh(value), view.measured.index, rise)


def _stitch(first: _LineView, second: _LineView, i: int, j: int, count: int, share: float, weigh: Weigh) -> Residuals:
    """How far apart two cameras put the same pieces of line on the ground."""
    index, a, b = np.intersect1d(first.measured.index, second.measured.index, return_indices=True)
    if share == 0 or len(index) == 0:
        return _nothing(count)
    scale_a, scale_b = first.measured.px_per_metre[a], second.measured.px_per_metre[b]
    sigma_m = NOISE_PX * np.hypot(1 / scale_a, 1 / scale_b)
    value = (first.offset[a] / scale_a - second.offset[b] / scale_b) / sigma_m
    jacobian = np.zeros((len(index), 6 * count))
    jacobian[:, 6 * i : 6 * i + 6] = first.jacobian[a] / (scale_a * sigma_m)[:, None]
    jacobian[:, 6 * j : 6 * j + 6] = -second.jacobian[b] / (scale_b * sigma_m)[:, None]
    up_a, up_b = first.measured.px_per_metre_up[a], second.measured.px_per_metre_up[b]
    return Residuals(value, jacobian, share * weigh(value), index, (up_a / scale_a - up_b / scale_b) / sigma_m)


def _nothing(count: int) -> Residuals:
    return Residuals(np.empty(0), np.empty((0, 6 * count)), np.empty(0), np.empty(0, dtype=np.intp), np.empty(0))


def robust_scale(values: Array) -> float:
    """Standard deviation by the median absolute value, at least 1: expected errors are not doubted downwards."""
    return max(1.0, 1.4826 * float(np.median(np.abs(values)))) if len(values) else 1.0


def huber_weights(values: Array) -> Array:
    """Huber's weights (M,) at the scale of the values themselves: 1 near zero, falling as 1 / |value| beyond."""
    scale = robust_scale(values)
    return np.minimum(1.0, HUBER * scale / np.maximum(np.abs(values), 1e-12)) / scale**2


def tukey_weights(values: Array) -> Array:
    """Tukey's biweight (M,) at the scale of the values themselves: 1 at zero, 0 for what cannot be this line."""
    scale = robust_scale(values)
    return np.maximum(0.0, 1 - (values / (TUKEY * scale)) ** 2) ** 2 / scale**2


def _covariances(
    lines: LinePoints, cameras: Sequence[Camera], measured: Sequence[Measurements], stitch_weight: float
) -> list[Array | None]:
    """Covariance (6, 6) per camera: H^-1 (measurement + ground + prior) H^-1 with the normal matrix H.

    Measurement: the residuals themselves, those of two metres of line taken as one, never less than expected. Ground:
    heights that are off by `UNEVEN_GROUND_M` and alike over `SWELL_M`. They move every line on a swell the same way, in
    all cameras, so many points do not average them out and the residuals do not show them.
    """
    rows = _all_residuals(cameras, measured, stitch_weight, tukey_weights)
    weighted = rows.jacobian * rows.weight[:, None]
    normal = np.einsum("mi,mj->ij", weighted, rows.jacobian)
    prior = np.diag(_prior(len(cameras)))
    patches, patch = np.unique(rows.point // CLUSTER_POINTS, return_inverse=True)
    by_residual = _sum_by(patch, len(patches), weighted * rows.value[:, None])
    by_rise = _sum_by(patch, len(patches), weighted * rows.rise[:, None])
    where = lines.position[np.minimum(patches * CLUSTER_POINTS + CLUSTER_POINTS // 2, len(lines) - 1), :2]
    apart = np.sum((where[:, None] - where[None]) ** 2, axis=-1)
    heights = UNEVEN_GROUND_M**2 * np.exp(-apart / (2 * SWELL_M**2))
    expected = np.einsum("mi,mj->ij", weighted, weighted)
    measurement = np.einsum("ci,cj->ij", by_residual, by_residual)
    meat = np.maximum(np.diag(expected), np.diag(measurement))
    growth = np.sqrt(meat / np.maximum(np.diag(measurement), 1e-300))
    ground = np.einsum("ci,cj->ij", by_rise, np.einsum("cd,dj->cj", heights, by_rise))
    inverse = np.linalg.inv(normal + prior)
    full = inverse @ (measurement * growth[:, None] * growth[None, :] + ground + prior) @ inverse
    return [
        full[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] if len(found) >= FEWEST_MEASUREMENTS else None
        for i, found in enumerate(measured)
    ]


def _sum_by(group: NDArray[np.intp], groups: int, rows: Array) -> Array:
    """Sums (groups, K) of rows (M, K) by their group (M,)."""
    sums = np.zeros((groups, rows.shape[1]))
    np.add.at(sums, group, rows)
    return sums


def _residual_px(camera: Camera, measured: Measurements) -> float | None:
    """Rms (px) of the lines of one camera that are not outliers."""
    view = _LineView.build(camera, measured)
    if len(view.measured) < FEWEST_MEASUREMENTS:
        return None
    counted = tukey_weights(view.offset / view.measured.sigma_px) > 0
    return float(np.sqrt(np.mean(view.offset[counted] ** 2)))
