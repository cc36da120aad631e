"""A job of the kind `calibration`: from frames of all cameras to their poses, and the pictures that show them."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence

import cv2

from service.settings import Settings
from service.wire.job import Progress
from service.wire.options import Options
from service.wire.results import Provenance, Result, Suspicion
from service.wire.venue import Venue
from worker.calibration import calibrate as engine
from worker.calibration.calibrate import CalibrationError, calibrate
from worker.calibration.judge.quality import Gate
from worker.jobs.pictures import Remembering, draw
from worker.jobs.wire import (
    PREVIEW_FRACTION,
    Failure,
    Solution,
    camera_of,
    decoded_frame,
    number,
    pitch_of,
    provenance_of,
    segmenter_of,
    to_the_millisecond,
    wire_camera,
    wire_lens,
    wire_progress,
)


def solve(
    venue: Venue,
    files: Mapping[str, Sequence[bytes]],
    options: Options,
    settings: Settings,
    report: Callable[[Progress], None],
) -> Solution[Result]:
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
    timings = {"decode": decoded - begun, **found.timings_s, "preview": time.perf_counter() - drawing}
    provenance = provenance_of(segmenter, options)
    return Solution(_result(found, options, timings, provenance), pictures)


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
        timings_s=to_the_millisecond(timings_s),
        provenance=provenance,
    )
