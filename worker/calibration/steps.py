"""Steps of a calibration: search, joint refinement, judgement of each camera."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial

import cv2
import numpy as np

from worker.calibration.detection.contrast import Channels
from worker.calibration.detection.evidence import Evidence, evidence_of
from worker.calibration.detection.exclusions import left_out, of_use
from worker.calibration.detection.ridge_response import ridge_response
from worker.calibration.diagnostics.markings import report_markings
from worker.calibration.diagnostics.overlap import overlap_of
from worker.calibration.diagnostics.registration import Response
from worker.calibration.gate.quality import MUCH_UNEXPECTED, CameraResult, Moved, alone_rejection
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.parameters import Parameter, free_focal_lengths, free_ridge
from worker.calibration.geometry.visibility import VisibleLines
from worker.calibration.problem import PoseSolution, Problem
from worker.calibration.records import ProgressReporter
from worker.calibration.refinement.diagnosis import is_sure
from worker.calibration.refinement.refine import (
    CLEARLY_MORE,
    SEARCH_PX,
    LineReader,
    Observations,
    evaluate_poses,
    measured_shares,
    refine,
)
from worker.calibration.refinement.uncertainty import Deviation, RefinedPose, RefinedPoses
from worker.calibration.search.genome import genome_of
from worker.calibration.search.objective import Objective
from worker.calibration.search.search import COARSE_TO_FINE, Found, Strategy, search

CAPTURE_RAD = 0.1
"""Largest angle between a line and its place by the stored pose: 4 degrees of rotation and 0.3 m at 15 m."""
LEAST_CAUGHT = 0.6
"""Share of the expected lines that has to be caught in the frame for lines alone to suffice."""
MOST_CAUGHT, MOST_AGAIN = 0.9, 3
"""Agreement with the lines below which a refinement is begun again from where it ended, and how often it may."""
HARDLY_MOVED_PX = 12.0
"""Largest mean motion of the visible lines, in pixels of a 4K frame, of a camera that stands almost where it is stored:
within what the refinement catches."""
SEARCHED_POWER = 3
"""Power of the network's responses in the search: what it half believes (a shadow's edge, a board) hardly pulls."""


def with_unusable_cameras(
    problem: Problem,
    begun: Sequence[Camera],
    refined: RefinedPoses,
    results: Sequence[CameraResult],
    generations: int,
    progress: ProgressReporter,
) -> PoseSolution:
    """Return the solution when all usable cameras were refined from where they `begun`; the others are assessed at
    their stored poses. `results`: those of the usable ones."""
    together = problem.usable
    by_number = dict(zip(together, results, strict=True))
    in_order = [
        by_number[n] if n in by_number else assess_stored(problem.of([n]), progress).result
        for n in range(len(problem.cameras))
    ]
    return PoseSolution(refined.pitch, list(begun), in_order, together, refined.deviations, generations)


def joined_deviations(together: RefinedPoses, apart: Sequence[RefinedPoses]) -> list[Deviation]:
    """Return deviations of lenses and field: of a camera that stands apart its own, the others of those `together`."""
    of_lenses = [deviation for one in apart for deviation in one.deviations if deviation.camera is not None]
    apart_ids = {deviation.camera for deviation in of_lenses}
    return [deviation for deviation in together.deviations if deviation.camera not in apart_ids] + of_lenses


@dataclass(frozen=True)
class Attempt:
    """A camera that was refined by itself, from the pose `begun`."""

    begun: Camera
    refined: RefinedPoses
    result: CameraResult

    @property
    def agreement(self) -> float:
        """Agreement 0..1 of the frame with the expected lines at the refined pose (see `Evidence`)."""
        return self.result.evidence.agreement


def single_camera_problem(problem: Problem, number: int) -> Problem:
    """Return the problem of one camera, which does not solve for the ridge unless it is the only camera."""
    ridge = problem.options.fit_ridge and len(problem.cameras) == 1
    return replace(problem.of([number]), options=replace(problem.options, fit_ridge=ridge))


def best_attempt(problem: Problem, first: Attempt, progress: ProgressReporter) -> Attempt:
    """Return the `first` attempt at a single camera; while that fails the gate, the best of those from other poses."""
    best = first
    for start in _other_starts(problem, progress, lost=not best.result.is_explained):
        if best.result.accepted:
            break
        best = max(best, attempt(problem, start, progress), key=lambda one: one.agreement)
    return best


def _other_starts(problem: Problem, progress: ProgressReporter, *, lost: bool) -> Iterator[Camera]:
    """Yield the pose that a search by ridges finds, if the camera is `lost`, and its stored pose."""
    if lost:
        yield search_poses(problem, ridge_responses(problem), progress).cameras[0]
    yield problem.cameras[0]


def attempt(problem: Problem, begun: Camera, progress: ProgressReporter) -> Attempt:
    """Refine a single camera from where a search found it (`begun`), and judge it."""
    refined = refine_poses(problem, [begun], problem.observed.observations, progress)
    return Attempt(begun, refined, judge_each(problem, refined, progress)[0])


def assess_stored(problem: Problem, progress: ProgressReporter) -> Attempt:
    """Assess a single camera whose frame cannot be used at its stored pose."""
    with progress.timed("refinement"):
        assessed = evaluate_poses(
            problem.pitch,
            problem.cameras,
            problem.observed.observations,
            free_parameters(problem),
            memories=problem.memories,
        )
    return Attempt(problem.cameras[0], assessed, judge_each(problem, assessed, progress)[0])


def search_poses(problem: Problem, responses: Sequence[Response], progress: ProgressReporter) -> Found:
    """Search from the stored poses by the `responses` (h, w) to the frames of the cameras or to reduced ones."""
    options = problem.options
    reduced = [camera.resized(seen.shape[1]) for camera, seen in zip(problem.cameras, responses, strict=True)]
    with progress.timed("evolution"):
        found = search(
            problem.pitch,
            reduced,
            responses,
            Strategy(options.parents, options.offspring, options.generations),
            np.random.default_rng(options.seed),
            progress.evolution(options.generations),
            lambda level, genomes, best: problem.recorder.searched(problem.cameras, level, genomes, best),
        )
    in_full = [camera.with_pose(one.pose) for camera, one in zip(problem.cameras, found.cameras, strict=True)]
    return replace(found, cameras=in_full)


def network_responses(problem: Problem) -> list[Response]:
    """Return the network's responses (h, w) in 0..1 as the search uses them, raised to `SEARCHED_POWER`."""
    return raised([problem.observed.seen_by_network(n) for n in range(len(problem.cameras))])


