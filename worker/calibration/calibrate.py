"""The engine on one page: frames and stored poses in; new poses, verdicts and diagnostics out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from types import MappingProxyType

import numpy as np

from worker.calibration.detection.contrast import Channels
from worker.calibration.detection.exclusions import of_use
from worker.calibration.detection.frame_fusion import Sway, median, sways
from worker.calibration.detection.segmentation import reachable_regions
from worker.calibration.detection.view_condition import UsualView, ViewCondition, look_at
from worker.calibration.diagnostics.registration import Response
from worker.calibration.diagnostics.seam import measure_seam
from worker.calibration.gate.pairs import (
    CameraResponse,
    Pair,
    compare_pairs,
    compare_pairs_before,
    find_contradictions,
    refusal_by_pairs,
    stitch_error_px,
)
from worker.calibration.gate.quality import CameraResult, Gate, credible_deviations, in_one_sentence, ridge_rejection
from worker.calibration.geometry.camera import Camera, Frame
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.visibility import VisibleLines
from worker.calibration.memory.camera_memory import AcceptedJob, CameraMemory, fingerprint_of_frames, memories_of_field
from worker.calibration.near_path import refine_near_stored, with_unusable_cameras
from worker.calibration.records import (
    NOT_RECORDED,
    Calibration,
    CalibrationError,
    EngineResult,
    Options,
    Path,
    Progress,
    ProgressReporter,
    Recorder,
    Segment,
)
from worker.calibration.recovery import recover_knocked
from worker.calibration.refinement.diagnosis import find_suspicions
from worker.calibration.refinement.refine import Observations
from worker.calibration.solve import (
    CAPTURE_RAD,
    NO_CAMERAS,
    ObservedCameras,
    PoseSolution,
    Problem,
    loss_of,
    refine_without,
    ridges_of,
    search_and_refine,
)
from worker.calibration.stitching.photometric_alignment import evened_out
from worker.calibration.swapped_cameras import mark_swapped_frames
from worker.calibration.zoom_refit import refit_zoomed

FEWEST_VISIBLE_POINTS = 60
"""Line points (25 cm apart) a stored pose has to see; less cannot fix a pose."""
NOTHING_USUAL: Mapping[str, UsualView] = MappingProxyType({})
NO_MEMORIES: Mapping[str, CameraMemory] = MappingProxyType({})


def calibrate(
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
    """Find the poses of all cameras at once, and judge each.

    `cameras` carry their stored poses; `frames[camera.id]` are one or more BGR frames (height, width, 3) of the size of
    the intrinsics; `usual[camera.id]`: what the last accepted job saw there; `memories[camera.id]`: its earlier nights;
    `taken_at`: when the frames were taken; `recorder` receives what the stages saw, and changes nothing. Deterministic
    for `options.seed`, whatever the number of the network's threads. Raises `CalibrationError` when no stored pose sees
    markings, `Stopped` soon after `stop()` turns true.
    """
    # What is measured beside a field that is not the venue's is nothing to remember.
    flattened = pitch.ridge is not None and options.flat
    pitch = pitch.flat() if flattened else pitch
    progress = ProgressReporter(report, stop)

    # Observe.
    observed = observe(pitch, cameras, frames, segment, progress, usual)
    known = [memories.get(camera.id) for camera in cameras]
    problem = Problem(pitch, cameras, observed, options, known, recorder=recorder)
    problem = replace(problem, observed=mark_swapped_frames(problem, frames, progress))
    recorder.observed(cameras, frames, problem.observed.views, problem.observed.observations.responses)

    # Solve and judge: by the near path if all usable cameras pass there, else by search and refinement.
    solution, judged, path = _solve(problem, progress)

    # Recover: search anywhere for cameras that do not stand where they stood.
    problem, (solution, judged, path) = recover_knocked(
        problem, (solution, judged, path), frames, segment, _solve, progress
    )
    recorder.judged(judged.pitch, cameras, judged.cameras)

    # Diagnose, and remember.
    with progress.timed("quality"):
        loss = loss_of(problem, judged.pitch, [result.camera for result in judged.cameras])
    found = diagnose(problem, solution, judged, path, loss, frames, progress)
    return found if flattened else replace(found, memories=remember(judged, cameras, frames, memories, taken_at))


def _solve(problem: Problem, progress: ProgressReporter) -> tuple[PoseSolution, EngineResult, Path]:
    """Solve for the poses and judge them. Only cameras that are not near their stored poses are searched for."""
    near = None
    if problem.options.search == "auto":
        near = refine_near_stored(problem, progress.muted())
    if near is not None and near.numbers == problem.usable:
        solution = with_unusable_cameras(near, problem, progress)
        judged = judge_together(solution.pitch, solution.results, problem.observed.observations, progress)
        if all(judged.cameras[n].accepted for n in near.numbers):
            return solution, judged, "near"
        # They contradict each other, so one of them is not where it seems to be.
        near = None

    solution = search_and_refine(problem, progress, NO_CAMERAS if near is None else near.cameras)
    solution = refit_zoomed(problem, solution, progress)
    while True:
        judged = judge_together(solution.pitch, solution.results, problem.observed.observations, progress)
        contradicted = [n for n in solution.together if not judged.cameras[n].accepted]
        if len(contradicted) in (0, len(solution.together)):
            return solution, judged, "wide"
        # A camera that the others contradict must not have pulled at them.
        solution = refine_without(contradicted, problem, solution, progress)


def observe(
    pitch: Field,
    cameras: Sequence[Camera],
    frames: Mapping[str, Sequence[Frame]],
    segment: Segment,
    progress: ProgressReporter,
    usual: Mapping[str, UsualView] = NOTHING_USUAL,
) -> ObservedCameras:
    """Measure the view conditions of the frames, and segment the markings in them. Raises `CalibrationError`."""
    blind = cameras_without_markings(pitch, cameras)
    with progress.timed("view"):
        views = [
            replace(view, usable=False, cause="no-markings-in-view", where=None, words=blind[camera.id])
            if camera.id in blind
            else view
            for camera in cameras
            for view in [view_of(frames[camera.id], pitch, camera, usual.get(camera.id))]
        ]
        swayed = {camera.id: sways(frames[camera.id], camera.intrinsics) for camera in cameras}
    with progress.timed("segmentation"):
        responses = segment_all(pitch, cameras, frames, swayed, segment, progress)
    return ObservedCameras(
        views, Observations([Channels(frames[camera.id], swayed[camera.id]) for camera in cameras], responses)
    )


def judge_together(
    pitch: Field, results: Sequence[CameraResult], observations: Observations, progress: ProgressReporter
) -> EngineResult:
    """Judge against each other cameras that were judged by themselves, on the `pitch` they were refined with."""
    gate = Gate()
    with progress.timed("quality"):
        progress.at("refinement", 0.6)
        pairs = _compared(pitch, results, observations)
    against = find_contradictions(pairs, gate) if any(result.accepted for result in results) else []
    ridge = ridge_rejection(pitch, gate)
    reasons = [f"camera {one.camera.id}: {one.rejected_because}" for one in results if one.rejected_because]
    reasons += [one.words(gate) for one in against]
    reasons += [ridge.words] if ridge else []
    judged = [
        replace(result, refusal=result.refusal or refusal_by_pairs(result.camera.id, against, gate) or ridge)
        for result in results
    ]
    accepted = {result.camera.id for result in judged if result.accepted}
    stitch = stitch_error_px([pair for pair in pairs if not accepted or accepted.issuperset(pair.cameras)], gate)
    by_id = {result.camera.id: result for result in judged}
    seams = [(pair, measure_seam(pitch, by_id[pair.first], by_id[pair.second])) for pair in pairs]
    return EngineResult(pitch, judged, in_one_sentence(reasons) or None, stitch, progress.timings, pairs=seams)


def _comparable(results: Sequence[CameraResult]) -> list[int]:
    """The cameras whose views are compared: those that pass the gate, or where none does, all that see anything."""
    accepted = [n for n, result in enumerate(results) if result.accepted]
    return accepted or [n for n, result in enumerate(results) if result.view.usable]


def _compared(pitch: Field, results: Sequence[CameraResult], observations: Observations) -> list[Pair]:
    """Compare pairs of cameras by the network's responses, or by ridges if these do not register what should be."""
    chosen = _comparable(results)
    seeing = [CameraResponse(results[n].camera, observations.responses[n], results[n].evidence) for n in chosen]
    pairs = compare_pairs(pitch, seeing)
    nothing = all(pair.error_px is None for pair in pairs)
    if not pairs or not (nothing or any(pair.missed for pair in pairs)):
        return pairs
    ridges = [ridges_of(pitch, results[n].camera, observations.channels[n]) for n in chosen]
    by_ridges = compare_pairs(pitch, [replace(one, response=its) for one, its in zip(seeing, ridges, strict=True)])
    return [again if pair.error_px is None else pair for pair, again in zip(pairs, by_ridges, strict=True)]


