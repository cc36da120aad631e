"""A job of the kind `calibration`: from frames of all cameras to their poses, and the pictures that show them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import fields
from types import MappingProxyType

from service.wire.job import Progress
from service.wire.options import Options
from service.wire.results import Provenance, Result, Suspicion, View
from service.wire.trend import Anchor
from service.wire.venue import Venue
from worker.calibration import records as engine
from worker.calibration.calibrate import calibrate
from worker.calibration.judge.quality import Gate
from worker.calibration.see.view import UsualView
from worker.calibration.stitch.light import Light
from worker.jobs import from_frames
from worker.jobs.from_frames import Drawn, Given
from worker.jobs.pictures import Scene, draw, masks
from worker.jobs.reading import light_of
from worker.jobs.wire import (
    Solution,
    number,
    to_the_millisecond,
    wire_camera,
    wire_displacement,
    wire_lens,
    wire_light,
    wire_pair,
)
from worker.message import Means

NO_VIEWS: Mapping[str, View] = MappingProxyType({})
NO_ANCHORS: Mapping[str, Anchor] = MappingProxyType({})


def solve(
    venue: Venue,
    files: Mapping[str, Sequence[bytes]],
    options: Options,
    means: Means,
    report: Callable[[Progress], None],
    last_views: Mapping[str, View] = NO_VIEWS,
    anchors: Mapping[str, Anchor] = NO_ANCHORS,
) -> Solution[Result]:
    """Calibrate a venue from the files of its cameras.

    `last_views`: those of its last accepted calibration; `anchors`: the poses that movement is counted from. Both by
    camera, of those that have one.
    """
    asked = _engine_options(venue, options)
    usual = {camera: UsualView(view.lines_found, view.blur_px) for camera, view in last_views.items()}
    return from_frames.solve(
        venue,
        files,
        options,
        means,
        report,
        lambda given, step: calibrate(
            given.pitch, given.cameras, given.frames, given.network, asked, step, usual=usual
        ),
        lambda given, found: _drawn(venue, given, found, options),
        lambda found, spent, provenance: _allowed(
            venue, options, _result(venue, found, options, spent, provenance, anchors)
        ),
    )


def _drawn(venue: Venue, given: Given, found: engine.Calibration, options: Options) -> Drawn:
    """What only this job can draw; and all the rest at once where somebody asks for it, or will want to see why."""
    scene = Scene(
        (given.pitch, given.cameras),
        (found.pitch, [result.camera for result in found.cameras]),
        {camera: several[0] for camera, several in given.frames.items()},
        {result.camera.id: result.markings for result in found.cameras},
        _steadied(venue, found),
    )
    seen = masks(given.cameras, given.network.responses)
    if found.accepted and not options.pictures:
        return Drawn(seen, scene.names)
    return Drawn(draw(scene, scene.names) | seen)


def _steadied(venue: Venue, found: engine.Calibration) -> dict[str, Light]:
    """The light of the cameras that were evened out, steadied by what the venue keeps of it."""
    kept = {camera: light_of(light) for camera, light in venue.lights.items()}
    return {camera: light.after(kept.get(camera)) for camera, light in found.lights.items()}


def _engine_options(venue: Venue, options: Options) -> engine.Options:
    asked = {field.name for field in fields(engine.Options)}
    return engine.Options(
        **options.model_dump(include=asked, exclude_none=True), lens_may_drift=venue.lens == "may-drift"
    )


def _result(
    venue: Venue,
    found: engine.Calibration,
    options: Options,
    spent: engine.Spent,
    provenance: Provenance,
    anchors: Mapping[str, Anchor],
) -> Result:
    ridge = found.pitch.ridge
    lights = {camera: wire_light(light) for camera, light in _steadied(venue, found).items()}
    return Result(
        verdict=found.verdict,
        accepted=found.accepted,
        rejected_because=found.rejected_because,
        cameras=[
            wire_camera(
                camera,
                wire_lens(camera.camera.intrinsics) if options.fit_focal_length or camera.lens_found else None,
                lights.get(camera.camera.id),
                wire_displacement(found.pitch, camera, anchors.get(camera.camera.id)),
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
        timings_s=to_the_millisecond(spent.seconds),
        cpu_s=to_the_millisecond(spent.core_seconds),
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