def raised(responses: Sequence[Response]) -> list[Response]:
    """Return responses (H, W) raised to `SEARCHED_POWER`."""
    return [np.asarray(cv2.pow(response, SEARCHED_POWER), dtype=np.float32) for response in responses]


def ridge_responses(problem: Problem) -> list[Response]:
    """Return the ridge responses (H, W) that the search uses where those of the network lead nowhere."""
    channels = problem.observed.observations.channels
    return [ridges_of(problem.pitch, camera, of) for camera, of in zip(problem.cameras, channels, strict=True)]


def ridges_of(pitch: Field, camera: Camera, channels: Channels) -> Response:
    """Return the ridge response (H, W) of a frame wherever the network would look for markings."""
    lines = VisibleLines.from_camera(pitch.line_points(), camera)
    return of_use(camera.ignored, ridge_response(channels, lines, CAPTURE_RAD * camera.intrinsics.focal_length_px))


def refine_and_judge(
    problem: Problem, begun: Sequence[Camera], progress: ProgressReporter
) -> tuple[RefinedPoses, list[CameraResult]]:
    """Refine the cameras jointly from where they were found (`begun`), and judge each by itself.

    By lines alone, as the near path does: so that both end in one place. Where a camera does not pass so, with what the
    network has seen of them.
    """
    by_lines = Observations.of_lines_alone(problem.observed.observations.channels)
    refined = refine_poses(problem, begun, by_lines, progress)
    results = judge_each(problem, refined, progress)
    if all(result.accepted for result in results):
        return refined, results
    refined = refine_poses(problem, begun, problem.observed.observations, progress)
    return refined, judge_each(problem, refined, progress)


def refine_poses(
    problem: Problem, begun: Sequence[Camera], observations: Observations, progress: ProgressReporter
) -> RefinedPoses:
    """Refine the cameras jointly onto the lines of these `observations`, from where they were found (`begun`).

    Where one of them ends with most of its lines and not all, again from there while more are found: lines beside which
    the search for them has narrowed are found from where the others led.
    """
    with progress.timed("refinement"):
        progress.at("refinement", 0.0)
        free = free_parameters(problem)
        refined = _refined_from(problem, begun, observations, free)
        # What is solved for beside the poses would be as open once more as it was at first.
        if free:
            return refined
        for _ in range(MOST_AGAIN):
            if not 0.5 < _weakest_agreement(refined) < MOST_CAUGHT:
                break
            again = _refined_from(problem, refined.cameras, observations, free)
            if _weakest_agreement(again) < _weakest_agreement(refined) + CLEARLY_MORE:
                break
            refined = again
        return refined


def _refined_from(
    problem: Problem, begun: Sequence[Camera], observations: Observations, free: Sequence[Parameter]
) -> RefinedPoses:
    weight, memories = problem.options.stitch_weight, problem.memories
    return refine(problem.pitch, begun, observations, weight, free, stored=problem.cameras, memories=memories)


def _weakest_agreement(refined: RefinedPoses) -> float:
    return min(one.evidence.agreement for one in refined.each)


