"""Uncertainty of the refinement, and what the lines say of the lenses and the field it takes for known.

Poses are found for the lenses and the field as they are given, because that is how they are used. If those are a little
off, the poses are off with them, and no residual need show it. So the lines are asked once more, with the numbers of
every lens and of the field unknown: the poses that are then best are nearer the truth, and how far they are from the
poses that are answered belongs to their error.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from functools import partial

import numpy as np

from fields.template import TURF_M
from worker.calibration.detection.evidence import Evidence
from worker.calibration.detection.line_measurement import Measurements
from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.derivatives import POSE_NUMBERS, full_pixel_jacobian, moved
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import LENS_PARAMETERS
from worker.calibration.geometry.parameters import (
    HEAT_FOCAL,
    LensParameter,
    Parameter,
    careful_measurement,
    lens_parameters,
    with_focal_length,
    with_lens_changed,
)
from worker.calibration.geometry.visibility import VisibleLines
from worker.calibration.memory.camera_memory import CameraMemory
from worker.calibration.refinement.cross_check import CrossCheck, CrossChecks
from worker.calibration.refinement.estimate import Estimate
from worker.calibration.refinement.information import LineLikelihood, MarginalInformation
from worker.calibration.refinement.least_squares import FEWEST_MEASUREMENTS, rms_px
from worker.calibration.refinement.priors import Priors, build_priors, unknowns_of
from worker.calibration.refinement.unknowns import Unknowns
from worker.calibration.refinement.variance_components import Posterior, posterior

FOCAL = "focal_length_px"


@dataclass(frozen=True)
class Deviation:
    """Estimated error of a parameter of a lens (`camera`) or of the field (None).

    `sigma`: of that estimate; `expected`: how far off it is after a good calibration. In the unit that `name` ends on.
    `moves_m`: for a parameter of the field, the move of each camera's position (m) with the field corrected, by id.
    """

    camera: str | None
    name: str
    value: float
    sigma: float
    expected: float
    moves_m: Mapping[str, float] = field(default_factory=dict, kw_only=True)


@dataclass(frozen=True)
class ParameterUncertainty:
    """Uncertainty of a parameter of lens or field that was solved for.

    `sigma`: one standard deviation, in the unit that the parameter's name ends on, with what lenses and field may be
    off; before any line it was the parameter's `expected`. `most_correlated`: the parameter that correlates most with
    it, and their correlation.
    """

    sigma: float
    most_correlated: tuple[Parameter, float] | None


@dataclass(frozen=True)
class Sigma:
    """One standard deviation of a pose: of the rotation's angle in degrees, of the position in metres."""

    rotation_deg: float
    position_m: float

    @classmethod
    def from_covariance(cls, covariance: Array) -> "Sigma":
        """Return the roots of the summed variances of a covariance (6, 6) of (rotation rad, position m)."""
        variances = np.diag(covariance)
        return cls(float(np.degrees(np.sqrt(variances[:3].sum()))), float(np.sqrt(variances[3:].sum())))


@dataclass(frozen=True)
class GroundSigma:
    """Uncertainty of the places of markings in view: one standard deviation for each of N line points.

    `metres` (N,) on the ground, `pixels` (N,) in the picture.
    """

    metres: Array
    pixels: Array

    @property
    def largest_m(self) -> float:
        """Metres of the worst marking in view, but for the twentieth of the points that are worst."""
        return float(np.quantile(self.metres, 0.95))

    @property
    def rms_px(self) -> float:
        """Pixels of the markings in view, root mean square."""
        return float(np.sqrt(np.nanmean(self.pixels**2)))

    def worst(self, metres: float, pixels: float) -> tuple[float, float, bool]:
        """Return metres and pixels of the worst marking, and True if they are beyond both of these limits.

        Where a pixel covers metres of far grass, no frame tells the place of a marking any better than the pixel.
        """
        beyond = np.minimum(self.metres / metres, self.pixels / pixels)
        # Nobody measures at the last marking at the rim of the picture.
        at = int(np.argsort(beyond)[int(0.95 * (len(beyond) - 1))])
        return float(self.metres[at]), float(self.pixels[at]), bool(beyond[at] > 1)


