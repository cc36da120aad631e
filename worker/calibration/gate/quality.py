"""Quality gate: judges a result without ground truth, and refuses bad ones."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from worker.calibration.detection.evidence import Evidence
from worker.calibration.detection.view_condition import ViewCondition
from worker.calibration.diagnostics.markings import MarkingReport
from worker.calibration.diagnostics.overlap import Overlap
from worker.calibration.gate.confidence import confidence_of
from worker.calibration.geometry.camera import Camera, inside
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.plausible_pose import films_a_field
from worker.calibration.geometry.rotation import rotation_angles_deg
from worker.calibration.refinement.diagnosis import is_sure
from worker.calibration.refinement.least_squares import FEWEST_MEASUREMENTS
from worker.calibration.refinement.priors import MOVED_M, MOVED_RAD
from worker.calibration.refinement.uncertainty import Deviation, GroundSigma, RefinedPose

MUCH_UNEXPECTED = 0.4
"""Share of the segmentation on the field beside all lines of the venue from which it shows lines of something else."""


@dataclass(frozen=True)
class Gate:
    """Limits a result has to keep to replace the stored poses. Pixels are those of a 4K frame, unless said.

    `least_confidence`: below it a wrong pose accepted, ten times as bad as a right one refused, costs more than it
    saves. `residual_floor_px`: of the frame itself; lines of a small frame are no sharper.
    `largest_ground_sigma_m`: of where markings are put on the ground, which is what poses are used for; pose and lens
    of a long view may be off by metres along it, and make up for each other. Where grass is so far that it moves by
    less than `largest_ground_sigma_px` of the frame itself, the frame cannot tell its place any better.
    `largest_found_sigma_m`: of a first position through a lens that was given. `largest_zoomed_m`: how far from here a
    camera may be whose focal length the lines contradict.
    """

    least_confidence: float = 10 / 11
    agreement_loss: float = 0.1
    largest_residual_px: float = 2.4
    residual_floor_px: float = 1.2
    largest_ground_sigma_m: float = 0.25
    largest_ground_sigma_px: float = 1.0
    largest_found_sigma_m: float = 0.3
    largest_zoomed_m: float = 0.2
    largest_rotation_deg: float = 8.0
    largest_shift_m: float = 1.5
    largest_stitch_error_px: float = 1.5
    highest_ridge_m: float = 3.0

    def most_residual_px(self, camera: Camera) -> float:
        """Return the largest rms offset of lines, in pixels of the camera's own frame, for a pose that fits them."""
        return max(self.largest_residual_px * camera.intrinsics.relative_size, self.residual_floor_px)


GATE = Gate()

Reason = Literal[
    "view",
    "other-camera",
    "no-markings-in-view",
    "lines",
    "few-lines",
    "residual",
    "zoomed",
    "undetermined",
    "moved",
    "knocked",
    "stored-better",
    "not-together",
    "disagree",
    "ridge",
]


@dataclass(frozen=True)
class Refusal:
    """Refusal of a new pose: the `reason` in a word, and in words with numbers and what to do."""

    reason: Reason
    words: str


@dataclass(frozen=True)
class Moved:
    """Change from the stored pose to the new one: degrees, metres, mean shift of the visible markings in pixels."""

    rotation_deg: float
    position_m: float
    pixels: float

    @classmethod
    def between(cls, pitch: Field, before: Camera, after: Camera) -> "Moved":
        """Return the change of a camera's pose."""
        lines = pitch.line_points().position
        was = before.project(lines)
        shift = np.linalg.norm(after.project(lines) - was, axis=1)[inside(was, before.intrinsics.size)]
        shift = shift[np.isfinite(shift)]
        return cls(
            float(rotation_angles_deg(before.pose.rotation, after.pose.rotation)),
            before.distance_m(after),
            float(shift.mean()) if len(shift) else 0.0,
        )

    @property
    def scale(self) -> float:
        """Size of the change in units of a usual touch, `MOVED_RAD` or `MOVED_M`, the larger of both; 1 at least."""
        return max(np.radians(self.rotation_deg) / MOVED_RAD, self.position_m / MOVED_M, 1.0)

    @property
    def exceeds_limits(self) -> bool:
        """True if the change is larger than is allowed without somebody storing a new pose."""
        return self.rotation_deg > GATE.largest_rotation_deg or self.position_m > GATE.largest_shift_m

    def words(self) -> str:
        """Return the change in words, and the limits."""
        return (
            f"turned by {self.rotation_deg:.1f} degrees (at most {GATE.largest_rotation_deg} allowed) and moved by "
            f"{self.position_m:.2f} m (at most {GATE.largest_shift_m})"
        )