def refine_without(
    excluded: Collection[int], problem: Problem, solution: PoseSolution, progress: ProgressReporter
) -> PoseSolution:
    """Refine the other cameras without those `excluded` ones that were refined with them; these stay as they are."""
    together = [n for n in solution.together if n not in excluded]
    if len(together) in (0, len(solution.together)):
        return replace(solution, together=together)
    group = problem.of(together)
    refined, judged = refine_and_judge(group, [solution.begun[n] for n in together], progress)
    results = dict(enumerate(solution.results)) | dict(zip(together, judged, strict=True))
    ids = {problem.cameras[n].id for n in together}
    of_others = [d for d in solution.deviations if d.camera is not None and d.camera not in ids]
    return replace(
        solution,
        pitch=refined.pitch,
        results=list(results.values()),
        together=together,
        deviations=refined.deviations + of_others,
    )


def has_hardly_moved(result: CameraResult) -> bool:
    """True if a camera stands almost where it is stored."""
    return result.moved.pixels <= HARDLY_MOVED_PX * result.camera.intrinsics.relative_size


def free_parameters(problem: Problem) -> list[Parameter]:
    """Return the numbers of lenses and field that the options ask to solve for along with the poses."""
    lengths = free_focal_lengths(problem.cameras) if problem.options.fit_focal_length else []
    return [*lengths, *(free_ridge(problem.pitch) if problem.options.fit_ridge else [])]


def judge_each(problem: Problem, refined: RefinedPoses, progress: ProgressReporter) -> list[CameraResult]:
    """Judge each refined camera by itself beside its stored pose, on the pitch that it was refined with."""
    with progress.timed("quality"):
        return [_judge(problem, number, refined.pitch, after) for number, after in enumerate(refined.each)]


def _judge(problem: Problem, number: int, pitch: Field, after: RefinedPose) -> CameraResult:
    stored, memory = problem.cameras[number], problem.memories[number]
    channels, response = problem.observed.seen(number)
    seen = problem.observed.seen_by_network(number)
    result = CameraResult(
        **vars(after),
        view=problem.observed.views[number],
        overlap=overlap_of(pitch, after.camera.resized(seen.shape[1]), seen),
        evidence_before=cache(partial(evidence_at, problem, number, stored)),
        moved=Moved.between(problem.pitch, stored, after.camera),
        markings=report_markings(pitch, after, channels, response),
        moved_in_all=None if memory is None else Moved.between(problem.pitch, memory.origin, after.camera),
        was_found=stored.id in problem.options.found,
    )
    return replace(result, refusal=alone_rejection(result))


def shows_most_lines(pitch: Field, cameras: Sequence[Camera], reader: LineReader) -> list[bool]:
    """Say of each camera whether its frame shows most of the lines near to where the camera expects them."""
    lines = pitch.line_points()
    measured = reader.measure(lines, cameras, SEARCH_PX[0])
    return [share >= LEAST_CAUGHT for share in measured_shares(lines, cameras, measured)]


def is_confirmed(problem: Problem, number: int, result: CameraResult) -> bool:
    """True unless most of the lines that the network sees on the pitch lie where the camera expects none.

    Asked of overviews; where the network has looked in full, evidence and gate have.
    """
    return number in problem.observed.in_full or result.overlap.unexpected < MUCH_UNEXPECTED


def follows_zoom(problem: Problem, result: CameraResult) -> bool:
    """True if a lens that may drift has surely done so."""
    return problem.options.lens_may_drift and result.zoom is not None and is_sure(result.zoom)


def evidence_at(problem: Problem, number: int, camera: Camera) -> Evidence:
    """Return how much of the field's lines the frames of a camera show where it stands as `camera` does."""
    pitch = problem.pitch
    return evidence_of(pitch.line_points(), camera, *problem.observed.seen(number), left_out(pitch, camera))


def loss_of(problem: Problem, pitch: Field, answered: Sequence[Camera]) -> float:
    """Return the loss of the search's middle level at the answered poses, inf if no frame can be used.

    A finer level looks at larger pictures, which takes a third of a second to say hardly more.
    """
    group = problem.usable
    if not group:
        return float("inf")
    seen = [problem.observed.seen_by_network(n) for n in group]
    cameras = [answered[n].resized(response.shape[1]) for n, response in zip(group, seen, strict=True)]
    responses = of_use_at(cameras, raised(seen), pitch)
    blur_px = COARSE_TO_FINE[1].blur_px
    losses = [
        Objective.build(pitch, camera, response, blur_px).losses(genome_of([camera])[None])[0]
        for camera, response in zip(cameras, responses, strict=True)
    ]
    return float(np.mean(losses))


def of_use_at(cameras: Sequence[Camera], responses: Sequence[Response], pitch: Field) -> list[Response]:
    """Return the responses (H, W) with 0 where nothing is looked at from the poses of the cameras."""
    areas = [left_out(pitch, camera) for camera in cameras]
    return [
        response if out is None else np.where(out, np.float32(0), response)
        for response, out in zip(responses, areas, strict=True)
    ]
