"""How sure the finish is, and what the lines say of what it takes for known: lenses and field.

Poses are found for the lenses and the field as they are given, because that is how they are used. If those are a
little off, the poses are off with them, and no residual need show it. So the lines are asked once more, with the
numbers of every lens and of the field unknown: the poses that are then best are nearer the truth, and how far they are
from the poses that are answered belongs to their error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from worker.calibration.finish.estimate import Estimate
from worker.calibration.finish.normal_equations import error_of_measurement, normal_equations
from worker.calibration.finish.residuals import FEWEST_MEASUREMENTS, Unknowns, residuals, rms_px
from worker.calibration.finish.robust import tukey_slopes, tukey_weights
from worker.calibration.scene.camera import Array, Camera
from worker.calibration.scene.field import Field
from worker.calibration.scene.motion import POSE_NUMBERS
from worker.calibration.scene.parameters import LensParameter, Parameter, field_parameters, lens_parameters
from worker.calibration.see.evidence import Evidence
from worker.calibration.see.line_measurement import Measurements

TRUST, TRUST_NUMBERS = 0.05, 1.0
"""Lens and field are thought to be off by this part of what is expected before they are seen, and how many numbers of
evidence that is worth."""
EVIDENCE_STEPS = 12
LARGEST_FACTOR = 100.0


@dataclass(frozen=True)
class Deviation:
    """How far a number of a lens (`camera`) or of the field (None) seems to be from what it is taken for.

    `sigma`: of that estimate; `expected`: how far off it is after a good calibration. In the unit that `name` ends on.
    """

    camera: str | None
    name: str
    value: float
    sigma: float
    expected: float


@dataclass(frozen=True)
class Determined:
    """How well the lines fix a number that was left free: its `sigma`, with what lenses and field may be off, where
    `expected` was how far off it might have been before. `entangled`: which other unknown number moves most with it,
    and their correlation.
    """

    sigma: float
    entangled: tuple[Parameter, float] | None


@dataclass(frozen=True)
class Sigma:
    """One standard deviation of a pose: of the rotation's angle in degrees, of the position in metres."""

    rotation_deg: float
    position_m: float

    @classmethod
    def from_covariance(cls, covariance: Array) -> Sigma:
        """From (6, 6) of (rotation rad, position m): root of the summed variances of each three."""
        variances = np.diag(covariance)
        return cls(float(np.degrees(np.sqrt(variances[:3].sum()))), float(np.sqrt(variances[3:].sum())))


@dataclass(frozen=True)
class FinishedCamera:
    """A camera where the finish left it. `evidence`: how much of the lines is seen where it puts them.

    None where it had too few measurements: `residual_px`, the rms of its lines, `covariance` (6, 6) of (rotation in the
    camera's frame rad, position m), and `repeatability`, the part of sigma that is not owed to lens and field, which do
    not change.
    """

    camera: Camera
    evidence: Evidence
    residual_px: float | None
    covariance: Array | None
    repeatability: Sigma | None

    @property
    def sigma(self) -> Sigma | None:
        """How sure the pose is."""
        return None if self.covariance is None else Sigma.from_covariance(self.covariance)


@dataclass(frozen=True)
class Finished:
    """The cameras on their pitch. `deviations`: what the lines say of lenses and field that were taken for known.

    `determined`: what was left free, in that order.
    """

    pitch: Field
    each: list[FinishedCamera]
    deviations: list[Deviation]
    determined: list[Determined]

    @property
    def cameras(self) -> list[Camera]:
        """Where they stand."""
        return [one.camera for one in self.each]


