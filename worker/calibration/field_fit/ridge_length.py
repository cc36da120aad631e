"""Length of a ridge, by trying each: it moves the lines in kinks that no tangent predicts.

A length is believed by how well the lines fit with it once poses, measures and the swells of the ground are found anew.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from worker.calibration.detection.line_measurement import Measurements
from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.ground import Ground
from worker.calibration.geometry.parameters import Parameter
from worker.calibration.refinement.estimate import Estimate, gauss_newton_step
from worker.calibration.refinement.least_squares import CLUSTER_POINTS, WeightedRows, weigh_rows
from worker.calibration.refinement.refine import EVALUATION_SEARCH_PX, Observations
from worker.calibration.refinement.uncertainty import RefinedPoses
from worker.calibration.refinement.unknowns import Unknowns
from worker.calibration.robust import TUKEY, robust_scale, tukey_loss, tukey_weights

PARTS = 10
"""Parts of the field's length by which the lengths differ that are tried, from none to all: the grid on which its flat
prior is summed. A football pitch has been tried every 10 m; no length is known more finely than the grid."""


@dataclass(frozen=True)
class TriedRidge:
    """Field with a ridge of some length, everything else found for it; `cost`: -2 log likelihood, from any zero."""

    pitch: Field
    cost: float


@dataclass(frozen=True)
class TriedRidges:
    """Ridges of the lengths that were `tried`. `held`: the field with its own length."""

    held: Field
    tried: Sequence[TriedRidge]

    @property
    def lengths(self) -> Array:
        """Lengths of the ridges tried (T,)."""
        return np.array([ridge.pitch.ridge_length for ridge in self.tried])

    @property
    def credence(self) -> Array:
        """Posterior probability of each of the tried lengths (T,), with a flat prior."""
        likelihood = np.exp((self._costs.min() - self._costs) / 2)
        return np.asarray(likelihood / likelihood.sum())

    @property
    def best(self) -> float:
        """The likeliest length. A mean of several could end beside a goal line, and drop that from the crown."""
        return float(self.lengths[np.argmin(self._costs)])

    @property
    def sigma(self) -> float:
        """Standard deviation of the length; not less than the grid can tell."""
        mean = self.credence @ self.lengths
        variance = float(self.credence @ (self.lengths - mean) ** 2)
        return float(np.sqrt(variance + (self.held.length / PARTS) ** 2 / 12))

    @property
    def alike(self) -> tuple[float, float]:
        """Shortest and longest ridge that fit about as well as the best."""
        # Two standard deviations.
        lengths = self.lengths[self._costs < self._costs.min() + 4.0]
        return float(lengths.min()), float(lengths.max())

    def cost(self, length: float) -> float:
        """Return the cost of the tried ridge whose length is nearest to this one."""
        return float(self._costs[np.argmin(np.abs(self.lengths - length))])

    def spread(self, read: Callable[[Field], float]) -> float:
        """Return the rms error of another measure because the ridge is not as long as it was held."""
        off = np.array([read(ridge.pitch) for ridge in self.tried]) - read(self.held)
        return float(np.sqrt(self.credence @ off**2))

    @property
    def _costs(self) -> Array:
        return np.array([ridge.cost for ridge in self.tried])


def try_ridges(base: RefinedPoses, free: Sequence[Parameter], observations: Observations) -> TriedRidges:
    """Try ridges of all lengths on the lines of a refinement; `free`: parameters found anew for each."""
    lines = base.pitch.line_points()
    measured = observations.reader().measure(lines, base.cameras, EVALUATION_SEARCH_PX)
    unknowns = Unknowns(len(base.cameras), free, Ground.under(lines))
    base_fit, rows = _fitted(base.pitch, base.cameras, measured, unknowns)
    scale = robust_scale(rows.value)
    together = _together(rows, scale)
    tried = []
    for length in np.linspace(0.0, base.pitch.length, PARTS + 1).tolist():
        there, rows_there = _fitted(base.pitch.with_ridge_length(length), base.cameras, measured, unknowns)
        away = there.change_from(base.cameras)
        loss = float(np.sum(tukey_loss(rows_there.value, scale))) + float(away @ there.prior(unknowns) @ away)
        tried.append(TriedRidge(there.pitch, loss / together))
    return TriedRidges(base_fit.pitch, tried)


def _fitted(
    pitch: Field,
    cameras: Sequence[Camera],
    measured: Sequence[Measurements],
    unknowns: Unknowns,
) -> tuple[Estimate, WeightedRows]:
    """Return the estimate of everything else for a field, and the weighted residuals of the lines there."""
    estimate = Estimate.initial(pitch, cameras, unknowns)
    for _ in range(4):
        unknowns = unknowns.around(estimate.pitch)
        estimate = gauss_newton_step(estimate, cameras, measured, unknowns, tukey_weights).to
    return estimate, weigh_rows(estimate.rows(measured, unknowns), estimate.heights, unknowns, tukey_weights)


def _together(rows: WeightedRows, scale: float) -> float:
    """Return the number of residuals that neighbours on a line err alike and that count as one."""
    good = np.abs(rows.value) < TUKEY * scale
    sums = np.bincount(rows.points[rows.at[good]] // CLUSTER_POINTS, rows.value[good])
    return max(float(np.sum(sums**2) / np.sum(rows.value[good] ** 2)), 1.0)
