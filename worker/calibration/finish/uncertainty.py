"""How sure the finish is, and what the lines say of what it takes for known: lenses and field.

Poses are found for the lenses and the field as they are given, because that is how they are used. If those are a
little off, the poses are off with them, and no residual need show it. So the lines are asked once more, with the
numbers of every lens and of the field unknown: the poses that are then best are nearer the truth, and how far they are
from the poses that are answered belongs to their error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from worker.calibration.finish.estimate import Estimate
from worker.calibration.finish.least_squares import (
    FEWEST_MEASUREMENTS,
    error_of_measurement,
    normal_equations,
    rms_px,
    weighted,
)
from worker.calibration.finish.robust import tukey_slopes, tukey_weights
from worker.calibration.finish.scales import Group, posterior
from worker.calibration.finish.unknowns import Unknowns
from worker.calibration.scene.camera import Array, Camera
from worker.calibration.scene.field import Field
from worker.calibration.scene.ground import UNEVEN_M
from worker.calibration.scene.motion import POSE_NUMBERS, change_between, moved
from worker.calibration.scene.parameters import (
    LensParameter,
    Parameter,
    field_parameters,
    lens_parameters,
    with_focal_length,
)
from worker.calibration.see.evidence import Evidence
from worker.calibration.see.line_measurement import Measurements

MOVED_RAD, MOVED_M = 0.01, 0.1
"""How far a camera that has moved is expected to be from where it was, per axis, ..."""
MOVEMENT_SCALES: Array = 0.3 * 2.0 ** np.arange(7.0)
"""...times one of these: wind and heat move every camera a little."""
LENS_SCALES: Array = 2.0 ** np.arange(8.0)
"""A lens is off by what is expected of it, or by so many times more; never by less: lines that fit say little of it."""
FIELD_SCALES: Array = 2.0 ** np.arange(-3.0, 5.0)
"""A measure of the field may have been taken better than expected, or worse."""
LEAST_HELD, TINY = 1e-9, 1e-300
"""Directions of which the lines say less than this part of what they say of single numbers are said nothing of."""


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
    camera's frame rad, position m), and `repeatability`, the part of sigma that is not owed to lens, field and ground,
    which do not change. `zoom`: what the lines say of the focal length, None where it was found with the pose;
    `likelier`: the camera with that focal length, where it then is. `measured`: the lines it was judged by;
    `uneven_m`: how uneven their ground was taken to be.
    """

    camera: Camera
    evidence: Evidence
    residual_px: float | None
    covariance: Array | None
    repeatability: Sigma | None
    zoom: Deviation | None
    likelier: Camera | None
    measured: Measurements | None = field(default=None, kw_only=True)
    uneven_m: float = field(default=UNEVEN_M, kw_only=True)

    @property
    def elsewhere_m(self) -> float:
        """How far from here the camera is if its lens is what the lines say."""
        there = self.camera if self.likelier is None else self.likelier
        return float(np.linalg.norm(there.pose.position - self.camera.pose.position))

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
    stored: Sequence[Camera],
    measured: Sequence[Measurements],
    evidence: Sequence[Evidence],
    solved: Unknowns,
) -> Finished:
    """The answer `here` and what it is worth, found with `solved` unknown.

    `stored`: where the cameras stood when their poses were last known.
    """
    lines, cameras = here.lines, here.cameras
    suspects = _suspects(here.pitch, cameras, solved)
    unknowns = Unknowns(solved.views, [*solved.parameters, *suspects], solved.ground).around(here.pitch, lines)
    told = _told(here, measured, unknowns, solved.dense)
    found = posterior(told.information, told.pull, _blocks(here, stored, unknowns, len(solved.parameters)))
    # How far a camera moved helps to tell a zoom from a move. That it has not is no measurement of where it is: if the
    # lenses are what they are said to be, lines alone have to determine it.
    of_suspects = np.maximum(found.certainty[solved.dense :], [suspect.expected**-2 for suspect in suspects])
    certainty = np.concatenate([np.diag(here.prior(solved))[: solved.dense], of_suspects])
    by_lines = np.asarray(np.linalg.inv(told.information + np.diag(certainty)), dtype=float)
    deviations = [
        Deviation(
            cameras[suspect.camera].id if isinstance(suspect, LensParameter) else None,
            suspect.name,
            float(found.value[number]),
            float(np.sqrt(found.covariance[number, number])),
            suspect.expected,
        )
        for number, suspect in enumerate(suspects, solved.dense)
    ]
    zooms = {deviation.camera: deviation for deviation in deviations if deviation.name == "focal_length_px"}

    def finished(number: int, camera: Camera, seen: Evidence, its: Measurements) -> FinishedCamera:
        residual = rms_px(lines.position, camera, its)
        if len(its) < FEWEST_MEASUREMENTS:
            return FinishedCamera(camera, seen, residual, None, None, None, None)
        pose = slice(POSE_NUMBERS * number, POSE_NUMBERS * (number + 1))
        away = found.value[pose]
        zoom = zooms.get(camera.id)
        covariance = max(
            by_lines[pose, pose], found.covariance[pose, pose], key=lambda one: float(np.trace(one[3:, 3:]))
        )
        return FinishedCamera(
            camera,
            seen,
            residual,
            covariance + np.outer(away, away),
            Sigma.from_covariance(told.repeated[pose, pose]),
            zoom,
            None if zoom is None else moved(with_focal_length(camera, zoom.value), away),
        )

    return Finished(
        here.pitch,
        [finished(*each) for each in zip(range(len(cameras)), cameras, evidence, measured, strict=True)],
        deviations,
        [
            _determined(number, unknowns, by_lines, found.value)
            for number in range(POSE_NUMBERS * len(cameras), solved.dense)
        ],
    )