@dataclass(frozen=True)
class CameraResult(RefinedPose):
    """Result for one camera, which the gate judges: its refined pose, and what it is worth beside the stored one.

    `view`: whether its frame could be used, and what is wrong with it if not; `overlap`: of expected lines and the
    segmentation; `evidence_before`: computes that at the stored pose, lazily, since a good answer needs none;
    `refusal`: why its pose must not replace the stored one, None when it may; `lens_found`: whether the camera's lens
    is not the stored one but what the lines say; `markings`: what is seen of each; `moved_in_all`: since its memory
    began, None without one; `knocked`: whether it was lost, searched for and found again farther from its stored pose
    than the gate allows; `was_found`: whether the frame itself has led to where the refinement began, see
    `Options.found`.
    """

    view: ViewCondition
    overlap: Overlap
    evidence_before: Callable[[], Evidence]
    moved: Moved
    refusal: Refusal | None = None
    lens_found: bool = False
    markings: Sequence[MarkingReport] = field(default=(), kw_only=True)
    moved_in_all: Moved | None = field(default=None, kw_only=True)
    knocked: bool = field(default=False, kw_only=True)
    was_found: bool = field(default=False, kw_only=True)

    @property
    def accepted(self) -> bool:
        """True if the gate lets the pose replace the stored one."""
        return self.refusal is None

    @property
    def confidence(self) -> float | None:
        """Probability 0..1 that the pose explains the frame; None where the frame cannot be used."""
        if not self.view.usable:
            return None
        motion = None if self.was_found else self.moved.scale
        return confidence_of(self.evidence.agreement, self.overlap.unexplained, motion)

    @property
    def is_explained(self) -> bool:
        """True if the pose surely enough explains the frame."""
        return self.confidence is not None and self.confidence >= GATE.least_confidence

    @property
    def rejected_because(self) -> str | None:
        """Words of the refusal."""
        return None if self.refusal is None else self.refusal.words


def in_one_sentence(reasons: Sequence[str]) -> str:
    """Join reasons, some of which are sentences of their own: only the last one keeps its full stop.

    After a question, which keeps its mark, no semicolon follows.
    """
    *before, last = reasons or [""]
    return "; ".join([*(reason.removesuffix(".") for reason in before), last]).replace("?; ", "? ")


def credible_deviations(deviations: Sequence[Deviation], results: Sequence[CameraResult]) -> list[Deviation]:
    """Return the deviations that were read off cameras which see the field where they expect it."""
    lost = {result.camera.id for result in results if not result.is_explained}
    of_field = not lost or any(result.accepted for result in results)
    return [d for d in deviations if (of_field if d.camera is None else d.camera not in lost)]


def ridge_rejection(pitch: Field) -> Refusal | None:
    """Return the refusal of a field whose ridge was found along with the poses and cannot be one; None when it can."""
    height = 0.0 if pitch.ridge is None else float(pitch.ridge[0, 2])
    if 0 <= height <= GATE.highest_ridge_m:
        return None
    return Refusal(
        "ridge",
        f"the lines fit best with a ridge at {height:.3f} m, and a pitch has one between 0 and "
        f"{GATE.highest_ridge_m:.0f} m; calibrate without fit_ridge",
    )


def alone_rejection(result: CameraResult) -> Refusal | None:
    """Return the refusal of a camera's pose whatever the others say; None when it may replace the stored one."""
    if not result.view.usable:
        return Refusal(_reason_of(result.view), result.view.words)
    moved, seen = result.moved, result.evidence
    if not result.is_explained:
        return _why_not_explained(result)
    if result.residual_px is None or result.sigma is None:
        return Refusal(
            "few-lines",
            f"fewer than {FEWEST_MEASUREMENTS} points of lines could be measured; is the view free and lit?",
        )
    limit = GATE.most_residual_px(result.camera)
    if result.residual_px > limit:
        return Refusal(
            "residual",
            in_one_sentence(
                [
                    f"lines are {result.residual_px:.2f} px from where the pose puts them, at most {limit:.2f} "
                    "allowed; check intrinsics and the field's measures",
                    *_other_lines(result),
                ]
            ),
        )
    if result.zoom is not None and zoomed_beyond_doubt(result):
        return Refusal(
            "zoomed",
            f"{zoom_in_words(result.camera, result.zoom)}, which puts the camera {result.zoom_shift_m:.2f} m from "
            "where it seems to be: zoom or focus have moved, or the lens is not this one; calibrate the lens again",
        )
    if undetermined := _why_undetermined(result.ground_sigma):
        return Refusal("undetermined", undetermined)
    beaten_by_any = seen.agreement < 1 - GATE.agreement_loss
    if beaten_by_any and seen.agreement < (before := result.evidence_before()).agreement - GATE.agreement_loss:
        return Refusal(
            "stored-better",
            f"the stored pose fits the frame better: {before.share:.0%} of the markings' length is "
            f"seen where it puts them, with the new pose {seen.share:.0%}",
        )
    if moved.exceeds_limits:
        return _too_far(moved)
    if result.moved_in_all is not None and result.moved_in_all.exceeds_limits:
        return Refusal(
            "moved",
            f"{result.moved_in_all.words()}, over all jobs since its pose was last stored by hand: its mount may "
            "be giving way; look at it, then store this pose, or accept the job by hand",
        )
    return None


