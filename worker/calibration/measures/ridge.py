"""How long a ridge may be: each length tried, because it moves the lines in kinks that no tangent foretells.

A ridge of another length is a crown of another shape, and so is a ground that swells. How much this ground swells is
found anew for every length, so that a shape wins only if it spares the ground more than chance does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from worker.calibration.finish.estimate import Estimate, step, unevenness
from worker.calibration.finish.normal_equations import CLUSTER_POINTS, normal_equations
from worker.calibration.finish.refinement import ASSESSING_SEARCH_PX, Refined, Sight, measure_all
from worker.calibration.finish.residuals import Unknowns, residuals
from worker.calibration.finish.robust import TUKEY, robust_scale, tukey_loss, tukey_weights
from worker.calibration.scene.camera import Array, Camera
from worker.calibration.scene.field import Field
from worker.calibration.scene.ground import UNEVEN_M, Ground
from worker.calibration.scene.parameters import Parameter
from worker.calibration.see.line_measurement import Measurements

SPACING_M = 10.0
SETTLING_STEPS, UNEVENNESS_STEPS = 3, 4
"""Per length: first for the poses, then with the unevenness of the ground as well."""
ALIKE = 4.0
"""Lengths whose costs are this near to the least fit alike: two standard deviations."""


@dataclass(frozen=True)
class Trial:
    """A pitch with a ridge of some length, everything else found for it; `cost`: -2 log evidence, from any zero."""

    pitch: Field
    cost: float


@dataclass(frozen=True)
class RidgeTrials:
    """`held`: at the length that the pitch came with; `tried`: every `SPACING_M` from none to the whole pitch."""

    held: Trial
    tried: Sequence[Trial]

    @property
    def lengths(self) -> Array:
        """Of the ridges tried (T,)."""
        return np.array([trial.pitch.ridge_length for trial in self.tried])

    @property
    def credence(self) -> Array:
        """How probable each of the tried lengths is (T,), if all were before."""
        cost = self._costs
        likelihood = np.exp((cost.min() - cost) / 2)
        return np.asarray(likelihood / likelihood.sum())

    @property
    def best(self) -> float:
        """The expected length."""
        return float(self.credence @ self.lengths)

    @property
    def sigma(self) -> float:
        """Standard deviation of the length; not less than the grid can tell."""
        variance = float(self.credence @ (self.lengths - self.best) ** 2)
        return float(np.sqrt(variance + SPACING_M**2 / 12))

    @property
    def alike(self) -> tuple[float, float]:
        """The shortest and the longest that fit about as well as the best."""
        lengths = self.lengths[self._costs < self._costs.min() + ALIKE]
        return float(lengths.min()), float(lengths.max())

    def spread(self, read: Callable[[Field], float]) -> float:
        """How far (rms) another measure is off because the ridge is not as long as it was held."""
        off = np.array([read(trial.pitch) for trial in self.tried]) - read(self.held.pitch)
        return float(np.sqrt(self.credence @ off**2))

    @property
    def _costs(self) -> Array:
        return np.array([trial.cost for trial in self.tried])


def try_ridges(base: Refined, free: Sequence[Parameter], sight: Sight, stitch_weight: float) -> RidgeTrials:
    """Ridges of all lengths on the lines that a finish left; `free`: what is found anew for each, with the poses."""
    lines = base.pitch.line_points()
    measured = measure_all(lines, base.cameras, sight, ASSESSING_SEARCH_PX)
    ground = Ground.under(lines)
    believe = _Belief.of(base, measured, ground, stitch_weight)

    def trial(length: float) -> Trial:
        return _trial(
            base.pitch.with_ridge_length(length), base.cameras, free, measured, ground, believe, stitch_weight
        )

    lengths = np.arange(0.0, base.pitch.length, SPACING_M)
    return RidgeTrials(trial(base.pitch.ridge_length), [trial(length) for length in lengths.tolist()])


@dataclass(frozen=True)
class _Belief:
    """How residuals are weighted, the same in all trials: Tukey's at a fixed `scale`, and `together` as many that
    neighbours err as one count as one.
    """

    scale: float
    together: float

    @classmethod
    def of(cls, base: Refined, measured: Sequence[Measurements], ground: Ground, stitch_weight: float) -> _Belief:
        unknowns = Unknowns(len(base.cameras), [], ground)
        here = Estimate.at(base.pitch, base.cameras, unknowns)
        for _ in range(SETTLING_STEPS):
            here = step(here, base.cameras, measured, unknowns, stitch_weight, tukey_weights)
        rows = residuals(
            here.lines.position, here.cameras, measured, unknowns, here.heights, stitch_weight, tukey_weights
        )
        scale = robust_scale(rows.value)
        good = np.abs(rows.value) < TUKEY * scale
        value = rows.value[good] / scale
        sums = np.bincount(rows.point[good] // CLUSTER_POINTS, value)
        return cls(scale, max(float(np.sum(sums**2) / np.sum(value**2)), 1.0))

    def weights(self, values: Array) -> Array:
        return tukey_weights(values, self.scale) / self.together

    def cost(self, values: Array) -> float:
        return float(np.sum(tukey_loss(values, self.scale))) / self.together


def _trial(
    pitch: Field,
    cameras: Sequence[Camera],
    free: Sequence[Parameter],
    measured: Sequence[Measurements],
    ground: Ground,
    believe: _Belief,
    stitch_weight: float,
) -> Trial:
    unknowns = Unknowns(len(cameras), free, ground)
    here = replace(Estimate.at(pitch, cameras, unknowns), uneven_m=UNEVEN_M)
    for number in range(SETTLING_STEPS + UNEVENNESS_STEPS):
        unknowns = unknowns.around(here.pitch, here.lines)
        here = step(here, cameras, measured, unknowns, stitch_weight, believe.weights)
        if number >= SETTLING_STEPS:
            uneven = unevenness(here, measured, unknowns, stitch_weight, believe.weights)
            here = replace(here, uneven_m=uneven)
    rows = residuals(
        here.lines.position, here.cameras, measured, unknowns, here.heights, stitch_weight, believe.weights
    )
    prior, away = here.prior(unknowns), here.away(cameras)
    # Laplace's approximation: a ground that may swell more fits better, and pays for it.
    room = np.linalg.slogdet(normal_equations(rows, unknowns).information + prior)[1]
    room += 2 * len(ground) * np.log(here.uneven_m)
    return Trial(here.pitch, believe.cost(rows.value) + float(away @ prior @ away) + float(room))
