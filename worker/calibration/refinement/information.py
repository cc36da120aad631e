"""Information of the lines on poses, lenses and field: of tonight's lines, and of remembered ones.

Every epoch of a memory is one more view, with the mean of what it measured; it shares lens, ground and paint with the
view of tonight, so that what they have in common is known once and not twice (docs/model.md, 4).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from worker.calibration.detection.line_measurement import Measurements
from worker.calibration.geometry.camera import Array
from worker.calibration.geometry.derivatives import POSE_NUMBERS
from worker.calibration.geometry.lens import LENS_PARAMETERS
from worker.calibration.geometry.parameters import LensParameter, lens_values
from worker.calibration.memory.camera_memory import CameraMemory
from worker.calibration.refinement.estimate import Estimate
from worker.calibration.refinement.least_squares import (
    FEWEST_MEASUREMENTS,
    Rows,
    error_of_measurement,
    normal_equations,
    weigh_rows,
)
from worker.calibration.refinement.unknowns import Unknowns
from worker.calibration.robust import tukey_derivatives, tukey_weights


@dataclass(frozen=True)
class MarginalInformation:
    """Information on changes of the dense unknowns (D,), ground marginalised: `matrix` (D, D), `vector` (D,).

    `ground_mean` (K,) and `ground_gain` (K, D): the heights of the ground are `ground_mean - ground_gain @ changes`.
    `repeatability_covariance`: of tonight's poses by tonight's measurement alone.
    """

    matrix: Array
    vector: Array
    ground_mean: Array
    ground_gain: Array
    repeatability_covariance: Array

    def heights(self, changes: Array) -> Array:
        """Return the likeliest heights (K,) of the ground after changes (D,)."""
        return self.ground_mean - self.ground_gain @ changes


@dataclass(frozen=True)
class Sandwich:
    """Derivatives of half the robust loss by all unknowns (U,): the `gradient` (U,), its Jacobian `bread` (U, U),
    and `spread` (U, U), its covariance from one measurement of the lines to another."""

    bread: Array
    gradient: Array
    spread: Array

    @classmethod
    def of(cls, rows: Sequence[Rows], heights: Array, unknowns: Unknowns) -> "Sandwich":
        """Sum up rows on a ground of `heights` (K,)."""
        flat = weigh_rows(rows, heights, unknowns, tukey_weights)
        equations = normal_equations(flat)
        steep = normal_equations(weigh_rows(rows, heights, unknowns, tukey_derivatives))
        return cls(steep.information, equations.gradient, error_of_measurement(flat, equations.information))

    def covariance_of_poses(self, estimate: Estimate) -> Array:
        """Return the covariance (6 C, 6 C) of tonight's poses by the measurement alone.

        Huber's sandwich: the covariance of the gradient, between inverses of its Jacobian.
        """
        weak = estimate.weak_prior()
        poses = len(weak)
        part = np.linalg.inv(self.bread[:poses, :poses] + weak)
        return np.asarray(part @ (self.spread[:poses, :poses] + weak) @ part, dtype=float)


class LineLikelihood:
    """Likelihood of tonight's and the remembered lines around an estimate."""

    def __init__(
        self,
        estimate: Estimate,
        measured: Sequence[Measurements],
        memories: Sequence[CameraMemory | None],
        unknowns: Unknowns,
    ) -> None:
        self._estimate, self._unknowns = estimate, unknowns
        self._tonight = estimate.rows(measured, unknowns)
        self._remembered = _remembered(estimate, memories, unknowns)

    def information(self) -> MarginalInformation:
        """Return the information at the estimate."""
        return self.information_at(np.zeros(self._unknowns.dense), self._estimate.heights)

    def information_at(self, changes: Array, heights: Array) -> MarginalInformation:
        """Return the information after changes (D,) from the estimate, on a ground of `heights` (K,).

        An error of a lens that is known by now is no error of the measurements.
        """
        unknowns, dense = self._unknowns, self._unknowns.dense
        all_of_it = self.sandwich_at(changes, heights)
        bread, gradient, spread = all_of_it.bread, all_of_it.gradient, all_of_it.spread
        tonight = all_of_it
        if self._remembered:
            alone = [rows.shifted(changes, heights, unknowns) for rows in self._tonight]
            tonight = Sandwich.of(alone, heights, unknowns)
        repeatability_covariance = tonight.covariance_of_poses(self._estimate)

        # Whatever the ground: its heights are eliminated.
        even = self._estimate.ground_precision(unknowns)
        of_heights = bread[dense:, dense:] + even
        effect: Array = np.asarray(np.linalg.solve(of_heights, bread[dense:, :dense]), dtype=float)
        towards = gradient[dense:] + even @ heights
        information = bread[:dense, :dense] - bread[:dense, dense:] @ effect
        information_vector = effect.T @ towards - gradient[:dense]
        reduced = np.concatenate([np.eye(dense), -effect.T], axis=1)
        varies = reduced @ spread @ reduced.T + effect.T @ even @ effect
        shrunk, shrunk_vector = _shrunk_sandwich(information, information_vector, varies)
        risen = heights - np.asarray(np.linalg.solve(of_heights, towards), dtype=float)
        return MarginalInformation(
            shrunk, shrunk_vector + shrunk @ changes, risen + effect @ changes, effect, repeatability_covariance
        )

    def sandwich_at(self, changes: Array, heights: Array) -> Sandwich:
        """Sum up all lines after changes (D,), on a ground of `heights` (K,)."""
        rows = [rows.shifted(changes, heights, self._unknowns) for rows in (*self._tonight, *self._remembered)]
        return Sandwich.of(rows, heights, self._unknowns)


