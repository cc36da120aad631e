"""A job of the kind `field`: from frames of several cameras to the measures of their pitch, and pictures of both."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import version

import cv2
import structlog

from service.settings import Settings
from service.wire.field import FieldOfPlay
from service.wire.job import Progress
from service.wire.options import FieldOptions
from service.wire.results import FieldResult, MeasureResult, Provenance
from service.wire.venue import Venue
from worker.calibration.calibrate import CalibrationError
from worker.calibration.draw import stitching
from worker.calibration.measures.field_fit import FieldFit, Measure, fit_field
from worker.calibration.scene.camera import Camera
from worker.calibration.scene.field import Field
from worker.jobs.wire import (
    PREVIEW_FRACTION,
    Failure,
    Outcome,
    Picture,
    camera_of,
    decoded_frame,
    jpeg,
    number,
    pitch_of,
    segmenter_of,
    wire_camera,
    wire_progress,
)

MILLIMETRE = 3
log = structlog.get_logger()


def solve(
    venue: Venue,
    files: Mapping[str, Sequence[bytes]],
    options: FieldOptions,
    settings: Settings,
    report: Callable[[Progress], None],
) -> Outcome[FieldResult]:
    """The measures of a venue's pitch from the files of its cameras, with or without a server around it."""
    segmenter = segmenter_of(settings)
    cv2.setNumThreads(settings.threads)
    begun = time.perf_counter()
    frames = {c.id: [decoded_frame(c.id, c.image_size, file) for file in files[c.id]] for c in venue.cameras}
    decoded = time.perf_counter()
    pitch, cameras = pitch_of(venue.field), [camera_of(camera) for camera in venue.cameras]
    try:
        found = fit_field(
            pitch, cameras, frames, segmenter, options.seed or 0, lambda step: report(wire_progress(step))
        )
    except CalibrationError as error:
        raise Failure(error.kind, error.detail, error.camera) from error
    report(Progress(stage="preview", fraction=PREVIEW_FRACTION))
    drawing = time.perf_counter()
    pictures = _draw(pitch, cameras, found, frames)
    timings = {"decode": decoded - begun, **found.timings_s, "preview": time.perf_counter() - drawing}
    provenance = Provenance(
        software=version("esc-calibration"),
        model_sha256=segmenter.sha256,
        seed=options.seed or 0,
        options=options.model_dump(mode="json", exclude={"callback_url"}),
    )
    return Outcome(_result(venue.field, found, timings, provenance), pictures)


def _draw(
    pitch: Field, before: Sequence[Camera], found: FieldFit, frames: Mapping[str, Sequence[Picture]]
) -> dict[str, bytes]:
    pictures = {}
    for old, new in zip(before, found.cameras, strict=True):
        after = Camera(new.id, new.intrinsics, new.pose)
        try:
            drawn = stitching.overlay((pitch, old), (found.pitch, after), frames[old.id][0], "field")
        except Exception:  # what was rejected may look anywhere; a picture is not worth losing the reason
            log.warning("cannot draw", camera=old.id, exc_info=True)
            continue
        pictures[f"overlay_{old.id}"] = jpeg(drawn)
    return pictures


def _result(given: FieldOfPlay, found: FieldFit, timings_s: Mapping[str, float], provenance: Provenance) -> FieldResult:
    return FieldResult(
        accepted=found.accepted,
        rejected_because=found.rejected_because,
        field=_wire_field(given, found) if found.accepted else given,
        measures=[_wire_measure(measure) for measure in found.measures],
        cameras=[wire_camera(camera) for camera in found.cameras],
        stitch_error_px=number(found.stitch_error_px),
        timings_s={stage: round(seconds, 3) for stage, seconds in timings_s.items()},
        provenance=provenance,
    )


def _wire_field(given: FieldOfPlay, found: FieldFit) -> FieldOfPlay:
    """The fitted pitch in millimetres, which are finer than any of its sigmas."""
    pitch = found.pitch
    ridge = None if pitch.ridge is None else pitch.ridge.round(MILLIMETRE).tolist()
    return FieldOfPlay(
        template=given.template,
        length_m=round(pitch.length, MILLIMETRE),
        width_m=round(pitch.width, MILLIMETRE),
        line_width_m=given.line_width_m,
        measures_m=given.measures_m,
        ridge=ridge,
    )


def _wire_measure(measure: Measure) -> MeasureResult:
    return MeasureResult(
        name=measure.name,
        given=measure.given,
        value=measure.value,
        sigma=measure.sigma,
        open=measure.open_m,
        known=measure.known,
        detail=measure.detail,
    )
