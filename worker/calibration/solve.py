"""Solving for the poses of all cameras: near path first, then wide.

In all colours, or in the paint of one field.

The cheapest explanation comes first, and the first one that the gate accepts for all cameras is the answer.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from worker.calibration.diagnostics.overlap import Overlap
from worker.calibration.gate.quality import GATE, MUCH_UNEXPECTED, Moved
from worker.calibration.geometry.camera import Camera
from worker.calibration.joint_verdict import judge_together
from worker.calibration.near_path import NearAttempt, NearSolution, refine_by_lines
from worker.calibration.observe import FrameObserver
from worker.calibration.paint_path import (
    around_stored_poses,
    at_stored_poses,
    log_odds,
    show_paint_of_field,
)
from worker.calibration.problem import PoseSolution, Problem, Solution
from worker.calibration.records import EngineResult, Path, ProgressReporter
from worker.calibration.steps import evidence_at, refine_without, with_unusable_cameras
from worker.calibration.swapped_cameras import mark_swapped_frames
from worker.calibration.wide_path import NO_CAMERAS, search_and_refine, search_in_overviews
from worker.calibration.zoom_refit import refit_zoomed


def solve(problem: Problem, observer: FrameObserver, progress: ProgressReporter) -> tuple[Solution, FrameObserver]:
    """Solve for the poses of all cameras, in all colours of their frames or in the paint of the field.

    Also return the frames that the solution explains. Other sports' lines are in view of all cameras of a floor, where
    a camera that was turned is alone: only then is a paint looked for.
    """
    problem = observer.with_overviews(problem, progress)
    attempt = _refine_near(problem, progress)
    near = attempt.solution
    solution = _solve_near(problem, near, progress)
    if solution is not None:
        return solution, observer

    # Where the cameras stood, in one paint.
    if _stand_among_other_lines(problem, attempt):
        painted = show_paint_of_field(problem, observer, at_stored_poses, progress.muted())
        solution = None if painted is None else _solve_near_in(painted, problem, progress)
        if painted is not None and solution is not None:
            return solution, painted

    # Around it, in all colours and then in one paint.
    solution = _solve_farther(problem, near, observer, progress)
    problem, judged = solution.problem, solution.judged
    if not _are_mostly_others([judged.cameras[n].overlap for n in problem.usable]):
        return solution, observer
    painted = show_paint_of_field(problem, observer, around_stored_poses, progress.muted())
    if painted is None:
        return solution, observer
    seen = painted.with_overviews(painted.seen_in(problem), progress)
    again = _solve_around(seen, painted, range(len(problem.cameras)), NO_CAMERAS, progress)
    return (again, painted) if _is_likelier(again, solution) else (solution, observer)


def solve_in_all_colours(problem: Problem, observer: FrameObserver, progress: ProgressReporter) -> Solution:
    """Solve for the poses of all cameras by all that their frames show."""
    problem = observer.with_overviews(problem, progress)
    near = _refine_near(problem, progress).solution
    return _solve_near(problem, near, progress) or _solve_farther(problem, near, observer, progress)


def _refine_near(problem: Problem, progress: ProgressReporter) -> NearAttempt:
    """Refine the cameras that stand almost where they stood; none of them if a search was asked for."""
    return refine_by_lines(problem, progress) if problem.options.search == "auto" else NearAttempt([], None)


def _solve_farther(
    problem: Problem, near: NearSolution | None, observer: FrameObserver, progress: ProgressReporter
) -> Solution:
    """Search for the cameras that are not `near` their stored poses.

    Lines are asked first, and the network looks in full where they do not suffice. Cameras that are all near contradict
    each other: none of them is known to be right.
    """
    everyone = range(len(problem.cameras))
    if near is None or near.numbers == problem.usable:
        near, lost = None, list(everyone)
    else:
        lost = [n for n in everyone if n not in near.numbers]
    problem = replace(problem, observed=mark_swapped_frames(problem, lost, observer.frames, progress))
    # All that are lost may have frames of other cameras: then those that are near are all there are.
    solution = _solve_near(problem, near, progress)
    if solution is not None:
        return solution
    return _solve_around(problem, observer, lost, NO_CAMERAS if near is None else near.cameras, progress)


def _stand_among_other_lines(problem: Problem, near: NearAttempt) -> bool:
    """True if all usable cameras see the field's lines from near their stored poses, and mostly others beside them.

    Asked where the lines lie best: from a camera that turned by half a degree the field's own lines look like others.
    """
    sees_all = len(near.tried) == len(problem.usable)
    return sees_all and _are_mostly_others([one.overlap for one in near.tried])


def _are_mostly_others(overlaps: Sequence[Overlap]) -> bool:
    """True if each camera sees mostly lines that are not the field's."""
    return bool(overlaps) and all(one.unexpected >= MUCH_UNEXPECTED for one in overlaps)


