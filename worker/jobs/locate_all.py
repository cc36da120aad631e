"""First poses of several cameras, whose points or lenses may have been given under each other's name.

Points clicked in the picture of another camera fit some pose, with the lens made to fit. The lenses show it where they
differ: a camera whose points refute its own lens and hold with another's, and the other way round. Cameras with lenses
alike cannot be told apart here, only by stored poses (`worker.jobs.locate`).
"""

import math
from collections.abc import Mapping
from itertools import combinations

from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Pose
from service.schemas.options import ClickedPoint
from service.schemas.results import LocateResult
from worker.calibration.geometry.lens import Lens
from worker.calibration.onboarding.clicks import UndeterminedPoseError
from worker.calibration.onboarding.first_pose import first_pose
from worker.jobs.from_schemas import JobFailedError, pitch_of
from worker.jobs.locate import clicks_of, locate
from worker.jobs.to_schemas import Solution

LEAST_OFF, NEARER = 0.02, 0.4
"""A fitted focal length that is off its own lens by more than the first part of it, and off another's by less than the
second part of that, is called nearer to the other's."""
Ended = Solution[LocateResult] | JobFailedError
"""First pose of a camera, or why it has none."""


def locate_all(
    field: FieldOfPlay,
    lenses: Mapping[str, Lens],
    points: Mapping[str, list[ClickedPoint]],
    frames: Mapping[str, bytes],
    stored: Mapping[str, Pose],
) -> dict[str, Ended]:
    """The first pose of each camera that has a lens, or why it has none; by camera, as all but the field."""
    ended: dict[str, Ended] = {}
    for camera, lens in lenses.items():
        try:
            ended[camera] = locate(camera, field, lens, points[camera], frames.get(camera), lambda _: None, stored)
        except JobFailedError as failure:
            ended[camera] = failure
    suspects = [camera for camera, end in ended.items() if _misfit(end) is not None]
    for one, other in combinations(suspects, 2):
        crossed = _rms_px(field, one, points, lenses[other]), _rms_px(field, other, points, lenses[one])
        if None not in crossed:
            words = {name: _misfit(ended[name]) for name in (one, other)}
            explanation = (
                f"the points of {one} fit the lens of {other} ({crossed[0]:.1f} px rms) and not their own "
                f"({words[one]}), and those of {other} the lens of {one} ({crossed[1]:.1f} px rms) and not their own "
                f"({words[other]}): the points of the two cameras are exchanged, or else their lenses"
            )
            ended |= {name: _refused(ended[name], explanation) for name in (one, other)}
    return {camera: _compared(camera, end, lenses) for camera, end in ended.items()}


def _compared(camera: str, end: Ended, lenses: Mapping[str, Lens]) -> Ended:
    """The end of a camera with a warning where the lens that was fitted to its points is nearer to another camera's."""
    if isinstance(end, JobFailedError) or end.result.lens is None or not end.result.accepted:
        return end
    fitted = end.result.intrinsics.matrix[0][0]
    off = {name: abs(math.log(fitted / lens.matrix[0, 0])) for name, lens in lenses.items()}
    nearest = min(off, key=lambda name: off[name])
    if off[camera] < LEAST_OFF or off[nearest] > NEARER * off[camera]:
        return end
    hint = (
        f"a focal length of {fitted:.0f} px fits the points, which is nearer to the lens of {nearest} "
        f"({lenses[nearest].matrix[0, 0]:.0f} px) than to that of {camera} ({lenses[camera].matrix[0, 0]:.0f} px): are "
        "the points or the lenses of the two exchanged?"
    )
    return Solution(end.result.model_copy(update={"warnings": [*end.result.warnings, hint]}), end.pictures)


def _misfit(end: Ended) -> str | None:
    """Return in words how badly points and lens of a camera fit each other, or None if they fit."""
    if isinstance(end, JobFailedError):
        return "no pose" if end.kind == "no-pose" else None
    result = end.result
    if result.lens is not None:
        return f"{result.lens.rms_before_px:.1f} px rms"
    if result.rejected_because is not None:
        doubted = sum(point.doubted for point in result.points)
        return f"{result.rms_px:.1f} px rms, {doubted} of {len(result.points)} points doubted"
    return None


def _rms_px(field: FieldOfPlay, camera: str, points: Mapping[str, list[ClickedPoint]], lens: Lens) -> float | None:
    """Return the rms of a camera's points with a lens as it is, or None if they do not fit it."""
    pitch = pitch_of(field)
    try:
        found = first_pose(clicks_of(camera, pitch, points[camera]), lens, pitch.places(), camera)
    except UndeterminedPoseError:
        return None
    return found.rms_px if found.lens is None and found.rejected_because is None else None


def _refused(end: Ended, why: str) -> Ended:
    if isinstance(end, JobFailedError):
        return end.because(why)
    result = end.result.model_copy(update={"accepted": False, "rejected_because": why})
    return Solution(result, end.pictures)