@dataclass(frozen=True)
class PoseAndLens:
    """Pose and lens of a camera as the lines have both, for measuring in the world.

    `covariance` (12, 12): of the rotation in the camera's frame (rad), the position (m) and `LENS_PARAMETERS`.
    """

    camera: Camera
    covariance: Array

    @property
    def sigma(self) -> Sigma:
        """Standard deviation of the pose."""
        return Sigma.from_covariance(self.covariance[:POSE_NUMBERS, :POSE_NUMBERS])


@dataclass(frozen=True)
class LensChange:
    """Relative change of a focal length since the first nights of a memory, and its `sigma`.

    `since`: the time of those, None where that is not known.
    """

    since: datetime | None
    longer: float
    sigma: float

    @property
    def notable(self) -> bool:
        """True if the change is surely more than heat does to a lens."""
        # Sigmas, of estimate and heat together, by which a focal length differs when it has changed.
        return abs(self.longer) > 3.0 * float(np.hypot(self.sigma, HEAT_FOCAL))


def _not_cross_checked() -> CrossCheck | None:
    """The cross-check of a camera that has too few measurements for two halves: none."""
    return None


@dataclass(frozen=True)
class RefinedPose:
    """Refined pose of a camera for the lens as given, with uncertainty and evidence.

    `evidence` for the expected lines. None where fewer than `FEWEST_MEASUREMENTS` points were measured: `residual_px`,
    the rms offset of its lines in px of its own frame; `covariance` (6, 6) of (rotation in the camera's frame rad,
    position in the world m), with what lens, field and ground may be off; and `repeatability`, the part of sigma that
    another night's frames would draw anew. `ground_sigma`: how well pose, lens and field together know where markings
    are, None where none is in view. `zoom`: the change of the focal length since the pose was stored, None where it was
    solved for; `with_fitted_zoom`: the camera with that focal length, and the pose that goes with it. `refined`: pose
    and all of the lens as the lines have them. `lens_change`: of the focal length since the camera's memory began, None
    without a memory. `cross_checked`: computes the cross-check, lazily, since only the answer that is kept is asked.
    `measured`: the line measurements; `repainted_markings`: numbers of the markings that lie elsewhere than a memory
    has them, and were left out; `uneven_m`: standard deviation of the ground's heights.
    """

    camera: Camera
    evidence: Evidence
    residual_px: float | None
    covariance: Array | None
    repeatability: Sigma | None
    zoom: Deviation | None
    with_fitted_zoom: Camera | None
    ground_sigma: GroundSigma | None = field(default=None, kw_only=True)
    refined: PoseAndLens | None = field(default=None, kw_only=True)
    lens_change: LensChange | None = field(default=None, kw_only=True)
    cross_checked: Callable[[], CrossCheck | None] = field(default=_not_cross_checked, kw_only=True)
    measured: Measurements | None = field(default=None, kw_only=True)
    repainted_markings: tuple[int, ...] = field(default=(), kw_only=True)
    uneven_m: float = field(default=TURF_M, kw_only=True)

    @property
    def lens_changed(self) -> bool:
        """True if the focal length has surely changed since the first nights of the camera's memory."""
        return self.lens_change is not None and self.lens_change.notable

    @property
    def zoom_shift_m(self) -> float:
        """Distance (m) from the camera's position to its position with the fitted zoom."""
        there = self.camera if self.with_fitted_zoom is None else self.with_fitted_zoom
        return self.camera.distance_m(there)

    @property
    def sigma(self) -> Sigma | None:
        """Standard deviation of the pose, None without a covariance."""
        return None if self.covariance is None else Sigma.from_covariance(self.covariance)


@dataclass(frozen=True)
class RefinedPoses:
    """Refined cameras on their field. `deviations`: estimated errors of lenses and field that were taken for known.

    `parameter_uncertainties`: of the free parameters, in their order.
    """

    pitch: Field
    each: list[RefinedPose]
    deviations: list[Deviation]
    parameter_uncertainties: list[ParameterUncertainty]

    @property
    def cameras(self) -> list[Camera]:
        """Cameras at their refined poses."""
        return [one.camera for one in self.each]

    @property
    def residual_px(self) -> float:
        """Rms distance of the lines from all cameras, px; infinite if one was not measured."""
        return rms_of_all([one.residual_px for one in self.each])


