"""The near path: cameras near their stored poses are refined without a search.

The refinement catches lines that are a few pixels from where stored poses expect them, and ends where it ends after a
search. What it finds has to pass the same gate. That is asked camera by camera: one that was turned is searched for,
one that is fogged is left, and the others need not be.
"""

from dataclasses import dataclass

from worker.calibration.gate.quality import CameraResult
from worker.calibration.geometry.camera import Camera
from worker.calibration.problem import Problem
from worker.calibration.records import ProgressReporter
from worker.calibration.refinement.refine import refine
from worker.calibration.refinement.uncertainty import RefinedPoses
from worker.calibration.steps import (
    follows_zoom,
    free_parameters,
    has_hardly_moved,
    is_confirmed,
    judge_each,
    shows_most_lines,
)


@dataclass(frozen=True)
class NearSolution:
    """Cameras that were refined from their stored poses and passed the gate: their `numbers`, their joint refinement,
    and the result of each."""

    numbers: list[int]
    refined: RefinedPoses
    results: list[CameraResult]

    @property
    def cameras(self) -> dict[int, Camera]:
        """The refined cameras by number."""
        return {n: result.camera for n, result in zip(self.numbers, self.results, strict=True)}


@dataclass(frozen=True)
class NearAttempt:
    """Attempt at refining the cameras that show their lines near their stored poses.

    `tried` holds the results of all of them, refined together; `solution` those that passed, None if none did.
    """

    tried: list[CameraResult]
    solution: NearSolution | None


def refine_by_lines(problem: Problem, progress: ProgressReporter) -> NearAttempt:
    """Refine the cameras that stand almost at their stored poses by their lines alone."""
    progress = progress.muted()
    usable = problem.usable
    reader = problem.observed.observations.of(usable).reader()
    showing = shows_most_lines(problem.pitch, [problem.cameras[n] for n in usable], reader)
    numbers = [n for n, shows in zip(usable, showing, strict=True) if shows]
    tried: list[CameraResult] = []
    while numbers:
        group = problem.of(numbers)
        with progress.timed("refinement"):
            progress.at("refinement", 0.0)
            refined = refine(
                group.pitch,
                group.cameras,
                group.observed.observations,
                group.options.stitch_weight,
                free_parameters(group),
                memories=group.memories,
                reader=reader.of([usable.index(n) for n in numbers]),
            )
        results = judge_each(group, refined, progress)
        tried = tried or results
        near = [
            n
            for n, result in zip(numbers, results, strict=True)
            if _is_near(problem, result) and is_confirmed(problem, n, result)
        ]
        if near == numbers:
            return NearAttempt(tried, NearSolution(numbers, refined, results))
        # The cameras that were not near may have pulled at the others, which are refined once more without them.
        numbers = near
    return NearAttempt(tried, None)


def _is_near(problem: Problem, result: CameraResult) -> bool:
    """True if a camera passes the gate by itself, has hardly moved, and has no zoom that is to be followed."""
    return result.accepted and not follows_zoom(problem, result) and has_hardly_moved(result)
