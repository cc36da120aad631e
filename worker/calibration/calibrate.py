"""The whole method on one page: frames and stored poses in, new poses and what they are worth out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from types import MappingProxyType

import numpy as np

from worker.calibration.finish.diagnosis import suspicions
from worker.calibration.finish.refinement import Sight
from worker.calibration.judge.pairs import (
    Pair,
    Seeing,
    compared,
    compared_before,
    contradictions,
    refusal_by_pairs,
    stitch_error_px,
)
from worker.calibration.judge.quality import CameraResult, Gate, believable, ridge_rejection
from worker.calibration.judge.registration import Response
from worker.calibration.judge.seam import seam_between
from worker.calibration.memory.camera_memory import AcceptedJob, CameraMemory, fingerprint_of_frames, fitting
from worker.calibration.nearby import found_nearby
from worker.calibration.records import Answer, Calibration, CalibrationError, Journey, Options, Path, Progress, Segment
from worker.calibration.scene.camera import Camera, Frame
from worker.calibration.scene.field import Field
from worker.calibration.scene.visibility import SeenLines
from worker.calibration.see.contrast import Channels
from worker.calibration.see.left_out import of_use
from worker.calibration.see.segmentation import reachable_regions
from worker.calibration.see.steady import Sway, median, sways
from worker.calibration.see.view import UsualView, ViewCondition, look_at
from worker.calibration.settle import (
    CAPTURE_RAD,
    METHODS,
    NOBODY,
    Seen,
    Settled,
    Situation,
    ridges_of,
    settle,
    settle_without,
)
from worker.calibration.stitch.evening import evened_out
from worker.calibration.zoom import refit_zoomed

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
) -> Calibration:
    """Find the poses of all cameras at once, and judge each.

    `cameras` carry their stored poses; `frames[camera.id]` are one or more BGR frames (height, width, 3) of the size of
    the intrinsics; `usual[camera.id]`: what the last accepted job saw there; `memories[camera.id]`: its earlier nights;
    `taken_at`: when the frames were taken. Deterministic for `options.seed`, whatever the number of the network's
    threads. Raises `CalibrationError` when a stored pose sees no markings, `Stopped` soon
    after `stop()` turns true.
    """
    method = METHODS[options.preset]
    # What is measured beside a field that is not the venue's is nothing to remember.
    flattened = pitch.ridge is not None and (options.flat or method.flat)
    pitch = pitch.flat() if flattened else pitch
    journey = Journey(report, stop)
    seen = look(pitch, cameras, frames, segment, journey, usual)
    here = Situation(method, pitch, cameras, seen, options, journey, [memories.get(camera.id) for camera in cameras])
    settled, answer, path = find(here)
    with journey.measuring("quality"):
        before = _compared_before(pitch, cameras, seen.sight, answer)
        loss = here.loss_of(answer.pitch, [one.camera for one in answer.cameras])
        journey.at("refinement", 1.0)
    with journey.measuring("light"):
        held = [one.camera for one in answer.cameras if one.accepted]
        evened = evened_out(answer.pitch, held, {camera.id: frames[camera.id][0] for camera in held})
    journey.spent.name("evolution")
    return Calibration(
        **vars(answer),
        stitch_error_before_px=stitch_error_px(before, Gate()),
        loss=loss,
        generations=settled.generations,
        suspicions=suspicions(believable(settled.deviations, answer.cameras, Gate())),
        path=path,
        lights=evened,
        memories={} if flattened else remember(answer, cameras, frames, memories, taken_at),
    )


def remember(
    answer: Answer,
    stored: Sequence[Camera],
    frames: Mapping[str, Sequence[Frame]],
    memories: Mapping[str, CameraMemory],
    taken_at: datetime | None,
) -> dict[str, CameraMemory]:
    """The memories of the cameras whose poses are accepted, with this job in them, which may be their first."""
    lines = answer.pitch.line_points()
    after = {}
    for before, result in zip(stored, answer.cameras, strict=True):
        if not result.accepted or result.measured is None:
            continue
        seen = fingerprint_of_frames(frames[before.id])
        job = AcceptedJob(
            result.camera, result.measured, lines, taken_at, result.painted_anew, seen, zoomed=result.lens_changed
        )
        (memory,) = fitting([memories.get(before.id)], lines)
        after[before.id] = CameraMemory.begun(before, job) if memory is None else memory.after(job)
    return after


def look(
    pitch: Field,
    cameras: Sequence[Camera],
    frames: Mapping[str, Sequence[Frame]],
    segment: Segment,
    journey: Journey,
    usual: Mapping[str, UsualView] = NOTHING_USUAL,
) -> Seen:
    """Look at the frames, and for markings in them. Raises `CalibrationError`."""
    require_markings_in_view(pitch, cameras)
    with journey.measuring("view"):
        views = [view_of(frames[camera.id], pitch, camera, usual.get(camera.id)) for camera in cameras]
        swayed = {camera.id: sways(frames[camera.id], camera.intrinsics) for camera in cameras}
    with journey.measuring("segmentation"):
        responses = segment_all(pitch, cameras, frames, swayed, segment, journey)
    return Seen(views, Sight([Channels(frames[camera.id], swayed[camera.id]) for camera in cameras], responses))


def find(here: Situation) -> tuple[Settled, Answer, Path]:
    """Where the cameras are and what they are worth together; searched for is only who is not near its stored pose."""
    near = found_nearby(replace(here, journey=here.journey.unreported())) if here.options.search == "auto" else None
    if near is not None and near.numbers == here.usable:
        settled = near.settled(here)
        answer = judge(settled.pitch, settled.results, here.seen.sight, here.journey)
        if all(answer.cameras[n].accepted for n in near.numbers):
            return settled, answer, "near"
        # They contradict each other, so one of them is not where it seems to be.
        near = None
    settled = settle(here, NOBODY if near is None else near.cameras)
    return *agree(here, refit_zoomed(here, settled)), "wide"


def agree(here: Situation, settled: Settled) -> tuple[Settled, Answer]:
    """Judge cameras together; whom the others contradict is not to have pulled at them."""
    while True:
        answer = judge(settled.pitch, settled.results, here.seen.sight, here.journey)
        out = [n for n in settled.together if not answer.cameras[n].accepted]
        if not here.method.tries_again or len(out) in (0, len(settled.together)):
            return settled, answer
        settled = settle_without(out, here, settled)


def judge(pitch: Field, results: Sequence[CameraResult], sight: Sight, journey: Journey) -> Answer:
    """What cameras that were judged by themselves are worth together, on the `pitch` that they were finished on."""
    gate = Gate()
    with journey.measuring("quality"):
        journey.at("refinement", 0.6)
        pairs = _compared(pitch, results, sight)
    against = contradictions(pairs, gate) if any(result.accepted for result in results) else []
    ridge = ridge_rejection(pitch, gate)
    reasons = [f"camera {one.camera.id}: {one.rejected_because}" for one in results if not one.accepted]
    reasons += [one.words(gate) for one in against]
    reasons += [ridge.words] if ridge else []
    judged = [
        replace(result, refusal=result.refusal or refusal_by_pairs(result.camera.id, against, gate) or ridge)
        for result in results
    ]
    held = {result.camera.id for result in judged if result.accepted}
    stitch = stitch_error_px([pair for pair in pairs if not held or held.issuperset(pair.cameras)], gate)
    by_id = {result.camera.id: result for result in judged}
    seams = [(pair, seam_between(pitch, by_id[pair.first], by_id[pair.second])) for pair in pairs]
    return Answer(pitch, judged, "; ".join(reasons) or None, stitch, journey.spent, pairs=seams)


def _comparable(results: Sequence[CameraResult]) -> list[int]:
    """The cameras whose views are compared: those that pass the gate, or where none does, all that see anything."""
    accepted = [n for n, result in enumerate(results) if result.accepted]
    return accepted or [n for n, result in enumerate(results) if result.view.usable]


def _compared(pitch: Field, results: Sequence[CameraResult], sight: Sight) -> list[Pair]:
    """By what the network sees, or by ridges where that does not bring together what should be."""
    chosen = _comparable(results)
    seeing = [Seeing(results[n].camera, sight.responses[n], results[n].evidence) for n in chosen]
    pairs = compared(pitch, seeing)
    nothing = all(pair.error_px is None for pair in pairs)
    if not pairs or not (nothing or any(pair.missed for pair in pairs)):
        return pairs
    ridges = [ridges_of(pitch, results[n].camera, sight.channels[n]) for n in chosen]
    by_ridges = compared(pitch, [replace(one, response=its) for one, its in zip(seeing, ridges, strict=True)])
    return [again if pair.error_px is None else pair for pair, again in zip(pairs, by_ridges, strict=True)]


def _compared_before(pitch: Field, cameras: Sequence[Camera], sight: Sight, answer: Answer) -> list[Pair]:
    """What pairs said by their stored poses: of poses that are accepted, seen from where those put the views."""
    stored = {
        one.id: Seeing(one, response, result.evidence_before)
        for one, response, result in zip(cameras, sight.responses, answer.cameras, strict=True)
    }
    if any(result.accepted for result in answer.cameras):
        found = {result.camera.id: result.camera for result in answer.cameras}
        return compared_before(pitch, stored, found, [pair for pair, _ in answer.pairs])
    return compared(pitch, [stored[cameras[n].id] for n in _comparable(answer.cameras)])


def require_markings_in_view(pitch: Field, cameras: Sequence[Camera]) -> None:
    """Raise for a stored pose from which no pitch can be seen: nothing that follows could find it."""
    lines = pitch.line_points()
    for camera in cameras:
        visible = len(SeenLines.from_camera(lines, camera))
        if visible < FEWEST_VISIBLE_POINTS:
            raise CalibrationError(
                camera.id,
                "no-markings-in-view",
                f"the stored pose of camera {camera.id} sees {visible * lines.spacing:.0f} m of markings, at least "
                f"{FEWEST_VISIBLE_POINTS * lines.spacing:.0f} m are needed; store a first pose that looks at the pitch",
            )


def segment_all(
    pitch: Field,
    cameras: Sequence[Camera],
    frames: Mapping[str, Sequence[Frame]],
    swayed: Mapping[str, Sequence[Sway]],
    segment: Segment,
    journey: Journey,
) -> list[Response]:
    """The fused segmentation (H, W) of each camera, where its markings can be; `swayed`: how its frames lie."""
    total = sum(len(frames[camera.id]) for camera in cameras)
    done = 0
    responses = []
    for camera in cameras:
        regions = reachable_regions(pitch, camera, CAPTURE_RAD * camera.intrinsics.focal_length_px)
        seen = []
        for frame in frames[camera.id]:
            journey.at("segmentation", done / total)
            seen.append(segment(frame, regions))
            done += 1
        responses.append(of_use(camera, median(seen, swayed[camera.id]) / np.float32(255)))
    return responses


def view_of(frames: Sequence[Frame], pitch: Field, camera: Camera, usual: UsualView | None) -> ViewCondition:
    """The view of the first frame that can be used, or what is wrong with the first."""
    first = look_at(frames[0], pitch, camera, usual)
    later = (look_at(frame, pitch, camera, usual) for frame in frames[1:])
    return first if first.usable else next((view for view in later if view.usable), first)
