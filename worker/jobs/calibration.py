"""A job of the kind `calibration`: from frames of all cameras to their poses, and the pictures that show them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from types import MappingProxyType

from service.settings import Settings
from service.wire.job import Progress
from service.wire.options import Options
from service.wire.results import Provenance, Result, Suspicion, View
from service.wire.venue import Venue
from worker.calibration import records as engine
from worker.calibration.calibrate import calibrate
from worker.calibration.judge.quality import Gate
from worker.calibration.see.view import UsualView
from worker.jobs import from_frames
from worker.jobs.pictures import draw
from worker.jobs.wire import Solution, number, wire_camera, wire_lens, wire_pair

NO_VIEWS: Mapping[str, View] = MappingProxyType({})


def solve(
    venue: Venue,
    files: Mapping[str, Sequence[bytes]],
    options: Options,
    settings: Settings,
    report: Callable[[Progress], None],
    last_views: Mapping[str, View] = NO_VIEWS,
) -> Solution[Result]:
    """Calibrate a venue from the files of its cameras; `last_views`: those of its last accepted calibration."""
    asked = _engine_options(venue, options)
    usual = {camera: UsualView(view.lines_found, view.blur_px) for camera, view in last_views.items()}
    return from_frames.solve(
        venue,
        files,
        options,
        settings,
        report,
        lambda given, step: calibrate(
            given.pitch, given.cameras, given.frames, given.network, asked, step, usual=usual
        ),
        draw,
        lambda found, timings_s, provenance: _allowed(venue, options, _result(found, options, timings_s, provenance)),
    )


def _engine_options(venue: Venue, options: Options) -> engine.Options:
    asked = {field.name for field in fields(engine.Options)}
    return engine.Options(
        **options.model_dump(include=asked, exclude_none=True), lens_may_drift=venue.lens == "may-drift"
    )


def _result(
    found: engine.Calibration, options: Options, timings_s: Mapping[str, float], provenance: Provenance
) -> Result:
    ridge = found.pitch.ridge
    return Result(
        verdict=found.verdict,
        accepted=found.accepted,
        rejected_because=found.rejected_because,
        cameras=[
            wire_camera(
                camera, wire_lens(camera.camera.intrinsics) if options.fit_focal_length or camera.lens_found else None
            )
            for camera in found.cameras
        ],
        ridge=ridge.tolist() if options.fit_ridge and ridge is not None else None,
        diagnosis=[Suspicion(**vars(suspicion)) for suspicion in found.suspicions],
        stitch_error_px=number(found.stitch_error_px),
        stitch_error_before_px=number(found.stitch_error_before_px),
        stitch_error_limit_px=Gate().largest_stitch_error_px,
        pairs=[wire_pair(*pair) for pair in found.pairs],
        loss=number(found.loss),
        generations=found.generations,
        path=found.path,
        timings_s=dict(timings_s),
        provenance=provenance,
    )


def _allowed(venue: Venue, options: Options, result: Result) -> Result:
    """What of it may hold: poses that belong together only together."""
    if result.verdict != "partly":
        return result
    if venue.accept == "all":
        return result.refused("the venue accepts the poses of all cameras or none")
    if options.fit_ridge:
        return result.refused("a ridge is accepted with the poses of all cameras or not at all")
    return result
