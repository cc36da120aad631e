"""Cross-check of sigmas: a camera by one half of its lines against the same camera by the other half.

Every line is cut into stretches of ten metres; the even ones find pose and lens without the odd ones, and the other way
round. How far apart the two put the farthest marking is a difference that anybody can check, and no sum of squares that
both have part in. It should be about as large as the sigmas of both say, and much larger only where those are too small
(mrcal calls this cross-validation; Kogan, "mrcal", 2021).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.line_measurement import Measurements
from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.derivatives import POSE_NUMBERS, full_ground_jacobian
from worker.calibration.geometry.far_marking import farthest_marking
from worker.calibration.geometry.field import Field
from worker.calibration.refinement.estimate import Estimate
from worker.calibration.refinement.information import LineLikelihood
from worker.calibration.refinement.least_squares import CLUSTER_POINTS, FEWEST_MEASUREMENTS
from worker.calibration.refinement.priors import Priors
from worker.calibration.refinement.variance_components import Posterior


@dataclass(frozen=True)
class CrossCheck:
    """Distance (m, on the ground) between the places of the farthest marking in view by the two halves of the lines.

    `expected_m`: one standard deviation of it by the sigmas of both halves.
    """

    apart_m: float
    expected_m: float


class CrossChecks:
    """Split-half posteriors by even and odd stretches of tonight's lines, at the prior scales of the full fit.

    Computed on first use: only the refinement whose answer is kept needs it.
    """

    def __init__(
        self,
        estimate: Estimate,
        measured: Sequence[Measurements],
        priors: Priors,
        found: Posterior,
        heights: Array,
    ) -> None:
        """Take `found` (A,), the posterior by all lines, on a ground of `heights` (K,)."""
        self._estimate, self._priors, self._found, self._heights = estimate, priors, found, heights
        self._halves = [[its[_stretch(its) % 2 == half] for its in measured] for half in (0, 1)]

    def of(self, number: int) -> CrossCheck | None:
        """Return the cross-check of a camera; None where one half is too short, or no marking is in view."""
        if min(len(half[number]) for half in self._halves) < FEWEST_MEASUREMENTS:
            return None
        pose = self._priors.mixing[POSE_NUMBERS * number : POSE_NUMBERS * (number + 1)]
        rows = np.concatenate([pose, self._priors.lens_tonight(number)])
        difference, covariance = self._difference
        return cross_check(
            self._estimate.pitch, self._estimate.cameras[number], rows @ difference, rows @ covariance @ rows.T
        )

    @cached_property
    def _difference(self) -> tuple[Array, Array]:
        """Difference (A,) between the errors by the two halves, and the covariance (A, A) expected of it."""
        estimate, priors, found, heights = self._estimate, self._priors, self._found, self._heights
        changes = priors.mixing @ found.value
        # The ground is one unknown more: what it swells by is the same under both halves.
        mixing, prior = _with_ground(priors.mixing, found.certainty, estimate.ground_precision(priors.unknowns))
        mean = np.concatenate([found.mean, np.zeros(len(heights))])
        values, covariances, noises = list[Array](), list[Array](), list[Array]()
        for half in self._halves:
            sandwich = LineLikelihood(estimate, half, [None] * len(half), priors.unknowns).sandwich_at(changes, heights)
            covariance = np.asarray(np.linalg.inv(mixing.T @ sandwich.bread @ mixing + prior), dtype=float)
            information_vector = sandwich.bread @ np.concatenate([changes, heights]) - sandwich.gradient
            values.append(covariance @ (mixing.T @ information_vector + prior @ mean))
            covariances.append(covariance)
            noises.append(covariance @ (mixing.T @ sandwich.spread @ mixing) @ covariance)
        # The prior's error is the same in both, and they differ in how far they follow it.
        shared = covariances[0] - covariances[1]
        errors = len(found.value)
        difference = values[0] - values[1]
        expected = noises[0] + noises[1] + shared @ prior @ shared
        return difference[:errors], expected[:errors, :errors]


def cross_check(pitch: Field, camera: Camera, difference: Array, covariance: Array) -> CrossCheck | None:
    """Propagate a `difference` (12,) of pose and `LENS_PARAMETERS`, of a covariance, to the farthest marking."""
    jacobian = full_ground_jacobian(camera, farthest_marking(pitch, camera))
    apart = np.linalg.norm(jacobian @ difference, axis=-1)
    variance = np.einsum("nij,jk,nik->n", jacobian, covariance, jacobian)
    known = np.isfinite(apart) & np.isfinite(variance)
    if not known.any():
        return None
    return CrossCheck(float(np.median(apart[known])), float(np.sqrt(np.median(variance[known]))))


def _stretch(measured: Measurements) -> NDArray[np.intp]:
    """Return the index (M,) of the ten metres of line in which each point was measured."""
    return measured.index // CLUSTER_POINTS


def _with_ground(mixing: Array, certainty: Array, ground: Array) -> tuple[Array, Array]:
    """Return mixing (D + K, A + K) and prior information (A + K, A + K) of the errors with the ground among them.

    `certainty` (A,): information on the errors, `ground` (K, K): on the heights.
    """
    (dense, errors), nodes = mixing.shape, len(ground)
    both, prior = np.zeros((dense + nodes, errors + nodes)), np.zeros((errors + nodes, errors + nodes))
    both[:dense, :errors], both[dense:, errors:] = mixing, np.eye(nodes)
    prior[:errors, :errors], prior[errors:, errors:] = np.diag(certainty), ground
    return both, prior