def rms_of_all(residuals_px: Sequence[float | None]) -> float:
    """Return the rms of several cameras' residuals, px; infinite if one was not measured."""
    return math.hypot(*(math.inf if one is None else one for one in residuals_px)) / math.sqrt(len(residuals_px))


def estimate_uncertainty(
    estimate: Estimate,
    stored: Sequence[Camera],
    memories: Sequence[CameraMemory | None],
    measured: Sequence[Measurements],
    evidence: Sequence[Evidence],
    solved: Unknowns,
) -> RefinedPoses:
    """Return poses with covariances at the solution `estimate`, found with `solved` unknown.

    `stored`: poses of the cameras when they were last known; `memories`: of their earlier nights.
    """
    memories = [
        memory if memory is not None and len(found) >= FEWEST_MEASUREMENTS else None
        for memory, found in zip(memories, measured, strict=True)
    ]
    unknowns = unknowns_of(estimate, memories, solved)
    lines = LineLikelihood(estimate, measured, memories, unknowns)
    information = lines.information()
    priors = build_priors(estimate, stored, memories, unknowns, solved, information.matrix)
    # Number of times that lines are weighed again at the current estimate of everything.
    for _ in range(2):
        changes = priors.mixing @ _posterior(priors, information).value
        information = lines.information_at(changes, information.heights(changes))
    joint = _JointPosterior.of(estimate, priors, information)
    heights = information.heights(priors.mixing @ joint.found.value)
    checks = CrossChecks(estimate, measured, priors, joint.found, heights)
    return joint.to_refined_poses(memories, measured, evidence, checks, solved)


def _posterior(priors: Priors, information: MarginalInformation) -> Posterior:
    """Return the posterior of the independent errors, by their priors and the lines."""
    mixing = priors.mixing
    return posterior(mixing.T @ information.matrix @ mixing, mixing.T @ information.vector, priors.blocks)


