"""A job of the kind `field`: from frames of several cameras to the measures of their pitch, and pictures of both."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence

from service.wire.field import FieldOfPlay
from service.wire.job import Progress
from service.wire.options import FieldOptions
from service.wire.results import FieldResult, MeasureResult, Provenance
from service.wire.venue import Venue
from worker.calibration.draw.overlays import overlay
from worker.calibration.measures.field_fit import FieldFit, Measure, fit_field
from worker.calibration.records import Spent
from worker.jobs import from_frames
from worker.jobs.from_frames import Drawn, Given
from worker.jobs.reading import jpeg
from worker.jobs.wire import Solution, number, to_the_millisecond, wire_camera
from worker.message import Means

MILLIMETRE = 3
log = logging.getLogger(__name__)


def solve(
    venue: Venue,
    files: Mapping[str, Sequence[bytes]],
    options: FieldOptions,
    means: Means,
    report: Callable[[Progress], None],
) -> Solution[FieldResult]:
    """The measures of a venue's pitch from the files of its cameras."""
    seed = options.seed or 0
    return from_frames.solve(
        venue,
        files,
        options,
        means,
        report,
        lambda given, step: fit_field(given.pitch, given.cameras, given.frames, given.network, seed, step),
        _draw,
        lambda found, spent, provenance: _result(venue.field, found, spent, provenance),
    )


def _draw(given: Given, found: FieldFit) -> Drawn:
    pictures = {}
    for old, new in zip(given.cameras, found.cameras, strict=True):
        try:
            both = (given.pitch, old), (found.pitch, new.camera)
            drawn = overlay(*both, given.frames[old.id][0], "field", new.markings)
        except Exception:  # what was rejected may look anywhere; a picture is not worth losing the reason
            log.warning("cannot draw camera %s", old.id, exc_info=True)
            continue
        pictures[f"overlay_{old.id}"] = jpeg(drawn)
    return Drawn(pictures)


def _result(given: FieldOfPlay, found: FieldFit, spent: Spent, provenance: Provenance) -> FieldResult:
    return FieldResult(
        accepted=found.accepted,
        rejected_because=found.rejected_because,
        field=_wire_field(given, found) if found.accepted else given,
        measures=[_wire_measure(measure) for measure in found.measures],
        cameras=[wire_camera(camera) for camera in found.cameras],
        stitch_error_px=number(found.stitch_error_px),
        timings_s=to_the_millisecond(spent.seconds),
        cpu_s=to_the_millisecond(spent.core_seconds),
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
        other_markings=given.other_markings,
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
