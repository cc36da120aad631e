"""The wide path: other cameras are searched for, and all are refined.

They are searched for in overviews of their frames first, and refined by lines alone; where all pass the gate so, the
network need not look in full. Else it has to, and a bad camera drags no other along: a camera that fails the gate is
tried on its own. If it passes there, the others get it back once, at the pose from which it passed; if not, or if it
fails again, it stays by itself, and the others are refined without it.
"""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from worker.calibration.geometry.camera import Camera
from worker.calibration.problem import PoseSolution, Problem
from worker.calibration.records import ProgressReporter
from worker.calibration.refinement.refine import Observations
from worker.calibration.refinement.uncertainty import RefinedPoses
from worker.calibration.search.search import Found
from worker.calibration.steps import (
    Attempt,
    assess_stored,
    attempt,
    best_attempt,
    follows_zoom,
    is_confirmed,
    joined_deviations,
    judge_each,
    network_responses,
    refine_and_judge,
    refine_poses,
    search_poses,
    shows_most_lines,
    single_camera_problem,
    with_unusable_cameras,
)

NO_CAMERAS: Mapping[int, Camera] = MappingProxyType({})


def search_in_overviews(
    problem: Problem, progress: ProgressReporter, near: Mapping[int, Camera] = NO_CAMERAS
) -> PoseSolution | None:
    """Search in overviews for all usable cameras but those found `near` their stored poses, and refine by lines alone.

    None if there are none, or unless each frame shows most of the lines there, and each camera passes the gate by
    itself, is confirmed by its overview, and has no zoom to be followed.
    """
    together = problem.usable
    if not together:
        return None
    begun, generations = _search_for_lost(problem, near, progress)
    found = [begun[n] for n in together]
    group = problem.of(together)
    by_lines = Observations.of_lines_alone(group.observed.observations.channels)
    if not all(shows_most_lines(problem.pitch, found, by_lines.reader())):
        return None
    refined = refine_poses(group, found, by_lines, progress)
    results = judge_each(group, refined, progress)
    passed = all(
        result.accepted and is_confirmed(problem, n, result) and not follows_zoom(problem, result)
        for n, result in zip(together, results, strict=True)
    )
    return with_unusable_cameras(problem, begun, refined, results, generations, progress) if passed else None


def search_and_refine(
    problem: Problem, progress: ProgressReporter, near: Mapping[int, Camera] = NO_CAMERAS
) -> PoseSolution:
    """Search for all usable cameras but those found `near` their stored poses, by what the network has seen of them,
    and refine together those that pass the gate."""
    together = problem.usable
    begun, generations = _search_for_lost(problem, near, progress)
    everyone = range(len(begun))
    alone = {n: assess_stored(problem.of([n]), progress) for n in everyone if n not in together}
    results = {n: attempt.result for n, attempt in alone.items()}
    refined = RefinedPoses(problem.pitch, [], [], [])
    while together:
        refined, judged = refine_and_judge(problem.of(together), [begun[n] for n in together], progress)
        results |= zip(together, judged, strict=True)
        failing = [n for n in together if not results[n].accepted]
        if not failing:
            break
        for n in failing:
            tried_before = n in alone
            if not tried_before:
                by_itself = single_camera_problem(problem, n)
                is_alone = together == [n] and by_itself.options == problem.options
                first = Attempt(begun[n], refined, results[n]) if is_alone else attempt(by_itself, begun[n], progress)
                alone[n] = best_attempt(by_itself, first, progress)
                begun[n] = alone[n].begun
            if tried_before or not alone[n].result.accepted:
                together = [other for other in together if other != n]
                results[n] = alone[n].result
    deviations = joined_deviations(refined, [alone[n].refined for n in everyone if n not in together])
    in_order = [results[n] for n in everyone]
    return PoseSolution(refined.pitch, begun, in_order, together, deviations, generations)


def _search_for_lost(
    problem: Problem, near: Mapping[int, Camera], progress: ProgressReporter
) -> tuple[list[Camera], int]:
    """Return where the search finds the usable cameras that are not `near`, with the others where they are.

    Also the number of generations that it took.
    """
    lost = [n for n in problem.usable if n not in near]
    found = Found([], np.inf, 0)
    if lost:
        found = search_poses(problem.of(lost), network_responses(problem.of(lost)), progress)
    begun = dict(enumerate(problem.cameras)) | dict(near) | dict(zip(lost, found.cameras, strict=True))
    return [begun[n] for n in range(len(problem.cameras))], found.generations
