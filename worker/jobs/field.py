"""A job of the kind `field`: from frames of several cameras to the measures of their pitch, and pictures of both."""

import logging
from collections.abc import Callable, Mapping, Sequence

from service.schemas.field import FieldOfPlay
from service.schemas.job import Progress
from service.schemas.options import FieldOptions
from service.schemas.results import FieldResult, MeasureResult
from service.schemas.venue import Venue
from worker.calibration.field_fit.measures import FieldFit, Measure, fit_field
from worker.calibration.rendering.overlays import overlay
from worker.compute_resources import ComputeResources
from worker.jobs.frames_job import FramesJob
from worker.jobs.from_schemas import encode_jpeg
from worker.jobs.to_schemas import (
    Solution,
    camera_to_schema,
    engine_run,
    field_to_schema,
    finite_or_none,
    round_to_ms,
)

log = logging.getLogger(__name__)


def solve(
    venue: Venue,
    files: Mapping[str, Sequence[bytes]],
    options: FieldOptions,
    means: ComputeResources,
    report: Callable[[Progress], None],
) -> Solution[FieldResult]:
    """Fit the measures of a venue's pitch to the files of its cameras."""
    job = FramesJob.prepare(venue, files, options, means, report)
    with engine_run(job.report) as step:
        found = fit_field(job.pitch, job.cameras, job.frames, job.network, options.seed or 0, step)
    with job.drawing(found.timings):
        pictures = _draw(job, found)
    return Solution(_result(job, venue.field, found), pictures)


def _draw(job: FramesJob, found: FieldFit) -> dict[str, bytes]:
    pictures = {}
    for old, new in zip(job.cameras, found.cameras, strict=True):
        try:
            both = (job.pitch, old), (found.pitch, new.camera)
            drawn = overlay(*both, job.frames[old.id][0], "field", new.markings)
        except Exception:  # what was rejected may look anywhere; a picture is not worth losing the reason
            log.warning("cannot draw camera %s", old.id, exc_info=True)
            continue
        pictures[f"overlay_{old.id}"] = encode_jpeg(drawn)
    return pictures


def _result(job: FramesJob, given: FieldOfPlay, found: FieldFit) -> FieldResult:
    return FieldResult(
        accepted=found.accepted,
        rejected_because=found.rejected_because,
        field=field_to_schema(given, found.pitch) if found.accepted else given,
        measures=[_measure_to_schema(measure) for measure in found.measures],
        cameras=[camera_to_schema(camera) for camera in found.cameras],
        stitch_error_px=finite_or_none(found.stitch_error_px),
        warnings=list(job.remarks),
        timings_s=round_to_ms(job.spent.seconds),
        cpu_s=round_to_ms(job.spent.core_seconds),
        provenance=job.provenance,
    )


def _measure_to_schema(measure: Measure) -> MeasureResult:
    return MeasureResult(
        name=measure.name,
        given=measure.given,
        value=measure.value,
        sigma=measure.sigma,
        open=measure.open_m,
        known=measure.known,
        detail=measure.detail,
    )