def _too_far(moved: Moved) -> Refusal:
    advice = "if somebody moved the camera, accept the job by hand once its picture is right"
    return Refusal("moved", f"{moved.words()}; {advice}")


def _why_not_explained(result: CameraResult) -> Refusal:
    moved, seen = result.moved, result.evidence
    wherever_it_stood = confidence_of(seen.agreement, result.overlap.unexplained, None)
    if moved.exceeds_limits and wherever_it_stood >= GATE.least_confidence:
        return _too_far(moved)
    return Refusal(
        "lines",
        in_one_sentence(
            [
                f"the markings in the frame do not make its pose sure: {seen.share:.0%} of their length is where it "
                f"ought to be ({seen.by_chance:.0%} is seen anywhere); beside them is paint for "
                f"{min(result.overlap.unexplained, 9.99):.0%} of it; the camera would have turned by "
                f"{moved.rotation_deg:.1f} degrees and moved by {moved.position_m:.2f} m; the pose is right with a "
                f"probability of {result.confidence:.0%}, at least {GATE.least_confidence:.0%} is needed; is it the "
                "right camera and the right sport, is the view free and lit, is the stored pose within a few degrees?",
                *_other_lines(result),
            ]
        ),
    )


def _why_undetermined(ground: GroundSigma | None) -> str | None:
    advice = "let the camera see lines in more than one direction, or measure lens or field again"
    if ground is None:
        return f"no marking is in view where the pose puts the camera; {advice}"
    left_open = ground_left_open(ground)
    return left_open and f"the visible lines do not determine the pose: {left_open}; {advice}"


def ground_left_open(ground: GroundSigma) -> str | None:
    """Return in words how far off markings in view may be on the ground; None if by no more than is allowed."""
    metres, pixels, beyond = ground.worst(GATE.largest_ground_sigma_m, GATE.largest_ground_sigma_px)
    if not beyond:
        return None
    return (
        f"what is in view may lie {metres:.2f} m ({pixels:.1f} px) from where it is put on the ground (sigma, at most "
        f"{GATE.largest_ground_sigma_m} m or {GATE.largest_ground_sigma_px} px allowed)"
    )


def _reason_of(view: ViewCondition) -> Reason:
    """Return the reason of an unusable view: `view` for all that the picture itself shows."""
    match view.cause:
        case "other-camera" | "no-markings-in-view" as reason:
            return reason
        case _:
            return "view"


def _other_lines(result: CameraResult) -> list[str]:
    """Return what to do about lines that are not the venue's, where there are many."""
    if not films_a_field(result.camera.pose):
        return [
            "from such a pose no field is filmed (it hangs upside down, or far away): was it written in another "
            "convention, camera to world or in centimetres?"
        ]
    overlap = result.overlap
    if overlap.unexpected < MUCH_UNEXPECTED:
        return []
    return [
        f"the network finds {overlap.found:.0%} of the lines, and {overlap.unexpected:.0%} of what it takes for "
        "lines on the pitch lies beside all of them: if another sport is painted there, list it in the field's "
        "other_markings"
    ]


def zoomed_beyond_doubt(result: CameraResult) -> bool:
    """True if the lines contradict the focal length, and the pose with it: either alone may be chance."""
    sure = result.zoom is not None and is_sure(result.zoom)
    return sure and result.zoom_shift_m > GATE.largest_zoomed_m


def zoom_in_words(camera: Camera, zoom: Deviation) -> str:
    """Return in words how far the focal length is from what the venue says."""
    focal = camera.intrinsics.focal_length_px
    by = f"{abs(zoom.value) / focal:.2%} ± {zoom.sigma / focal:.2%}"
    return f"the lines fit a focal length {by} {'longer' if zoom.value > 0 else 'shorter'} than the venue says"
