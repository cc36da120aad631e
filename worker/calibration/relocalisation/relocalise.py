"""A camera found from nothing, with a verdict: proposed by lines, refined onto measured lines, judged beside rivals.

A first pose has no stored one beside it. In place of "moved" and "the stored pose is better" it is asked whether a
clearly different pose explains the frame nearly as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.contrast import Channels
from worker.calibration.detection.evidence import Evidence
from worker.calibration.gate.quality import Gate
from worker.calibration.geometry.camera import Camera, Frame, inside
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import LENS_NUMBERS, Lens
from worker.calibration.geometry.parameters import LensParameter
from worker.calibration.geometry.plausible_pose import films_a_field
from worker.calibration.refinement.refine import Observations, refine
from worker.calibration.refinement.uncertainty import RefinedPose, Sigma
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.propose import Proposal, propose, unknown_lenses

SEARCH_PX = (60.0, 28.0, 14.0, 8.0, 5.0)
"""How far from a proposed line a painted one is looked for, round by round, in pixels of a 4K frame."""
REFINED, LEAST_OF_BEST = 4, 0.7
"""So many proposals are refined, of those that agree at least so well as such a part of the best."""
DIFFERENT = 0.01
"""Poses are different that put the markings in view farther apart than this part of the width of the frame, on mean."""
RIVAL = 0.15
"""A different pose whose agreement is lower by less than this may be the true one."""
FREE_FOCAL, FREE_CENTRE, FREE_BEND = 0.1, 20 / 3840, 0.05
"""How far off the numbers of a proposed lens may be: part of the focal length, part of the frame's width, and k1 at
half the width of the frame."""

Reason = Literal["no-lines", "lines", "few-lines", "residual", "undetermined", "implausible", "not-unique"]


@dataclass(frozen=True)
class Candidate:
    """A camera that may have taken the frame, refined; `evidence`: how much of the lines is seen where it puts them.

    `residual_px`: rms of its lines; None where too few were measured, as `sigma`.
    """

    camera: Camera
    evidence: Evidence
    residual_px: float | None
    sigma: Sigma | None


@dataclass(frozen=True)
class Relocalisation:
    """What was found for one camera: candidates, the best first; `refusal`: why the best one is not taken, with what
    to do; None where it is. `has_twin`: the field looks the same turned by half a turn, and the best camera with it.
    """

    candidates: Sequence[Candidate]
    refusal: tuple[Reason, str] | None
    has_twin: bool


def relocalise(
    field: Field, camera_id: str, frame: Frame, response: NDArray[np.uint8], lens: Lens | None, seed: int
) -> Relocalisation:
    """Find the camera that took `frame` (height, width, 3), BGR; `response` (height, width), 0..255, of the network.

    `lens` None: nothing is known of it; focal length, principal point and k1 are found with the pose.
    """
    height, width = frame.shape[:2]
    markings = FieldMap.of(field)
    lenses = unknown_lenses((width, height)) if lens is None else [lens]
    proposals = propose(markings, response, lenses, lens is not None, seed)
    observations = Observations([Channels([frame])], [np.divide(response, 255, dtype=np.float32)])
    candidates = list[Candidate]()
    for one in _distinct(field, camera_id, proposals):
        found = _refined(field, Camera(camera_id, one.lens, one.pose), observations, lens is None)
        candidates.append(found)
    candidates.sort(key=lambda one: -one.evidence.agreement)
    return Relocalisation(candidates, _refusal(field, candidates, Gate()), markings.is_symmetric)


def _distinct(field: Field, camera_id: str, proposals: Sequence[Proposal]) -> list[Proposal]:
    """The proposals to be refined: good beside the best, and different from each other."""
    chosen = list[Proposal]()
    for one in proposals:
        if len(chosen) == REFINED or one.agreement < LEAST_OF_BEST * proposals[0].agreement:
            break
        camera = Camera(camera_id, one.lens, one.pose)
        if all(_differ(field, Camera(camera_id, other.lens, other.pose), camera) for other in chosen):
            chosen.append(one)
    return chosen


def _refined(field: Field, camera: Camera, observations: Observations, frees_lens: bool) -> Candidate:
    """A proposed camera on the measured lines; with a free lens after its pose has caught them."""
    if not frees_lens:
        return _candidate(refine(field, [camera], observations, 0.0, searches_px=SEARCH_PX).each[0])
    width, focal = camera.intrinsics.size[0], camera.intrinsics.focal_length_px
    coarse = [
        LensParameter(0, "focal_length_px", FREE_FOCAL * focal),
        LensParameter(0, "k1", FREE_BEND * (2 * focal / width) ** 2),
    ]
    centre = [LensParameter(0, f"principal_point_{axis}_px", FREE_CENTRE * width) for axis in ("x", "y")]
    caught = refine(field, [camera], observations, 0.0, coarse, SEARCH_PX).each[0].camera
    found = refine(field, [caught], observations, 0.0, [*coarse, *centre]).each[0]
    return _candidate(replace(found, camera=_with_sigmas(found)))


def _candidate(found: RefinedPose) -> Candidate:
    sigma = None if found.covariance is None else Sigma.from_covariance(found.covariance)
    return Candidate(found.camera, found.evidence, found.residual_px, sigma)


def _with_sigmas(found: RefinedPose) -> Camera:
    """The camera with what is known of its lens written beside it."""
    if found.refined is None:
        return found.camera
    sigma = dict(zip(LENS_NUMBERS, np.sqrt(np.diag(found.refined.covariance)[-len(LENS_NUMBERS) :]), strict=True))
    focal, aspect = float(sigma["focal_length_px"]), float(sigma["aspect"])
    known = {"fx": focal, "fy": float(np.hypot(focal, aspect * found.camera.intrinsics.focal_length_px))}
    known |= {
        short: float(sigma[name])
        for short, name in (("cx", "principal_point_x_px"), ("cy", "principal_point_y_px"), ("k1", "k1"), ("k2", "k2"))
    }
    return found.camera.with_lens(replace(found.camera.intrinsics, sigma=known))


def _refusal(field: Field, candidates: Sequence[Candidate], gate: Gate) -> tuple[Reason, str] | None:
    """Why the best candidate is not taken."""
    if not candidates:
        return "no-lines", "no lines of a field are seen in the frame; is the view free and lit?"
    best, *others = candidates
    seen = best.evidence
    if seen.agreement < gate.least_agreement:
        return "lines", (
            f"no pose explains the lines: at the best one {seen.share:.0%} of the markings in view are seen, at least "
            f"{gate.least_share(seen):.0%} are needed; are sport and measures of the field right, is the view free?"
        )
    if best.residual_px is None or best.sigma is None:
        return "few-lines", "too few points of lines could be measured; is the view free and lit?"
    limit = max(gate.largest_residual_px * best.camera.intrinsics.relative_size, gate.residual_floor_px)
    if best.residual_px > limit:
        return "residual", (
            f"lines are {best.residual_px:.2f} px from where the best pose puts them, at most {limit:.2f} allowed; "
            "check the lens and the field's measures"
        )
    if not films_a_field(best.camera.pose):
        return "implausible", "the best pose is none from which a field is filmed: upside down, or far away"
    for other in others:
        if other.evidence.agreement > seen.agreement - RIVAL and _differ(field, best.camera, other.camera):
            return "not-unique", (
                f"two poses explain the lines: {seen.share:.0%} and {other.evidence.share:.0%} of the markings in view "
                "are seen where they put them; say where the camera stands, or let it see more of the field"
            )
    if best.sigma.rotation_deg > gate.largest_sigma_deg or best.sigma.position_m > gate.largest_sigma_m:
        return "undetermined", (
            f"the visible lines do not determine the pose: sigma {best.sigma.rotation_deg:.2f} degrees (at most "
            f"{gate.largest_sigma_deg} allowed), {best.sigma.position_m:.2f} m (at most {gate.largest_sigma_m})"
        )
    return None


def _differ(field: Field, one: Camera, other: Camera) -> bool:
    """Whether two cameras put the markings that the first one sees elsewhere; twins on a symmetric field do not."""
    lines = field.line_points().position
    width = one.intrinsics.size[0]
    seen = one.project(lines)
    lines, seen = lines[inside(seen, one.intrinsics.size)], seen[inside(seen, one.intrinsics.size)]
    if len(lines) == 0:
        return True
    off = np.linalg.norm(other.project(lines) - seen, axis=1)
    return not float(np.mean(np.nan_to_num(off, nan=width))) < DIFFERENT * width