def _solve_near_in(painted: FrameObserver, problem: Problem, progress: ProgressReporter) -> Solution | None:
    """Return the solution at the stored poses of a problem in `painted` frames; None unless it is accepted.

    Less is seen of the field's lines in one paint: in all colours the stored poses may not fit better.
    """
    seen = painted.with_overviews(painted.seen_in(problem), progress)
    solution = _solve_near(seen, _refine_near(seen, progress).solution, progress)
    if solution is None:
        return None
    for n in problem.usable:
        stored, found = problem.cameras[n], solution.judged.cameras[n].camera
        before, after = (evidence_at(problem, n, camera).agreement for camera in (stored, found))
        if after < before - GATE.agreement_loss:
            return None
    return solution


def _is_likelier(in_paint: Solution, in_all: Solution) -> bool:
    """True if the solution in one paint is likelier in all colours, too; less is seen of the field's lines in one."""
    # At the same poses all colours show more than one paint does, which is taken only where no other way passes.
    if _are_one_explanation(in_paint, in_all):
        return not in_all.judged.accepts_all_of(in_paint.judged)
    # What passes neither way is looked for elsewhere, by all that is seen.
    passes = any(one.accepted for one in [*in_all.judged.cameras, *in_paint.judged.cameras])
    return passes and _log_odds(in_all.problem, in_paint.judged) > _log_odds(in_all.problem, in_all.judged)


def _are_one_explanation(one: Solution, other: Solution) -> bool:
    """True if two solutions put the markings apart by no more than lines may lie beside a pose that fits them."""
    both = zip(one.judged.cameras, other.judged.cameras, strict=True)
    return all(
        Moved.between(one.problem.pitch, its.camera, there.camera).pixels <= GATE.most_residual_px(its.camera)
        for its, there in both
    )


def _solve_near(problem: Problem, near: NearSolution | None, progress: ProgressReporter) -> Solution | None:
    """Return the solution at the stored poses; None unless all usable cameras are near and accepted together."""
    if near is None or near.numbers != problem.usable:
        return None
    poses = with_unusable_cameras(problem, problem.cameras, near.refined, near.results, 0, progress)
    return _accepted_together(problem, poses, "near", progress)


def _solve_around(
    problem: Problem,
    observer: FrameObserver,
    lost: Sequence[int],
    near: Mapping[int, Camera],
    progress: ProgressReporter,
) -> Solution:
    """Search around their stored poses for the `lost` cameras; `near` holds the others at their refined poses."""
    poses = search_in_overviews(problem, progress, near)
    solution = None if poses is None else _accepted_together(problem, poses, "wide", progress)
    if solution is not None:
        return solution

    # By all that the network sees.
    problem = observer.look_in_full(problem, lost, progress)
    poses = refit_zoomed(problem, search_and_refine(problem, progress, near), progress)
    while True:
        judged = judge_together(problem, poses.pitch, poses.results, progress)
        contradicted = [n for n in poses.together if not judged.cameras[n].accepted]
        if len(contradicted) in (0, len(poses.together)):
            return Solution(problem, poses, judged, "wide")
        # A camera that the others contradict must not have pulled at them.
        poses = refine_without(contradicted, problem, poses, progress)


def _accepted_together(
    problem: Problem, poses: PoseSolution, path: Path, progress: ProgressReporter
) -> Solution | None:
    """Judge the cameras against each other; None unless all that were refined together are accepted."""
    judged = judge_together(problem, poses.pitch, poses.results, progress)
    is_accepted = all(judged.cameras[n].accepted for n in poses.together)
    return Solution(problem, poses, judged, path) if is_accepted else None


def _log_odds(problem: Problem, judged: EngineResult) -> float:
    """Return how much likelier judged poses are than ones that chance finds, by the frames of a problem, in nats."""
    usable = problem.usable
    cameras = [judged.cameras[n].camera for n in usable]
    shares = [evidence_at(problem, n, camera).agreement for n, camera in zip(usable, cameras, strict=True)]
    return log_odds(problem.of(usable), cameras, shares)