@dataclass(frozen=True)
class _JointPosterior:
    """Joint posterior of all unknowns: `found` (A,) of the independent errors.

    `by_lines` (A, A): their covariance if nothing is known of how far cameras moved. `repeatability_covariance`: see
    `MarginalInformation`.
    """

    estimate: Estimate
    priors: Priors
    found: Posterior
    by_lines: Array
    repeatability_covariance: Array

    @property
    def value(self) -> Array:
        """Errors (A,)."""
        return self.found.value

    @property
    def covariance(self) -> Array:
        """Covariance (A, A) of the errors."""
        return self.found.covariance

    @classmethod
    def of(cls, estimate: Estimate, priors: Priors, information: MarginalInformation) -> "_JointPosterior":
        by_errors = priors.mixing.T @ information.matrix @ priors.mixing
        found = _posterior(priors, information)
        # The movement of a camera helps to tell a zoom from a move. That it has not moved is no measurement of where it
        # is: if the lenses are what they are said to be, lines alone have to determine it.
        certainty = found.certainty.copy()
        for group in (group for block in priors.blocks for group in block):
            certainty[group.which] = np.maximum(certainty[group.which], group.certainty(1.0))
        certainty[priors.movements] = np.minimum(found.certainty[priors.movements], priors.free**-2)
        by_lines = np.asarray(np.linalg.inv(by_errors + np.diag(certainty)), dtype=float)
        return cls(estimate, priors, found, by_lines, information.repeatability_covariance)

    def to_refined_poses(
        self,
        memories: Sequence[CameraMemory | None],
        measured: Sequence[Measurements],
        evidence: Sequence[Evidence],
        checks: CrossChecks,
        solved: Unknowns,
    ) -> RefinedPoses:
        """Return the refined poses, the deviations, and the uncertainties of free parameters."""
        cameras = self.estimate.cameras
        each = [
            self._camera(number, memories[number], seen, measurements, checks, solved)
            for number, (seen, measurements) in enumerate(zip(evidence, measured, strict=True))
        ]
        parameter_uncertainties = [
            self._parameter_uncertainty(number) for number in range(POSE_NUMBERS * len(cameras), solved.dense)
        ]
        return RefinedPoses(self.estimate.pitch, each, self._deviations(solved), parameter_uncertainties)

    def _camera(
        self,
        number: int,
        memory: CameraMemory | None,
        seen: Evidence,
        measurements: Measurements,
        checks: CrossChecks,
        solved: Unknowns,
    ) -> RefinedPose:
        camera = self.estimate.cameras[number]
        residual = rms_px(self.estimate.lines.position, camera, measurements)
        if len(measurements) < FEWEST_MEASUREMENTS:
            return RefinedPose(camera, seen, residual, None, None, None, None, uneven_m=self.estimate.uneven_m)
        pose = self.priors.mixing[POSE_NUMBERS * number : POSE_NUMBERS * (number + 1)]
        lens = self.priors.lens_tonight(number)
        away = pose @ self.value
        covariance = max(
            (pose @ one @ pose.T for one in (self.by_lines, self.covariance)),
            key=lambda one: float(np.trace(one[3:, 3:])),
        )
        zoom, errors = self._zoom(number, solved)
        own = slice(POSE_NUMBERS * number, POSE_NUMBERS * (number + 1))
        return RefinedPose(
            camera,
            seen,
            residual,
            covariance + np.outer(away, away),
            Sigma.from_covariance(self.repeatability_covariance[own, own]),
            zoom,
            None if zoom is None else moved(with_focal_length(camera, zoom.value), pose @ errors),
            ground_sigma=self._ground_sigma(camera, np.concatenate([pose, lens])),
            refined=self._refined(camera, pose, lens),
            lens_change=None if memory is None else self._lens_change(camera, memory),
            cross_checked=partial(checks.of, number),
            uneven_m=self.estimate.uneven_m,
        )

    def _since_stored(self) -> Array:
        """Return the errors (A,) with those of lens and field as they were expected: what has happened since."""
        since, lasting = self.value.copy(), self.priors.lasting
        since[lasting] = self.found.mean[lasting]
        return since

    def _zoom(self, number: int, solved: Unknowns) -> tuple[Deviation | None, Array]:
        """Return the increase of a focal length since it was stored, and the errors (A,) that go with it.

        A lens that was wrong when the pose was stored is wrong by as much tonight, and is no zoom; nor is one that was
        corrected since. So it is what has happened since, or all that it is off, whichever is less. None where the
        focal length was solved for.
        """
        off = next((d for d in self._of_lens(number, solved) if d.name == FOCAL), None)
        since = self._since_stored()
        row = self.priors.lens_tonight(number)[LENS_PARAMETERS.index(FOCAL)]
        longer_px = float(row @ since)
        if off is None or abs(off.value) <= abs(longer_px):
            return off, self.value
        varies = row.copy()
        varies[self.priors.lasting] = 0.0
        return replace(off, value=longer_px, sigma=float(np.sqrt(varies @ self.covariance @ varies))), since

    def _ground_sigma(self, camera: Camera, both: Array) -> GroundSigma | None:
        """Return the uncertainty of the markings in view by pose and lens, `both` (12, A), and field.

        They may each be off by far more, and make up for each other. What the lines surely contradict is a misfit,
        which residual and diagnosis tell, and no uncertainty. None where no marking is in view.
        """
        index = VisibleLines.from_camera(self.estimate.lines, camera).index
        if len(index) == 0:
            return None
        index = index[:: max(len(index) // 200, 1)]
        jacobian = full_pixel_jacobian(camera, self.estimate.lines.position[index])
        by_ground, all_of_it = -jacobian[..., 3:6], both
        for at, parameter in enumerate(self.priors.unknowns.parameters, POSE_NUMBERS * self.priors.unknowns.views):
            if not isinstance(parameter, LensParameter):
                jacobian = np.concatenate([jacobian, by_ground @ parameter.shift[index][..., None]], axis=-1)
                all_of_it = np.concatenate([all_of_it, self.priors.mixing[at : at + 1]])
        inverse = np.linalg.pinv(by_ground[..., :2])
        metres = pixels = np.zeros(len(index))
        for covariance in (self.by_lines, self.covariance):
            in_picture = jacobian @ (all_of_it @ covariance @ all_of_it.T) @ jacobian.transpose(0, 2, 1)
            on_ground = inverse @ in_picture @ inverse.transpose(0, 2, 1)
            metres, pixels = np.maximum(metres, _sigmas(on_ground)), np.maximum(pixels, _sigmas(in_picture))
        return GroundSigma(metres, pixels)

    def _refined(self, camera: Camera, pose: Array, lens: Array) -> PoseAndLens:
        both = np.concatenate([pose, lens])
        covariance = max(
            (both @ one @ both.T for one in (self.by_lines, self.covariance)),
            key=lambda one: float(np.trace(one[3:6, 3:6])),
        )
        return PoseAndLens(moved(with_lens_changed(camera, lens @ self.value), pose @ self.value), covariance)

    def _lens_change(self, camera: Camera, memory: CameraMemory) -> LensChange:
        """Return the change of the focal length since the first nights, an error of its own."""
        since = np.zeros(len(self.value))
        since[self.priors.changes_of(camera.id)] = 1.0
        focal = camera.intrinsics.focal_length_px
        sigma = float(np.sqrt(since @ self.covariance @ since)) / focal
        return LensChange(memory.since, float(since @ self.value) / focal, sigma)

    def _deviations(self, solved: Unknowns) -> list[Deviation]:
        """Return the estimated errors of lenses and field that were not solved for."""
        of_lenses = [one for number in range(len(self.estimate.cameras)) for one in self._of_lens(number, solved)]
        return [*of_lenses, *self._of_field(solved)]

    def _of_lens(self, number: int, solved: Unknowns) -> list[Deviation]:
        camera = self.estimate.cameras[number]
        lens = self.priors.lens_tonight(number)
        value, variance = lens @ self.value, np.einsum("ia,ab,ib->i", lens, self.covariance, lens)
        free = {(p.camera, p.name) for p in solved.parameters if isinstance(p, LensParameter)}
        return [
            Deviation(camera.id, p.name, float(value[at]), float(np.sqrt(variance[at])), p.expected)
            for p in lens_parameters([camera])
            for at in [LENS_PARAMETERS.index(p.name)]
            if (number, p.name) not in free
        ]

    def _of_field(self, solved: Unknowns) -> list[Deviation]:
        first, free = POSE_NUMBERS * self.priors.unknowns.views, {p.name for p in solved.parameters}
        deviations, care = [], careful_measurement(self.estimate.pitch)
        for at, parameter in enumerate(self.priors.unknowns.parameters, first):
            if isinstance(parameter, LensParameter) or parameter.name in free:
                continue
            row = self.priors.mixing[at]
            value, sigma = float(row @ self.value), float(np.sqrt(row @ self.covariance @ row))
            deviations.append(Deviation(None, parameter.name, value, sigma, care[parameter.name]))
        return deviations

    def _parameter_uncertainty(self, number: int) -> ParameterUncertainty:
        """Return the uncertainty of a free parameter, `number` among the unknowns that were solved for."""
        unknowns = self.priors.unknowns
        first = POSE_NUMBERS * unknowns.views
        at = number - POSE_NUMBERS * len(self.estimate.cameras)
        rows = self.priors.mixing[first : first + len(unknowns.parameters)]
        covariance = rows @ self.by_lines @ rows.T
        variance = np.diag(covariance)
        together = np.sqrt(variance * variance[at])
        correlation = np.divide(covariance[at], together, out=np.zeros_like(together), where=together > 0)
        correlation[at] = 0.0
        most = int(np.argmax(np.abs(correlation)))
        return ParameterUncertainty(
            float(np.hypot(np.sqrt(variance[at]), rows[at] @ self.value)),
            None if most == at else (unknowns.parameters[most], float(correlation[most])),
        )


def _sigmas(covariance: Array) -> Array:
    """Return sigma (N,) from covariances (N, 2, 2)."""
    return np.asarray(np.sqrt(np.trace(covariance, axis1=1, axis2=2)), dtype=float)
