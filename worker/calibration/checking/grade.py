"""Grade of a checked camera: good, drifted, wrong or cannot tell; how far off it is, and the causes in words."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from worker.calibration.checking.changes import Change, fewest_changes
from worker.calibration.checking.check import CheckedCamera, good_within_px
from worker.calibration.checking.readings import Cause
from worker.calibration.gate.displacement import measure_displacement
from worker.calibration.gate.quality import CameraResult, Moved
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.derivatives import POSE_NUMBERS
from worker.calibration.geometry.lens import LENS_PARAMETERS

Grade = Literal["good", "drifted", "wrong", "cannot-tell"]
CauseOfGrade = (
    Cause
    | Change
    | Literal["other-lens", "other-place", "other-resolution", "distortion-order", "folds", "unexplained", "no-pose"]
)


@dataclass(frozen=True)
class Difference:
    """Difference of a calibration from what the frame shows, with one standard deviation of it.

    `pixels`: mean shift of the markings in view; `metres`: of the farthest marking in view, on the ground; None where
    the lines do not tell.
    """

    pixels: float
    sigma_pixels: float | None
    metres: float | None
    sigma_metres: float | None


@dataclass(frozen=True)
class GradedCamera:
    """A checked camera with its grade, its causes (name and words), and its difference from the frame, if known."""

    checked: CheckedCamera
    grade: Grade
    causes: list[tuple[CauseOfGrade, str]]
    difference: Difference | None


def grade(checked: CheckedCamera, lens_folds: str | None) -> GradedCamera:
    """Return the grade of a camera; `lens_folds`: words about a lens that has no rays for a part of the picture.

    One that folds where no marking is does no harm there: the frame is explained through it. It is named all the same
    beside a good grade, which speaks of the markings alone.
    """
    folds: list[tuple[CauseOfGrade, str]] = [] if lens_folds is None else [("folds", lens_folds)]
    found = checked.found
    if found is None:
        return _not_found(checked, folds)
    if not checked.has_pose:
        said: list[tuple[CauseOfGrade, str]] = [("no-pose", "the file has a lens and no pose; one was found")]
        return GradedCamera(checked, "cannot-tell", [*folds, *said], None)
    difference = _difference(checked, found)
    written: list[tuple[CauseOfGrade, str]] = [*zip(checked.reading.causes, checked.reading.words, strict=True)]
    if checked.is_resized:
        written.append(("other-resolution", "its lens is for pictures of another resolution"))
    if checked.is_reordered:
        written.append(("distortion-order", "its coefficients are k1, k2, k3, p1, p2 and not k1, k2, p1, p2, k3"))
    since: list[tuple[CauseOfGrade, str]] = []
    if difference.pixels > checked.tolerance_px:
        harmful = folds if checked.searched == "lens" else []
        written += harmful
        since += _changes(checked, found.camera, lens_is_wrong=bool(harmful))
    elif difference.pixels > good_within_px(checked.meant):
        # What may be chance is none through a lens that is known to be wrong.
        written += folds
    if written or any(cause in ("other-place", "other-lens") for cause, _ in since):
        return GradedCamera(checked, "wrong", [*written, *since], difference)
    if since:
        return GradedCamera(checked, "drifted", since, difference)
    return GradedCamera(checked, "good", folds, difference)


def _not_found(checked: CheckedCamera, folds: list[tuple[CauseOfGrade, str]]) -> GradedCamera:
    if not checked.is_clearly_wrong:
        return GradedCamera(checked, "cannot-tell", folds, None)
    why = f"lines are clearly seen, {checked.explained:.0%} of them where it puts markings, and no reading of it fits"
    return GradedCamera(checked, "wrong", [*folds, ("unexplained", why)], None)


def _difference(checked: CheckedCamera, found: CameraResult) -> Difference:
    ground = measure_displacement(checked.pitch, checked.meant, found)
    return Difference(
        checked.moved_px,
        checked.sigma_px,
        None if ground is None else float(np.hypot(*ground.shift)),
        None if ground is None else float(np.hypot(*ground.sigma)),
    )


def _changes(checked: CheckedCamera, now: Camera, *, lens_is_wrong: bool) -> list[tuple[CauseOfGrade, str]]:
    """Return what happened to a camera since, or what else is wrong, and no more than explains the markings in view."""
    pitch, meant, tolerance_px = checked.pitch, checked.meant, checked.tolerance_px
    if checked.searched == "anywhere" and Moved.between(pitch, meant, now).exceeds_limits:
        x, y, z = now.pose.position
        where = f"({x:.1f}, {y:.1f}, {z:.1f}) m"
        return [("other-place", f"the camera stands at {where}, and no reading of the file says so")]
    if lens_is_wrong:
        numbers_of_lens = range(POSE_NUMBERS, POSE_NUMBERS + len(LENS_PARAMETERS))
        changed = fewest_changes(pitch, meant.with_lens(now.intrinsics), now, tolerance_px, numbers_of_lens)
    else:
        changed = fewest_changes(pitch, meant, now, tolerance_px)
    of_pose = Moved.between(pitch, meant, changed.camera)
    longer = changed.camera.intrinsics.focal_length_px / meant.intrinsics.focal_length_px - 1
    lens = f"its focal length is {abs(longer):.1%} {'longer' if longer > 0 else 'shorter'}"
    zoom: tuple[CauseOfGrade, str] = ("zoomed", f"zoomed: {lens}")
    if checked.searched == "lens":
        zoom = "other-lens", f"another lens fits the lines: {lens}"
    said: dict[Change, tuple[CauseOfGrade, str]] = {
        "zoomed": zoom,
        "turned": ("turned", f"turned by {of_pose.rotation_deg:.2f}°"),
        "moved": ("moved", f"moved by {of_pose.position_m:.2f} m"),
    }
    return [words for change, words in said.items() if change in changed.changes]