def _compared_before(problem: Problem, judged: EngineResult) -> list[Pair]:
    """Compare pairs by their stored poses: of accepted poses, as seen from where those put the views."""
    cameras, responses = problem.cameras, problem.observed.observations.responses
    stored = {
        camera.id: CameraResponse(camera, response, result.evidence_before)
        for camera, response, result in zip(cameras, responses, judged.cameras, strict=True)
    }
    if any(result.accepted for result in judged.cameras):
        found = {result.camera.id: result.camera for result in judged.cameras}
        return compare_pairs_before(problem.pitch, stored, found, [pair for pair, _ in judged.pairs])
    return compare_pairs(problem.pitch, [stored[cameras[n].id] for n in _comparable(judged.cameras)])


def diagnose(
    problem: Problem,
    solution: PoseSolution,
    judged: EngineResult,
    path: Path,
    loss: float,
    frames: Mapping[str, Sequence[Frame]],
    progress: ProgressReporter,
) -> Calibration:
    """Report on judged cameras: the stitch error before, what contradicts lens or field, what evens out their light."""
    with progress.timed("quality"):
        stitch_error_before_px = stitch_error_px(_compared_before(problem, judged), Gate())
        doubts = find_suspicions(credible_deviations(solution.deviations, judged.cameras, Gate()))
        progress.at("refinement", 1.0)
    with progress.timed("light"):
        accepted = [result.camera for result in judged.cameras if result.accepted]
        lights = evened_out(judged.pitch, accepted, {camera.id: frames[camera.id][0] for camera in accepted})
    progress.timings.ensure("evolution")
    return Calibration(
        pitch=judged.pitch,
        cameras=judged.cameras,
        rejected_because=judged.rejected_because,
        stitch_error_px=judged.stitch_error_px,
        timings=judged.timings,
        pairs=judged.pairs,
        stitch_error_before_px=stitch_error_before_px,
        loss=loss,
        generations=solution.generations,
        suspicions=doubts,
        path=path,
        lights=lights,
        memories={},
    )


