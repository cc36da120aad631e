"""Solving for the poses of all cameras: where they stood, then around it, and on a shared floor in one paint.

The cheapest explanation comes first, and the first one that the gate accepts for all cameras is the answer.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from worker.calibration.gate.quality import MUCH_UNEXPECTED
from worker.calibration.geometry.camera import Camera
from worker.calibration.joint_verdict import judge_together
from worker.calibration.near_path import NearSolution, refine_by_lines
from worker.calibration.observe import FrameObserver
from worker.calibration.paint_path import log_odds, show_paint_of_field
from worker.calibration.problem import PoseSolution, Problem, Solution
from worker.calibration.records import EngineResult, Path, ProgressReporter
from worker.calibration.steps import evidence_at, refine_without, with_unusable_cameras
from worker.calibration.swapped_cameras import mark_swapped_frames
from worker.calibration.wide_path import NO_CAMERAS, search_and_refine, search_in_overviews
from worker.calibration.zoom_refit import refit_zoomed


def solve(problem: Problem, observer: FrameObserver, progress: ProgressReporter) -> Solution:
    """Solve for the poses of all cameras and judge them, in all colours of the frames.

    Lines are asked first, where the cameras stood and then around it, and the network looks in full where they do not
    suffice. Only cameras that are not near their stored poses are searched for.
    """
    everyone = range(len(problem.cameras))
    problem = observer.with_overviews(problem, progress)

    # Where the cameras stood.
    near = refine_by_lines(problem, progress) if problem.options.search == "auto" else None
    solution = _solve_near(problem, near, progress)
    if solution is not None:
        return solution

    # Around it, by overviews. Cameras that are all near contradict each other: none of them is known to be right.
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


def solve_in_paint(
    solution: Solution, observer: FrameObserver, progress: ProgressReporter
) -> tuple[Solution, FrameObserver]:
    """Return the likelier of a solution in all colours and one in the paint of the field, with the frames it explains.

    Other sports' lines are in view of all cameras of a floor, where a camera that was turned is alone: only then is a
    paint looked for. In one paint less of the field's lines is seen, so that solution has to be likelier in all
    colours as well.
    """
    problem, judged = solution.problem, solution.judged
    usable = problem.usable
    if not usable or any(judged.cameras[n].overlap.unexpected < MUCH_UNEXPECTED for n in usable):
        return solution, observer
    painted = show_paint_of_field(problem, observer, progress.muted())
    if painted is None:
        return solution, observer
    seen = painted.with_overviews(painted.seen_in(problem), progress)
    again = _solve_around(seen, painted, range(len(problem.cameras)), NO_CAMERAS, progress)
    # What passes neither way is looked for elsewhere, by all that is seen.
    passes = any(one.accepted for one in [*judged.cameras, *again.judged.cameras])
    is_likelier = passes and _log_odds(problem, again.judged) > _log_odds(problem, judged)
    return (again, painted) if is_likelier else (solution, observer)


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