def expected_information(estimate: Estimate, rows: Sequence[Rows], unknowns: Unknowns) -> Array:
    """Return the information (D, D) on the dense unknowns, ground marginalised, of lines whose offsets are unknown yet.

    Every error is taken to be as large as its standard deviation says, so that no residual has a say: `rows` lie where
    the cameras of the estimate expect them.
    """
    dense = unknowns.dense
    information = normal_equations(weigh_rows(rows, estimate.heights, unknowns, tukey_weights)).information
    of_heights = information[dense:, dense:] + estimate.ground_precision(unknowns)
    effect = np.linalg.solve(of_heights, information[dense:, :dense])
    return np.asarray(information[:dense, :dense] - information[:dense, dense:] @ effect, dtype=float)


def _remembered(estimate: Estimate, memories: Sequence[CameraMemory | None], unknowns: Unknowns) -> list[Rows]:
    """Return the rows of all epochs, in the order of their views."""
    rows, view = [], len(estimate.cameras)
    for camera, memory in zip(estimate.cameras, memories, strict=True):
        for epoch in () if memory is None else memory.epochs:
            its = epoch.measurements(estimate.lines)
            if camera.ignored is not None:
                its = its[camera.sees(its.pixel)]
            # An epoch has the lens of its time: what that differs by from tonight's is no error.
            differs = lens_values(camera.intrinsics) - lens_values(epoch.camera.intrinsics)
            if len(its) >= FEWEST_MEASUREMENTS:
                made = Rows.of(estimate.lines.position, epoch.camera, view, its, unknowns)
                rows.append(replace(made, offset=made.offset + _by_lens(made, unknowns, view, differs)))
            view += 1
    return rows


def _by_lens(rows: Rows, unknowns: Unknowns, view: int, differs: Array) -> Array:
    """Return the change (M,) px of a view's offsets when `LENS_PARAMETERS` (6,) of its lens change by `differs`."""
    changed = np.zeros(len(rows.offset))
    owner = unknowns.lenses[view][0] if unknowns.lenses else view
    for column, (_, parameter) in enumerate(unknowns.parameters_of(view), POSE_NUMBERS):
        if isinstance(parameter, LensParameter) and parameter.camera == owner:
            changed += rows.jacobian[:, column] * differs[LENS_PARAMETERS.index(parameter.name)]
    return changed


def _shrunk_sandwich(information: Array, information_vector: Array, spread: Array) -> tuple[Array, Array]:
    """Return the `information` (A, A) that is left when its vector (A,) varies by `spread` (A, A) instead of by as much
    as that, and the vector to the same place that goes with it.

    A few patches of line say little of the variance in any one direction, so it is shrunk to the mean variance.
    """
    scale = np.sqrt(np.maximum(np.diag(information), 1e-300))
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    # Directions of less information are taken to be unknown.
    known = values > 1e-9
    directions, root = vectors[:, known], np.sqrt(values[known])
    whitening = directions / root / scale[:, None]
    variance = whitening.T @ spread @ whitening
    usual = np.trace(variance) / max(len(variance), 1)
    variance = (variance + usual * np.eye(len(variance))) / 2
    back = directions * root * scale[:, None]
    shrunk = np.asarray(back @ np.linalg.solve(variance, back.T))
    return shrunk, shrunk @ (whitening @ (whitening.T @ information_vector))
