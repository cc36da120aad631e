"""Candidates for the camera of a frame: proposed ones refined onto its measured lines, with the evidence for each."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.contrast import Channels
from worker.calibration.detection.evidence import Evidence
from worker.calibration.diagnostics.overlap import Overlap, overlap_of
from worker.calibration.diagnostics.registration import Response
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.derivatives import POSE_NUMBERS
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import SIGMA_NAMES
from worker.calibration.geometry.parameters import LensParameter, free_lens_sigma
from worker.calibration.refinement.refine import Observations, refine, refine_coarsely
from worker.calibration.refinement.uncertainty import GroundSigma, RefinedPose, Sigma
from worker.calibration.relocalisation.paint import Paint, share
from worker.calibration.relocalisation.sought import SoughtCamera


@dataclass(frozen=True)
class Candidate:
    """Refined camera that may have taken the frame.

    `agreement` 0..1: the harmonic mean of the share of expected lines seen beyond chance, as `evidence` has it, and of
    the share of the frame's paint that is `explained`; `explains` (n,): True for places on paint that lie on such a
    line; `residual_px`: rms of its lines, None where too few were measured, as `sigma` of the pose and `ground_sigma`,
    how well all that the lines tell of pose and lens puts the markings in view on the ground.
    """

    camera: Camera
    agreement: float
    explains: NDArray[np.bool_]
    evidence: Evidence
    overlap: Overlap
    residual_px: float | None
    sigma: Sigma | None
    ground_sigma: GroundSigma | None

    @property
    def explained(self) -> float:
        """Share of the paint in the frame, 0..1, that lies on a line of the field."""
        return share(self.explains)


@dataclass(frozen=True)
class FrameObservations:
    """Lines and `paint` of one frame: `observations` for a refinement, `small` (H, W) the response in 0..255."""

    field: Field
    observations: Observations
    small: NDArray[np.uint8]
    paint: Paint

    @classmethod
    def of(cls, field: Field, channels: Channels, response: Response) -> "FrameObservations":
        """Return the observations of a frame by the response (H, W) of the network, 0..1."""
        small = np.rint(response * 255).astype(np.uint8)
        return cls(field, Observations([channels], [response]), small, Paint.of(small))

    def strengthened(self, times: float) -> "FrameObservations":
        """Return the observations of this frame for a network that is so many `times` as sure."""
        (channels,), (response,) = self.observations.channels, self.observations.responses
        return FrameObservations.of(self.field, channels, np.minimum(np.float32(times) * response, np.float32(1.0)))

    def candidate(self, camera: Camera, sought: SoughtCamera) -> Candidate:
        """Refine a proposed camera coarsely onto the measured lines close by, with its lens if that is sought."""
        lens = free_lens_if_sought(0, camera, sought)
        return self.assessed(refine_coarsely(self.field, [camera], self.observations, lens).each[0], sought)

    def settled(self, camera: Camera, sought: SoughtCamera) -> Candidate:
        """Refine a camera until it stands still, with its lens if that is sought."""
        lens = free_lens_if_sought(0, camera, sought)
        return self.assessed(refine(self.field, [camera], self.observations, 0.0, lens).each[0], sought)

    def on_lines_farther_off(self, camera: Camera, close: Candidate, sought: SoughtCamera) -> Candidate:
        """Refine a proposed camera onto lines farther off; return that if better than `close`."""
        # A pose that sees less has none near that sees more, as a rule; one that sees more is left as it is.
        if not 0.3 < close.evidence.agreement < 0.9:
            return close
        # Principal point and k2 would be bent for the sake of lines that are not caught yet.
        first = free_focal_length_and_k1(0, camera) if sought.is_lens_sought else []
        # Half width of the search for lines of a proposal round by round, in pixels of a 4K frame, where an ordinary
        # refinement sees some of the lines and not all. Most proposals are right to a pixel or two, and from there what
        # lies farther off may be blotches of snow and worn grass; of others some lines are caught and one is taken for
        # its neighbour.
        caught = refine_coarsely(self.field, [camera], self.observations, first, (60.0, 28.0, 14.0, 8.0, 5.0)).each[0]
        far = self.candidate(caught.camera, sought) if sought.is_lens_sought else self.assessed(caught, sought)
        return far if is_better(far, close) else close

    def assessed(self, found: RefinedPose, sought: SoughtCamera) -> Candidate:
        """Assess a refined camera by lines and paint, and note the uncertainty of a lens that was sought."""
        if sought.is_lens_sought:
            found = replace(found, camera=with_sigmas(found))
        explains = self.paint.on_markings(self.field, found.camera)
        explained = share(explains)
        seen = max(found.evidence.agreement, 0.0)
        both = 2 * seen * explained / max(seen + explained, 1e-9)
        sigma = None if found.covariance is None else Sigma.from_covariance(found.covariance)
        overlap = overlap_of(self.field, found.camera, self.observations.responses[0])
        return Candidate(
            found.camera, both, explains, found.evidence, overlap, found.residual_px, sigma, found.ground_sigma
        )


def is_better(one: Candidate, other: Candidate) -> bool:
    """True if one agrees clearly more with lines and paint than the other, or about as much with lines closer to it."""
    more = one.agreement - other.agreement
    # Agreement by which a pose farther from its lines has to be better.
    if abs(more) > 0.03 or one.residual_px is None or other.residual_px is None:
        return more > 0
    return one.residual_px < other.residual_px


def free_lens_if_sought(number: int, camera: Camera, sought: SoughtCamera) -> list[LensParameter]:
    """Return `free_lens` of a camera whose lens is sought; nothing for one whose lens was given."""
    return free_lens(number, camera) if sought.is_lens_sought else []


def free_lens(number: int, camera: Camera) -> list[LensParameter]:
    """Return all parameters of the lens of a proposed camera, `number` of several, to be found along with its pose."""
    sigma = free_lens_sigma(camera.intrinsics)
    return [LensParameter(number, name, sigma[short]) for name, short in SIGMA_NAMES.items() if short in sigma]


def free_focal_length_and_k1(number: int, camera: Camera) -> list[LensParameter]:
    """Return focal length and k1 of a proposed camera, to be found along with a pose that is not yet in place."""
    return [one for one in free_lens(number, camera) if one.name in ("focal_length_px", "k1")]


def with_sigmas(found: RefinedPose) -> Camera:
    """Return the camera with the uncertainty of its lens noted in it."""
    if found.refined is None:
        return found.camera
    deviations = np.sqrt(np.diag(found.refined.covariance)[POSE_NUMBERS:]).tolist()
    named = zip(SIGMA_NAMES.items(), deviations, strict=True)
    known = {short: sigma for (name, short), sigma in named if name in found.camera.intrinsics.parameters}
    known["fy"] = float(np.hypot(known["fx"], known.pop("aspect") * found.camera.intrinsics.focal_length_px))
    return found.camera.with_lens(replace(found.camera.intrinsics, sigma=known, sigma_from="lines"))
