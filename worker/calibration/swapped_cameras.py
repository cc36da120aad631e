"""Frames that came from another camera of the venue: exchanged cables or addresses.

Asked only of cameras whose lines are not seen where their stored poses put them. Such a frame is another camera's
if it passes the gate at that camera's stored pose with that camera's lens, as a frame of its own would.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from worker.calibration.detection.view_condition import ViewCondition, look_at
from worker.calibration.gate.quality import CameraResult
from worker.calibration.geometry.camera import Camera, Frame
from worker.calibration.problem import ObservedCameras, Problem
from worker.calibration.records import NOT_RECORDED, ProgressReporter
from worker.calibration.robust import SURE
from worker.calibration.steps import attempt, best_attempt, ridge_responses, search_poses, single_camera_problem

MOST_OF_ITS_OWN, LEAST_OF_ANOTHER = 0.3, 0.6
"""Share of the expected places at which a line is seen: a frame of which its own camera has more is not asked about,
and one of which another camera has less is not tried there."""


def mark_swapped_frames(
    problem: Problem, lost: Sequence[int], frames: Mapping[str, Sequence[Frame]], progress: ProgressReporter
) -> ObservedCameras:
    """Return the observations, in which the view of a frame of another camera is not usable and names that camera.

    `lost`: the numbers of the cameras that are asked about, whose lines did not find them at their own poses;
    `frames[camera.id]`: the frames of the problem's observations.
    """
    shown = {n: of for n in lost if (of := _shown_in(problem, frames, n, progress)) is not None}
    views = list(problem.observed.views)
    for n, of in shown.items():
        mutual = of.number in shown and shown[of.number].number == n
        words = _words(problem.cameras[of.number].id, of.share, views[n].figures.lines_found, mutual=mutual)
        views[n] = ViewCondition(False, "other-camera", None, words, views[n].figures)
    return replace(problem.observed, views=views)


@dataclass(frozen=True)
class _Shown:
    """The camera of which a frame is, by `number`, and the `share` of its lines that the frame has, 0..1."""

    number: int
    share: float


def _shown_in(
    problem: Problem, frames: Mapping[str, Sequence[Frame]], number: int, progress: ProgressReporter
) -> _Shown | None:
    """Find the other camera that the frame of camera `number` is of; None if it is its own, or nothing tells."""
    own = problem.cameras[number]
    if problem.observed.views[number].figures.lines_found >= MOST_OF_ITS_OWN:
        return None
    size = own.intrinsics.size
    others = [n for n, other in enumerate(problem.cameras) if n != number and other.intrinsics.size == size]
    with progress.timed("view"):
        views = {n: look_at(frames[own.id][0], problem.pitch, problem.cameras[n]) for n in others}
    for n in sorted(others, key=lambda n: -views[n].figures.lines_found):
        if views[n].figures.lines_found < LEAST_OF_ANOTHER:
            break
        result = _result_as(problem, number, n, views[n], progress)
        if result.accepted and not _stands_nearer(result, own, problem.cameras[n]):
            return _Shown(n, result.evidence.share)
    return None


def _result_as(
    problem: Problem, number: int, other: int, view: ViewCondition, progress: ProgressReporter
) -> CameraResult:
    """Calibrate the `other` camera by the frame of camera `number`."""
    frame = replace(problem.observed.of([number]), views=[view])
    alone = single_camera_problem(problem, other)
    alone = replace(alone, observed=frame, memories=[None], recorder=NOT_RECORDED)
    # The network has looked where the lines of the one camera can be, which is not where those of the other are.
    searched = search_poses(alone, ridge_responses(alone), progress.muted())
    first = attempt(alone, searched.cameras[0], progress.muted())
    return best_attempt(alone, first, progress.muted()).result


def _stands_nearer(result: CameraResult, own: Camera, other: Camera) -> bool:
    """True if a camera that was found from the other one's pose surely stands nearer to its own stored place.

    One that was turned until it sees what its neighbour sees still stands in its own.
    """
    to_own, to_other = map(result.camera.distance_m, (own, other))
    sigma = 0.0 if result.sigma is None else result.sigma.position_m
    return to_own + SURE * sigma < to_other


def _words(other: str, share: float, own_share: float, *, mutual: bool) -> str:
    seen = f"the frame looks like camera {other}'s: it shows {share:.0%} of the lines that {other} ought to see"
    cause = (
        "are cables or addresses exchanged?"
        if mutual
        else (f"was a frame of {other} sent for both, or are cables or addresses exchanged?")
    )
    return f"{seen}, and {own_share:.0%} of its own; {cause}"