def cameras_without_markings(pitch: Field, cameras: Sequence[Camera]) -> dict[str, str]:
    """Return what to say of each camera whose stored pose sees no pitch: nothing that follows could find it.

    Raises `CalibrationError` where that is so of all of them.
    """
    lines = pitch.line_points()
    blind = {}
    for camera in cameras:
        visible = len(VisibleLines.from_camera(lines, camera))
        if visible < FEWEST_VISIBLE_POINTS:
            blind[camera.id] = (
                f"the stored pose of camera {camera.id} sees {visible * lines.spacing:.0f} m of markings, at least "
                f"{FEWEST_VISIBLE_POINTS * lines.spacing:.0f} m are needed; store a first pose that looks at the pitch"
            )
    if len(blind) == len(cameras):
        raise CalibrationError(next(iter(blind)), "no-markings-in-view", in_one_sentence(list(blind.values())))
    return blind


def segment_all(
    pitch: Field,
    cameras: Sequence[Camera],
    frames: Mapping[str, Sequence[Frame]],
    swayed: Mapping[str, Sequence[Sway]],
    segment: Segment,
    progress: ProgressReporter,
) -> list[Response]:
    """Return the fused segmentation (H, W) of each camera, where markings can be; `swayed`: shifts of its frames."""
    total = sum(len(frames[camera.id]) for camera in cameras)
    done = 0
    responses = []
    for camera in cameras:
        regions = reachable_regions(pitch, camera, CAPTURE_RAD * camera.intrinsics.focal_length_px)
        seen = []
        for frame in frames[camera.id]:
            progress.at("segmentation", done / total)
            seen.append(segment(frame, regions))
            done += 1
        responses.append(of_use(camera.ignored, median(seen, swayed[camera.id]) / np.float32(255)))
    return responses


def view_of(frames: Sequence[Frame], pitch: Field, camera: Camera, usual: UsualView | None) -> ViewCondition:
    """Return the view condition of the first usable frame, or that of the first frame if none is."""
    first = look_at(frames[0], pitch, camera, usual)
    later = (look_at(frame, pitch, camera, usual) for frame in frames[1:])
    return first if first.usable else next((view for view in later if view.usable), first)


def remember(
    judged: EngineResult,
    stored: Sequence[Camera],
    frames: Mapping[str, Sequence[Frame]],
    memories: Mapping[str, CameraMemory],
    taken_at: datetime | None,
) -> dict[str, CameraMemory]:
    """Return the memories of the cameras whose poses are accepted, with this job in them, which may be their first.

    That of a camera that was knocked begins anew, where it was found.
    """
    lines = judged.pitch.line_points()
    after = {}
    for before, result in zip(stored, judged.cameras, strict=True):
        if not result.accepted or result.measured is None:
            continue
        seen = fingerprint_of_frames(frames[before.id])
        job = AcceptedJob(
            result.camera, result.measured, lines, taken_at, result.repainted_markings, seen, zoomed=result.lens_changed
        )
        (memory,) = memories_of_field([None if result.knocked else memories.get(before.id)], lines)
        begun = result.camera if result.knocked else before
        after[before.id] = CameraMemory.from_first_job(begun, job) if memory is None else memory.after(job)
    return after
