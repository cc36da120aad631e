"""Refit of cameras whose zoom or focus has moved.

Where lines and movement contradict the focal length beyond doubt, the pose that was found with it is wrong, and a
better one is known. Whether that may be stored is the venue's choice: a lens that was screwed tight has not moved, and
then something else is wrong.
"""

from dataclasses import replace

from worker.calibration.gate.quality import CameraResult, Refusal, zoom_in_words, zoomed_beyond_doubt
from worker.calibration.geometry.camera import Camera
from worker.calibration.problem import PoseSolution, Problem
from worker.calibration.records import ProgressReporter
from worker.calibration.refinement.diagnosis import is_sure
from worker.calibration.steps import judge_each, refine_poses, refine_without, single_camera_problem

MOST_ROUNDS = 5
LEAST_SIGMAS = 2.0
"""Least change of a focal length that counts, in its sigmas."""
CONVERGED_SIGMAS = 0.25
"""A focal length that a round changes by less than this part of its sigma has converged."""
WHAT_TO_DO = (
    "zoom or focus have moved. Pose and intrinsics of the answer fit the lines: accept the job by hand to store both, "
    "let the venue's lens be may-drift, or set the zoom back"
)


def refit_zoomed(problem: Problem, solution: PoseSolution, progress: ProgressReporter) -> PoseSolution:
    """Return the solution in which each camera that zoomed has the focal length and pose that its lines say.

    What such a camera says of its neighbours with the old focal length is wrong: the others are refined without it.
    """
    zoomed = [n for n, result in enumerate(solution.results) if _needs_refit(problem, result)]
    attempts = {n: _refitted(problem, n, solution.results[n], progress) for n in zoomed}
    refitted = {n: result for n, result in attempts.items() if result is not None}
    solution = refine_without(refitted, problem, solution, progress)
    return replace(solution, results=[refitted.get(n, result) for n, result in enumerate(solution.results)])


def _needs_refit(problem: Problem, result: CameraResult) -> bool:
    """True for a lens that may drift as soon as it surely has; for another one only beyond the gate's doubt."""
    if problem.options.lens_may_drift and result.accepted:
        return result.zoom is not None and is_sure(result.zoom)
    return zoomed_beyond_doubt(result)


def _refitted(problem: Problem, number: int, result: CameraResult, progress: ProgressReporter) -> CameraResult | None:
    """Refit a camera by itself with the focal length that its lines say; None if even that fails the gate."""
    stored, found = problem.cameras[number], result
    for _ in range(MOST_ROUNDS):
        zoom, likelier = found.zoom, found.with_fitted_zoom
        if zoom is None or likelier is None:
            return None
        changed_px = likelier.intrinsics.focal_length_px - stored.intrinsics.focal_length_px
        found = _refined_with_lens(problem, number, likelier, progress)
        if abs(zoom.value) >= CONVERGED_SIGMAS * zoom.sigma:
            continue
        if abs(changed_px) < LEAST_SIGMAS * zoom.sigma:
            # With another focal length the lines say less of it than they did before.
            return None
        change = replace(zoom, value=changed_px)
        moved = Refusal("zoomed", f"{zoom_in_words(stored, change)}: {WHAT_TO_DO}")
        refusal = None if problem.options.lens_may_drift else moved
        if not found.accepted:
            return None
        lens = replace(found.camera.intrinsics, sigma={**stored.intrinsics.sigma, "fx": zoom.sigma})
        return replace(found, camera=found.camera.with_lens(lens), zoom=change, refusal=refusal, lens_found=True)
    return None


def _refined_with_lens(problem: Problem, number: int, begun: Camera, progress: ProgressReporter) -> CameraResult:
    """Refine a camera by itself from `begun` and with its lens; its stored pose stays that of the stored lens."""
    alone = single_camera_problem(problem, number)
    refined = refine_poses(alone, [begun], alone.observed.observations, progress)
    return judge_each(alone, refined, progress)[0]
