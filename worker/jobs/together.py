"""First poses of several cameras, whose points or lenses may have been given under each other's name.

Points clicked in the picture of another camera fit some pose, with the lens made to fit. The lenses show it where they
differ: a camera whose points refute its own lens and hold with another's, and the other way round. Cameras with lenses
alike are told apart by nothing here; of them only stored poses tell (`worker.jobs.locate`).
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations

from service.wire.field import FieldOfPlay
from service.wire.geometry import Pose
from service.wire.options import ClickedPoint
from service.wire.results import LocateResult
from worker.calibration.first.clicks import NoPose
from worker.calibration.first.first_pose import first_pose
from worker.calibration.scene.lens import Lens
from worker.jobs.locate import clicks_of, locate
from worker.jobs.reading import Failure, pitch_of
from worker.jobs.wire import Solution

Ended = dict[str, Solution[LocateResult] | Failure]


def locate_all(
    field: FieldOfPlay,
    lenses: Mapping[str, Lens],
    points: Mapping[str, list[ClickedPoint]],
    frames: Mapping[str, bytes],
    stored: Mapping[str, Pose],
) -> Ended:
    """The first pose of each camera that has a lens, or why it has none; by camera, as all but the field."""
    ended: Ended = {}
    for camera, lens in lenses.items():
        try:
            ended[camera] = locate(camera, field, lens, points[camera], frames.get(camera), lambda _: None, stored)
        except Failure as failure:
            ended[camera] = failure
    suspects = [camera for camera, end in ended.items() if _misfit(end) is not None]
    for one, other in combinations(suspects, 2):
        crossed = _rms_px(field, one, points, lenses[other]), _rms_px(field, other, points, lenses[one])
        if None not in crossed:
            words = {name: _misfit(ended[name]) for name in (one, other)}
            told = (
                f"the points of {one} fit the lens of {other} ({crossed[0]:.1f} px rms) and not their own "
                f"({words[one]}), and those of {other} the lens of {one} ({crossed[1]:.1f} px rms) and not their own "
                f"({words[other]}): the points of the two cameras are exchanged, or else their lenses"
            )
            ended |= {name: _refused(ended[name], told) for name in (one, other)}
    return ended


def _misfit(end: Solution[LocateResult] | Failure) -> str | None:
    """How badly points and lens of a camera fit each other, in words; None where nothing speaks against them."""
    if isinstance(end, Failure):
        return "no pose" if end.kind == "no-pose" else None
    result = end.result
    if result.lens is not None:
        return f"{result.lens.rms_before_px:.1f} px rms"
    if result.rejected_because is not None:
        doubted = sum(point.doubted for point in result.points)
        return f"{result.rms_px:.1f} px rms, {doubted} of {len(result.points)} points doubted"
    return None


def _rms_px(field: FieldOfPlay, camera: str, points: Mapping[str, list[ClickedPoint]], lens: Lens) -> float | None:
    """How well a camera's points fit a lens as it is; None where they do not."""
    pitch = pitch_of(field)
    try:
        found = first_pose(clicks_of(camera, pitch, points[camera]), lens, pitch.places(), camera)
    except NoPose:
        return None
    return found.rms_px if found.lens is None and found.rejected_because is None else None


def _refused(end: Solution[LocateResult] | Failure, why: str) -> Solution[LocateResult] | Failure:
    if isinstance(end, Failure):
        return end.because(why)
    result = end.result.model_copy(update={"accepted": False, "rejected_because": why})
    return Solution(result, end.pictures)
