"""One job, in a process of its own: load, compute what its kind asks for, draw, hand back.

`python -m worker.jobs.job JOB_ID RUN_TOKEN` prints a line of JSON for each step of progress and one for the end, a
`worker.message.Message` each. It writes no row: its parent does.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import version

import cv2
import structlog

from service import lifeline
from service.observe import logs
from service.settings import Settings
from service.store.blobs import AWAY, Blobs
from service.store.engine import connect
from service.store.jobs import Jobs, Task, picture_file, picture_folder
from service.wire.job import Progress
from service.wire.options import FieldOptions, IntrinsicsOptions, LocateOptions, Options
from service.wire.problems import first_line
from service.wire.results import AnyResult, Provenance, Result, Suspicion
from service.wire.venue import Venue
from worker.calibration import calibrate as engine
from worker.calibration.calibrate import CalibrationError, calibrate
from worker.calibration.judge.quality import Gate
from worker.jobs import field, intrinsics, locate
from worker.jobs.pictures import Remembering, draw
from worker.jobs.wire import (
    PREVIEW_FRACTION,
    Failure,
    Outcome,
    camera_of,
    decoded_frame,
    number,
    pitch_of,
    segmenter_of,
    wire_camera,
    wire_lens,
    wire_progress,
)
from worker.message import Message

BEHIND_THE_OTHERS = 10
"""Niceness: answers of the API and heartbeats of the worker on the same machine go before the computation."""


def main(job_id: str, run_token: str) -> None:
    """Compute the job that the parent has begun."""
    lifeline.end_with_parent()
    os.nice(BEHIND_THE_OTHERS)
    say = _line_to_parent()
    settings = Settings()
    logs.configure(settings)
    structlog.contextvars.bind_contextvars(job=job_id)
    task = Jobs(connect(settings.home_database_url)).task(job_id, run_token)
    if task is None:
        return
    structlog.contextvars.bind_contextvars(**task.origin.names())
    blobs = Blobs(settings.home_blob_url)
    try:
        outcome = _compute(task, _load(task, blobs), settings, lambda progress: say(Message(progress=progress)))
        _store(task, blobs, outcome.pictures)
    except Failure as failure:
        say(Message(error=failure.error))
        return
    say(Message(result=outcome.result, pictures=list(outcome.pictures)))


def _compute(
    task: Task, files: Mapping[str, Sequence[bytes]], settings: Settings, report: Callable[[Progress], None]
) -> Outcome[AnyResult]:
    """What the kind of the job asks for."""
    cv2.setNumThreads(settings.threads)
    match task.options:
        case IntrinsicsOptions() as options:
            return intrinsics.solve({name: photo for name, (photo,) in files.items()}, options, report)
        case LocateOptions() as options:
            assert task.venue is not None
            ((camera, frames),) = files.items()
            return locate.solve(task.venue, camera, options, next(iter(frames), None), report)
        case FieldOptions() as options:
            assert task.venue is not None
            return field.solve(task.venue, files, options, settings, report)
        case options:
            assert task.venue is not None
            return solve(task.venue, files, options, settings, report)


def solve(
    venue: Venue,
    files: Mapping[str, Sequence[bytes]],
    options: Options,
    settings: Settings,
    report: Callable[[Progress], None],
) -> Outcome[Result]:
    """Calibrate a venue from the files of its cameras, with or without a server around it."""
    segmenter = segmenter_of(settings)
    cv2.setNumThreads(settings.threads)
    begun = time.perf_counter()
    frames = {c.id: [decoded_frame(c.id, c.image_size, file) for file in files[c.id]] for c in venue.cameras}
    decoded = time.perf_counter()
    pitch, cameras = pitch_of(venue.field), [camera_of(camera) for camera in venue.cameras]
    network = Remembering(segmenter, frames)
    try:
        found = calibrate(
            pitch, cameras, frames, network, _engine_options(options), lambda step: report(wire_progress(step))
        )
    except CalibrationError as error:
        raise Failure(error.kind, error.detail, error.camera) from error
    report(Progress(stage="preview", fraction=PREVIEW_FRACTION))
    drawing = time.perf_counter()
    pictures = draw(pitch, cameras, found, frames, network.responses)
    timings = {
        "decode": decoded - begun,
        **found.timings_s,
        "preview": time.perf_counter() - drawing,
    }
    provenance = Provenance(
        software=version("esc-calibration"),
        model_sha256=segmenter.sha256,
        seed=options.seed or 0,
        # Who is told changes no number, and the address may be a secret.
        options=options.model_dump(mode="json", exclude={"callback_url"}),
    )
    return Outcome(_result(found, options, timings, provenance), pictures)


def _line_to_parent() -> Callable[[Message], None]:
    """Keep standard output for messages; whatever native code prints goes to the log."""
    messages = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)

    def say(message: Message) -> None:
        print(message.line(), file=messages, flush=True)

    return say


def _load(task: Task, blobs: Blobs) -> dict[str, list[bytes]]:
    files: dict[str, list[bytes]] = {}
    for camera, paths in task.frames.items():
        files[camera] = []
        for path in paths:
            try:
                data = blobs.get(path)
            except AWAY as error:
                raise Failure("job-crashed", f"A stored frame cannot be read: {first_line(error)}", camera) from error
            if data is None:
                raise Failure("job-crashed", f"The stored frame {path} is gone.", camera)
            files[camera].append(data)
    return files


def _store(task: Task, blobs: Blobs, pictures: Mapping[str, bytes]) -> None:
    for name, picture in pictures.items():
        try:
            blobs.put(f"{picture_folder(task.job_id, task.run_token)}/{picture_file(name)}", picture)
        except AWAY as error:
            raise Failure("job-crashed", f"Its pictures cannot be stored: {first_line(error)}") from error


def _engine_options(options: Options) -> engine.Options:
    given = options.model_dump(
        include={
            "preset",
            "seed",
            "generations",
            "parents",
            "offspring",
            "stitch_weight",
            "flat",
            "fit_focal_length",
            "fit_ridge",
        },
        exclude_none=True,
    )
    return engine.Options(**given)


def _result(
    found: engine.Calibration, options: Options, timings_s: Mapping[str, float], provenance: Provenance
) -> Result:
    ridge = found.pitch.ridge
    return Result(
        accepted=found.accepted,
        rejected_because=found.rejected_because,
        cameras=[
            wire_camera(camera, wire_lens(camera.intrinsics) if options.fit_focal_length else None)
            for camera in found.cameras
        ],
        ridge=ridge.tolist() if options.fit_ridge and ridge is not None else None,
        diagnosis=[Suspicion(**vars(suspicion)) for suspicion in found.suspicions],
        stitch_error_px=number(found.stitch_error_px),
        stitch_error_before_px=number(found.stitch_error_before_px),
        stitch_error_limit_px=Gate().largest_stitch_error_px,
        loss=number(found.loss),
        generations=found.generations,
        timings_s={stage: round(seconds, 3) for stage, seconds in timings_s.items()},
        provenance=provenance,
    )


if __name__ == "__main__":
    main(*sys.argv[1:])