@dataclass(frozen=True)
class _Told:
    """What lines say of the dense unknowns (D,), whatever the ground: `information` (D, D) and `pull` (D,).

    `repeated` (6 N + F, 6 N + F): covariance of poses and of the free numbers by the measurement alone.
    """

    information: Array
    pull: Array
    repeated: Array


def _told(here: Estimate, measured: Sequence[Measurements], unknowns: Unknowns, solved: int) -> _Told:
    """By how the pull of the residuals varies, between how the pull changes with the unknowns: Huber's sandwich."""
    dense = unknowns.dense
    rows = here.rows(measured, unknowns)
    steep = weighted(rows, here.heights, unknowns, tukey_slopes)
    level = weighted(rows, here.heights, unknowns, tukey_weights)
    equations = normal_equations(level)
    bread, gradient = normal_equations(steep).information, equations.gradient
    spread = error_of_measurement(level, equations.information)
    weak = here.prior(unknowns)[:solved, :solved]
    part = np.linalg.inv(bread[:solved, :solved] + weak)
    repeated = part @ (spread[:solved, :solved] + weak) @ part

    even = unknowns.ground.precision / here.uneven_m**2
    effect = np.linalg.solve(bread[dense:, dense:] + even, bread[dense:, :dense])
    information = bread[:dense, :dense] - bread[:dense, dense:] @ effect
    pull = effect.T @ (gradient[dense:] + even @ here.heights) - gradient[:dense]
    spread[dense:, dense:] += even
    reduced = np.concatenate([np.eye(dense), -effect.T], axis=1)
    believed = _believed(information, reduced @ spread @ reduced.T)
    return _Told(believed, believed @ np.linalg.pinv(information, hermitian=True) @ pull, repeated)


def _believed(information: Array, spread: Array) -> Array:
    """The `information` (A, A) that is left when the pull varies by `spread` (A, A) and not by as much as that.

    Few patches of line say little of how it varies in any one direction, so it is drawn to what it does on average.
    """
    scale = np.sqrt(np.maximum(np.diag(information), TINY))
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    held = values > LEAST_HELD
    directions, root = vectors[:, held], np.sqrt(values[held])
    whitening = directions / root / scale[:, None]
    variance = whitening.T @ spread @ whitening
    usual = np.trace(variance) / max(len(variance), 1)
    variance = (variance + usual * np.eye(len(variance))) / 2
    back = directions * root * scale[:, None]
    return np.asarray(back @ np.linalg.solve(variance, back.T))


def _blocks(here: Estimate, stored: Sequence[Camera], unknowns: Unknowns, solved: int) -> list[list[Group]]:
    """What may be off together: how far a camera moved and its lens; and each measure of the field for itself.

    The first `solved` of the parameters were found with the poses, and are as far off as is expected.
    """
    first, suspects = POSE_NUMBERS * unknowns.views, unknowns.parameters[solved:]
    owner = np.array([getattr(suspect, "camera", -1) for suspect in suspects])
    expected = np.array([parameter.expected for parameter in unknowns.parameters])
    moves = np.array([MOVED_RAD] * 3 + [MOVED_M] * 3)

    def alone(number: int, mean: float, scales: Array) -> list[Group]:
        return [Group(np.array([first + number]), expected[number : number + 1], np.array([mean]), scales)]

    blocks = [alone(number, -here.values[number], np.ones(1)) for number in range(solved)]
    for number, (camera, before) in enumerate(zip(here.cameras, stored, strict=True)):
        its = POSE_NUMBERS * number + np.arange(POSE_NUMBERS)
        movement = Group(its, moves, change_between(camera, before), MOVEMENT_SCALES)
        lens = solved + np.flatnonzero(owner == number)
        blocks.append([movement, Group(first + lens, expected[lens], np.zeros(len(lens)), LENS_SCALES)])
    fields = (solved + np.flatnonzero(owner == -1)).tolist()
    return [*blocks, *(alone(number, 0.0, FIELD_SCALES) for number in fields)]


def _suspects(pitch: Field, cameras: Sequence[Camera], solved: Unknowns) -> list[Parameter]:
    """The numbers of lenses and field that were not solved for."""
    known = {(getattr(p, "camera", None), p.name) for p in solved.parameters}
    everything = [*lens_parameters(cameras), *field_parameters(pitch)]
    return [p for p in everything if (getattr(p, "camera", None), p.name) not in known]


def _determined(number: int, unknowns: Unknowns, covariance: Array, value: Array) -> Determined:
    """What is known of the free parameter that is this number of all unknowns."""
    first = POSE_NUMBERS * unknowns.views
    variance = np.diag(covariance)[first:]
    together = np.sqrt(variance * covariance[number, number])
    correlation = np.divide(covariance[number, first:], together, out=np.zeros_like(together), where=together > 0)
    correlation[number - first] = 0.0
    most = int(np.argmax(np.abs(correlation)))
    return Determined(
        float(np.hypot(np.sqrt(covariance[number, number]), value[number])),
        None if most == number - first else (unknowns.parameters[most], float(correlation[most])),
    )
