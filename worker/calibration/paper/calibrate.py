"""Paper's method on one page: the same frames and the same judgement, with its own search and without a refinement."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime

import numpy as np

from worker.calibration.calibrate import NO_MEMORIES, diagnose, remember
from worker.calibration.detection.view_condition import UsualView
from worker.calibration.geometry.camera import Camera, Frame
from worker.calibration.geometry.field import Field
from worker.calibration.joint_verdict import judge_together
from worker.calibration.memory.camera_memory import CameraMemory
from worker.calibration.observe import NOTHING_USUAL, FrameObserver
from worker.calibration.paper.ground_objective import NARROW, GroundObjective
from worker.calibration.paper.search import ALONE_ON_THE_GROUND, ON_THE_GROUND, GroundLevel, search_on_ground
from worker.calibration.problem import PoseSolution, Problem
from worker.calibration.records import (
    NOT_RECORDED,
    Calibration,
    EngineResult,
    Options,
    Progress,
    ProgressReporter,
    Recorder,
    Segment,
)
from worker.calibration.refinement.refine import evaluate_poses
from worker.calibration.refinement.uncertainty import RefinedPoses
from worker.calibration.search.genome import genome_of
from worker.calibration.search.search import Found, Strategy
from worker.calibration.steps import assess_stored, joined_deviations, judge_each, of_use_at


@dataclass(frozen=True)
class Preset:
    """Levels of a search on the ground; `flat`: it takes the ground for a plane."""

    levels: Sequence[GroundLevel]
    flat: bool


PRESETS: Mapping[str, Preset] = {
    "paper": Preset(ON_THE_GROUND, flat=False),
    "scpr": Preset(ALONE_ON_THE_GROUND, flat=True),
}
"""`paper`: the paper's own objective. `scpr`: its predecessor, flat and without a stitch term."""


def calibrate_by_paper(
    preset: Preset,
    pitch: Field,
    cameras: Sequence[Camera],
    frames: Mapping[str, Sequence[Frame]],
    segment: Segment,
    options: Options,
    report: Callable[[Progress], None] = lambda _: None,
    stop: Callable[[], bool] = lambda: False,
    usual: Mapping[str, UsualView] = NOTHING_USUAL,
    memories: Mapping[str, CameraMemory] = NO_MEMORIES,
    taken_at: datetime | None = None,
    recorder: Recorder = NOT_RECORDED,
) -> Calibration:
    """Find the poses of all cameras by the paper's search, and judge each; arguments and errors as of `calibrate`."""
    flattened = pitch.ridge is not None and (options.flat or preset.flat)
    pitch = pitch.flat() if flattened else pitch
    progress = ProgressReporter(report, stop)

    # Observe.
    observer = FrameObserver.of(pitch, cameras, frames, segment)
    known = [memories.get(camera.id) for camera in cameras]
    problem = Problem(pitch, cameras, observer.observe(progress, usual), options, known, recorder=recorder)
    problem = observer.look_in_full(problem, range(len(cameras)), progress)
    recorder.observed(cameras, frames, problem.observed.views, problem.observed.observations.responses)

    # Search, and judge the poses as the search leaves them.
    solution = _solve(problem, preset.levels, progress)
    judged = judge_together(problem, solution.pitch, solution.results, progress)
    recorder.judged(judged.pitch, cameras, judged.cameras)

    # Diagnose, and remember.
    with progress.timed("quality"):
        loss = _loss_of(problem, judged)
    found = diagnose(problem, solution, judged, "wide", loss, frames, progress)
    return found if flattened else replace(found, memories=remember(judged, cameras, frames, memories, taken_at))


def _solve(problem: Problem, levels: Sequence[GroundLevel], progress: ProgressReporter) -> PoseSolution:
    """Search for the usable cameras; the others are assessed at their stored poses."""
    together = problem.usable
    group = problem.of(together)
    found, evaluated = Found([], np.inf, 0), RefinedPoses(problem.pitch, [], [], [])
    if together:
        found = _search(group, levels, progress)
        evaluated = _evaluate(group, found.cameras, progress)
    apart = {n: assess_stored(problem.of([n]), progress) for n in range(len(problem.cameras)) if n not in together}
    results = {n: attempt.result for n, attempt in apart.items()}
    results |= zip(together, judge_each(group, evaluated, progress), strict=True)
    begun = dict(enumerate(problem.cameras)) | dict(zip(together, found.cameras, strict=True))
    deviations = joined_deviations(evaluated, [attempt.refined for attempt in apart.values()])
    in_order = [results[n] for n in sorted(results)]
    return PoseSolution(problem.pitch, list(begun.values()), in_order, together, deviations, found.generations)


def _search(problem: Problem, levels: Sequence[GroundLevel], progress: ProgressReporter) -> Found:
    """Search from the stored poses by the network's responses as they are."""
    options = problem.options
    with progress.timed("evolution"):
        return search_on_ground(
            problem.pitch,
            problem.cameras,
            problem.observed.observations.responses,
            levels,
            Strategy(options.parents, options.offspring, options.generations),
            options.stitch_weight,
            np.random.default_rng(options.seed),
            progress.evolution(options.generations),
            lambda level, genomes, best: problem.recorder.searched(problem.cameras, level, genomes, best),
        )


def _evaluate(problem: Problem, found: Sequence[Camera], progress: ProgressReporter) -> RefinedPoses:
    """Measure the lines from poses that stay as they are, which says how sure they are."""
    with progress.timed("refinement"):
        progress.at("refinement", 0.0)
        observations = problem.observed.observations
        return evaluate_poses(problem.pitch, found, observations, stored=problem.cameras, memories=problem.memories)


def _loss_of(problem: Problem, judged: EngineResult) -> float:
    """Return the loss of the answered poses by the narrow blurs, each camera alone; inf if no frame can be used."""
    group = problem.usable
    if not group:
        return float("inf")
    cameras = [judged.cameras[n].camera for n in group]
    responses = of_use_at(cameras, problem.of(group).observed.observations.responses, judged.pitch)
    objective = GroundObjective(judged.pitch, cameras, responses, stitch_weight=0.0, blurs=NARROW)
    return float(objective.losses(genome_of(cameras)[None])[0])
