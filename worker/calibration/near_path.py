"""The near path: cameras that stand almost at their stored poses are refined from there without a search.

The refinement catches lines that are a few pixels from where stored poses expect them, and ends where it ends after a
search. What it finds has to pass the same gate. That is asked camera by camera: one that was turned is searched for,
one that is fogged is left, and the others need not be.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from worker.calibration.detection.line_measurement import Measurements
from worker.calibration.gate.quality import MUCH_UNEXPECTED, CameraResult
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.visibility import VisibleLines
from worker.calibration.observe import FrameObserver
from worker.calibration.records import ProgressReporter
from worker.calibration.refinement.diagnosis import is_sure
from worker.calibration.refinement.refine import SEARCH_PX, LineReader, refine
from worker.calibration.refinement.uncertainty import RefinedPoses
from worker.calibration.solve import PoseSolution, Problem, assess_stored, free_parameters, judge_each

LEAST_CAUGHT = 0.6
"""Share of the expected lines that the refinement has to catch from the stored pose to be worth its time."""
FARTHEST_PX = 12.0
"""How far the visible lines may have moved on average, in pixels of a 4K frame: within what the refinement catches."""


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


def refine_by_lines(
    problem: Problem, observer: FrameObserver, progress: ProgressReporter
) -> tuple[Problem, NearSolution | None]:
    """Refine the cameras that stand almost at their stored poses by their lines alone.

    The network is asked for an overview of their frames, which the problem comes back with.
    """
    reader = problem.observed.observations.reader()
    numbers = _cameras_with_lines_near(problem, problem.usable, reader)
    problem = observer.with_overviews(problem, numbers, progress)
    return problem, _refine_near_stored(problem, numbers, reader, progress.muted())


def refine_with_network(
    problem: Problem, by_lines: NearSolution | None, progress: ProgressReporter
) -> NearSolution | None:
    """Refine the cameras near their stored poses, now that the network has looked in full at those that lines alone
    did not suffice for."""
    found = [] if by_lines is None else [n for n in by_lines.numbers if n in problem.usable]
    reader = problem.observed.observations.reader()
    others = [n for n in problem.usable if n not in found]
    more = _cameras_with_lines_near(problem, others, reader)
    if not more:
        return by_lines
    return _refine_near_stored(problem, sorted([*found, *more]), reader, progress.muted(), by_lines)


def _refine_near_stored(
    problem: Problem,
    numbers: list[int],
    reader: LineReader,
    progress: ProgressReporter,
    known: NearSolution | None = None,
) -> NearSolution | None:
    """Refine the cameras that stand almost at their stored poses, out of those of these `numbers`; None if none do.

    `known`: the solution of some of them, which is not computed again when the others drop out.
    """
    while numbers:
        if known is not None and numbers == known.numbers:
            return known
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
                reader=reader.of(numbers),
            )
        results = judge_each(group, refined, progress)
        near = [
            n
            for n, result in zip(numbers, results, strict=True)
            if _is_near(result, group.options.lens_may_drift)
            and (n in problem.observed.in_full or _is_confirmed_by_overview(result))
        ]
        if near == numbers:
            return NearSolution(numbers, refined, results)
        # The cameras that were not near may have pulled at the others, which are refined once more without them.
        numbers = near
    return None


def with_unusable_cameras(near: NearSolution, problem: Problem, progress: ProgressReporter) -> PoseSolution:
    """Return the solution when all usable cameras are near; the others are assessed at their stored poses."""
    results = dict(zip(near.numbers, near.results, strict=True))
    for n in range(len(problem.cameras)):
        if n not in results:
            results[n] = assess_stored(problem.of([n]), progress).result
    in_order = [results[n] for n in range(len(problem.cameras))]
    refined = near.refined
    return PoseSolution(refined.pitch, list(problem.cameras), in_order, near.numbers, refined.deviations, generations=0)


def _cameras_with_lines_near(problem: Problem, numbers: Sequence[int], reader: LineReader) -> list[int]:
    """Return those of some cameras that see most of their lines near to where their stored poses expect them."""
    lines = problem.pitch.line_points()
    cameras = [problem.cameras[n] for n in numbers]
    measured = reader.of(numbers).measure(lines, cameras, SEARCH_PX[0])
    return [
        n
        for n, camera, found in zip(numbers, cameras, measured, strict=True)
        if _measured_share(VisibleLines.from_camera(lines, camera), found) >= LEAST_CAUGHT
    ]


def _measured_share(expected: VisibleLines, found: Measurements) -> float:
    """Return the share 0..1 of the expected length that was measured; lines below a pixel count by their width."""
    weight = expected.length_px * np.minimum(expected.width_px, 1.0)
    return float(np.sum(weight[np.isin(expected.index, found.index)]) / max(np.sum(weight), 1e-12))


def _is_confirmed_by_overview(result: CameraResult) -> bool:
    """True unless most of the lines that the network sees on the pitch lie where the camera expects none."""
    return result.overlap.unexpected < MUCH_UNEXPECTED


def _is_near(result: CameraResult, lens_may_drift: bool) -> bool:
    """True if a camera passes the gate by itself, has hardly moved, and has no zoom that is to be followed."""
    farthest_px = FARTHEST_PX * result.camera.intrinsics.relative_size
    zoomed = lens_may_drift and result.zoom is not None and is_sure(result.zoom)
    return result.accepted and not zoomed and result.moved.pixels <= farthest_px
