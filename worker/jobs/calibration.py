"""A job of the kind `calibration`: from frames of all cameras to their poses, and the pictures that show them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from datetime import datetime
from typing import Any

from service.wire.job import Progress
from service.wire.options import Options
from service.wire.results import Provenance, Result, Suspicion, View
from service.wire.trend import Anchor
from service.wire.venue import Venue
from worker.calibration import records as engine
from worker.calibration.calibrate import calibrate
from worker.calibration.judge.quality import Gate
from worker.calibration.memory.camera_memory import CameraMemory, fitting
from worker.calibration.scene.field import Field
from worker.calibration.see.view import UsualView
from worker.calibration.stitch.light import Light
from worker.jobs import from_frames
from worker.jobs.from_frames import Drawn, Given
from worker.jobs.nights import memories_of, wire_lens_change, wire_refined
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


@dataclass(frozen=True)
class Nights:
    """What is known of the nights before a job, by camera, and when its frames were taken.

    `last_views`: what the frames of the last accepted calibration were like; `memories`: as the engine wrote them;
    `anchors`: the poses that movement is counted from.
    """

    last_views: Mapping[str, View] = field(default_factory=dict)
    memories: Mapping[str, dict[str, Any]] = field(default_factory=dict)
    anchors: Mapping[str, Anchor] = field(default_factory=dict)
    taken_at: datetime | None = None

    @property
    def usual(self) -> dict[str, UsualView]:
        """The views, for the engine."""
        return {camera: UsualView(view.lines_found, view.blur_px) for camera, view in self.last_views.items()}


FIRST_NIGHT = Nights()


def solve(
    venue: Venue,
    files: Mapping[str, Sequence[bytes]],
    options: Options,
    means: Means,
    report: Callable[[Progress], None],
    nights: Nights = FIRST_NIGHT,
) -> Solution[Result]:
    """Calibrate a venue from the files of its cameras, by what is known of its `nights`."""
    asked = _engine_options(venue, options)
    memories = memories_of(nights.memories)
    return from_frames.solve(
        venue,
        files,
        options,
        means,
        report,
        lambda given, step: calibrate(
            given.pitch,
            given.cameras,
            given.frames,
            given.network,
            asked,
            step,
            usual=nights.usual,
            memories=memories,
            taken_at=nights.taken_at,
        ),
        lambda given, found: _drawn(venue, given, found, options),
        lambda found, spent, provenance: _allowed(
            venue, options, _result(venue, found, options, spent, provenance, memories, nights)
        ),
        lambda found: {camera: memory.to_json() for camera, memory in found.memories.items()},
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
    memories: Mapping[str, CameraMemory],
    nights: Nights,
) -> Result:
    remembered = memories if options.dry_run else {**memories, **found.memories}
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
                wire_displacement(found.pitch, camera, nights.anchors.get(camera.camera.id)),
            ).model_copy(
                update={
                    "refined": wire_refined(found.pitch, camera),
                    "lens_change": wire_lens_change(camera, nights.taken_at),
                    "nights": _nights(found.pitch, remembered.get(camera.camera.id)),
                }
            )
            for camera in found.cameras
        ],
        ridge=ridge.tolist() if options.fit_ridge and ridge is not None else None,
        diagnosis=[Suspicion(**vars(suspicion)) for suspicion in found.suspicions],
        warnings=venue.lens_warnings,
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


def _nights(pitch: Field, memory: CameraMemory | None) -> int:
    """How many jobs a memory is of; one of another field is none."""
    (fits,) = fitting([memory], pitch.line_points())
    return 0 if fits is None else fits.jobs


def _allowed(venue: Venue, options: Options, result: Result) -> Result:
    """What of it may hold: poses that belong together only together."""
    if result.verdict != "partly":
        return result
    if venue.accept == "all":
        return result.refused("the venue accepts the poses of all cameras or none")
    if options.fit_ridge:
        return result.refused("a ridge is accepted with the poses of all cameras or not at all")
    return result