def judged(
    here: Estimate,
    begun: Sequence[Camera],
    measured: Sequence[Measurements],
    evidence: Sequence[Evidence],
    solved: Unknowns,
    stitch_weight: float,
) -> Finished:
    """The answer `here` and what it is worth, found with `solved` unknown from where the cameras had `begun`."""
    lines, cameras = here.lines, here.cameras
    prior, away = here.prior(solved), here.away(begun)
    suspects = _suspects(here.pitch, cameras, solved)
    unknowns = Unknowns(solved.cameras, [*solved.parameters, *suspects], solved.ground).around(here.pitch, lines)
    rows = residuals(lines.position, cameras, measured, unknowns, here.heights, stitch_weight, tukey_weights)
    equations = normal_equations(rows, unknowns)
    kept = np.r_[: solved.dense, unknowns.dense : len(unknowns)]
    asked = np.arange(solved.dense, unknowns.dense)

    # Given the suspects, everything else follows: what is left of the equations is about the suspects alone.
    inverse = np.linalg.inv(equations.information[np.ix_(kept, kept)] + prior)
    left_over = equations.gradient[kept] + prior @ away
    effect = inverse @ equations.information[np.ix_(kept, asked)]
    information = equations.information[np.ix_(asked, asked)] - equations.information[np.ix_(asked, kept)] @ effect
    pull = effect.T @ left_over - equations.gradient[asked]
    certainty = _certainty(information, pull, suspects)
    value = np.linalg.solve(information + np.diag(certainty), pull)
    nearer = -inverse @ left_over - effect @ value

    # A sandwich: how the pull of the residuals varies, between how the pull changes with the unknowns (Huber, 1964).
    slopes = residuals(lines.position, cameras, measured, unknowns, here.heights, stitch_weight, tukey_slopes)
    bread = normal_equations(slopes, unknowns).information
    everything = np.zeros_like(bread)
    everything[np.ix_(kept, kept)] = prior
    everything[asked, asked] = certainty
    full = np.linalg.inv(bread + everything)
    measurement = error_of_measurement(rows, unknowns)
    covariance = full @ (measurement + everything) @ full
    part = np.linalg.inv(bread[np.ix_(kept, kept)] + prior)
    alone = part @ (measurement[np.ix_(kept, kept)] + prior) @ part
    enough = [len(found) >= FEWEST_MEASUREMENTS for found in measured]
    return Finished(
        here.pitch,
        [
            FinishedCamera(
                camera,
                seen,
                rms_px(lines.position, camera, found),
                _of_pose(covariance, nearer, i) if known else None,
                Sigma.from_covariance(_of_pose(alone, np.zeros(len(alone)), i)) if known else None,
            )
            for i, (camera, seen, found, known) in enumerate(zip(cameras, evidence, measured, enough, strict=True))
        ],
        [
            Deviation(
                cameras[suspect.camera].id if isinstance(suspect, LensParameter) else None,
                suspect.name,
                float(value[i]),
                float(np.sqrt(covariance[asked[i], asked[i]])),
                suspect.expected,
            )
            for i, suspect in enumerate(suspects)
        ],
        [_determined(number, unknowns, covariance, nearer) for number in range(len(solved.parameters))],
    )


def _suspects(pitch: Field, cameras: Sequence[Camera], solved: Unknowns) -> list[Parameter]:
    """The numbers of lenses and field that were not solved for."""
    known = {(getattr(p, "camera", None), p.name) for p in solved.parameters}
    everything = [*lens_parameters(cameras), *field_parameters(pitch)]
    return [p for p in everything if (getattr(p, "camera", None), p.name) not in known]


def _certainty(information: Array, pull: Array, suspects: Sequence[Parameter]) -> Array:
    """Information (S,) on the suspects before the lines were measured, by what the lines say of how good each lens is.

    MacKay's evidence update, as for the ground (`Ground.unevenness`): one scale for each lens, and one for each measure
    of the field, which were not taken together as the numbers of a lens are.
    """
    owner = np.array([getattr(suspect, "camera", -1 - number) for number, suspect in enumerate(suspects)])
    expected = np.array([suspect.expected for suspect in suspects])
    factor = np.ones(len(suspects))
    for _ in range(EVIDENCE_STEPS):
        certainty = (expected * factor) ** -2
        covariance = np.linalg.inv(information + np.diag(certainty))
        determined = 1 - np.diag(covariance) * certainty
        power = (covariance @ pull / expected) ** 2
        for one in np.unique(owner):
            its = owner == one
            evidence = max(float(determined[its].sum()), 0.0) + TRUST_NUMBERS
            scale = np.sqrt((power[its].sum() + TRUST_NUMBERS * TRUST**2) / evidence)
            factor[its] = min(scale, LARGEST_FACTOR)
    return np.asarray((expected * factor) ** -2)


def _determined(number: int, unknowns: Unknowns, covariance: Array, nearer: Array) -> Determined:
    """What is known of the free parameter of this number."""
    first = POSE_NUMBERS * unknowns.cameras
    at = first + number
    variance = np.diag(covariance)[first : unknowns.dense]
    together = np.sqrt(variance * variance[number])
    jointly = covariance[at, first : unknowns.dense]
    correlation = np.divide(jointly, together, out=np.zeros_like(together), where=together > 0)
    correlation[number] = 0.0
    most = int(np.argmax(np.abs(correlation)))
    return Determined(
        float(np.sqrt(variance[number] + nearer[at] ** 2)),
        None if most == number else (unknowns.parameters[most], float(correlation[most])),
    )


def _of_pose(covariance: Array, nearer: Array, camera: int) -> Array:
    """Second moment (6, 6) of one pose's error: its variance, and how far it is from where it should be."""
    its = slice(POSE_NUMBERS * camera, POSE_NUMBERS * (camera + 1))
    return np.asarray(covariance[its, its] + np.outer(nearer[its], nearer[its]))
