"""A job of the kind `calibration`: from frames of all cameras to their poses, and the pictures that show them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from datetime import datetime
from functools import partial
from typing import Any

from service.schemas.refusals import refuse_camera, refuse_result
from service.store.jobs.files import names_of_all
from worker.calibration import records as engine
from worker.calibration.calibrate import calibrate
from worker.calibration.detection.view_condition import UsualView
from worker.calibration.gate.quality import GATE
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.parameters import field_measures
from worker.calibration.memory.camera_memory import CameraMemory, memories_of_field
from worker.calibration.refinement import diagnosis
from worker.calibration.stitching.photometry import Light
from worker.compute_resources import ComputeResources
from worker.jobs import frames_job
from worker.jobs.answers import AdoptableNumber, CameraResult, Progress, Provenance, Result, Suspicion
from worker.jobs.frames_job import EngineInputs, JobPictures
from worker.jobs.from_schemas import light_of
from worker.jobs.inputs import Anchor, Options, Venue, View
from worker.jobs.masks import masks
from worker.jobs.nights import lens_change_to_schema, read_memories, refined_to_schema
from worker.jobs.to_schemas import (
    MILLIMETRE,
    Solution,
    camera_to_schema,
    displacement_to_schema,
    finite_or_none,
    lens_to_schema,
    light_to_schema,
    pair_to_schema,
    round_to_ms,
)


@dataclass(frozen=True)
class NightHistory:
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


NO_HISTORY = NightHistory()


def solve(
    venue: Venue,
    files: Mapping[str, Sequence[bytes]],
    options: Options,
    means: ComputeResources,
    report: Callable[[Progress], None],
    nights: NightHistory = NO_HISTORY,
    recorder: engine.Recorder = engine.NOT_RECORDED,
) -> Solution[Result]:
    """Calibrate a venue from the files of its cameras, by what is known of its `nights`."""
    asked = _engine_options(venue, options)
    memories = read_memories(nights.memories)
    return frames_job.solve(
        venue,
        files,
        dict(vars(options)),
        means,
        report,
        lambda given, step: _method(options)(
            given.pitch,
            given.cameras,
            given.frames,
            given.network,
            asked,
            step,
            usual=nights.usual,
            memories=memories,
            taken_at=nights.taken_at,
            recorder=recorder,
        ),
        lambda given, found: _drawn(venue, given, found, options),
        lambda found, spent, provenance, warnings: _allowed(
            venue, options, _result(venue, found, options, spent, provenance, warnings, memories, nights)
        ),
        lambda found: {camera: memory.to_json() for camera, memory in found.memories.items()},
    )


def _drawn(venue: Venue, given: EngineInputs, found: engine.Calibration, options: Options) -> JobPictures:
    """What only this job can draw; and all the rest at once where somebody asks for it, or will want to see why."""
    seen = masks(given.cameras, found.responses)
    if found.accepted and not options.pictures:
        return JobPictures(seen, names_of_all([camera.id for camera in given.cameras]))
    # Most jobs draw nothing.
    from worker.jobs.pictures import PictureInputs, draw

    scene = PictureInputs(
        (given.pitch, given.cameras),
        (found.pitch, [result.camera for result in found.cameras]),
        {camera: several[0] for camera, several in given.frames.items()},
        {result.camera.id: result.markings for result in found.cameras},
        _steadied(venue, found),
    )
    return JobPictures(draw(scene, scene.names) | seen)


def _steadied(venue: Venue, found: engine.Calibration) -> dict[str, Light]:
    """The light of the cameras that were evened out, steadied by what the venue keeps of it."""
    kept = {camera: light_of(light) for camera, light in venue.lights.items()}
    return {camera: light.after(kept.get(camera)) for camera, light in found.lights.items()}


def _method(options: Options) -> Callable[..., engine.Calibration]:
    """Return the engine's own method, or for comparison the paper's, which is loaded for those who compare."""
    if options.preset == "esc":
        return calibrate
    from worker.calibration.paper.calibrate import PRESETS, calibrate_by_paper

    return partial(calibrate_by_paper, PRESETS[options.preset])


def _engine_options(venue: Venue, options: Options) -> engine.Options:
    shared = {field.name for field in fields(engine.Options)}
    return engine.Options(
        **{name: value for name, value in vars(options).items() if name in shared and value is not None},
        lens_may_drift=venue.lens == "may-drift",
        recover=venue.recover,
    )


def _result(
    venue: Venue,
    found: engine.Calibration,
    options: Options,
    spent: engine.StageTimings,
    provenance: Provenance,
    warnings: Sequence[str],
    memories: Mapping[str, CameraMemory],
    nights: NightHistory,
) -> Result:
    remembered = memories if options.dry_run else {**memories, **found.memories}
    ridge = found.pitch.ridge
    lights = {camera: light_to_schema(light) for camera, light in _steadied(venue, found).items()}
    return Result(
        verdict=found.verdict,
        accepted=found.accepted,
        rejected_because=found.rejected_because,
        cameras=[
            {
                **camera_to_schema(
                    camera,
                    lens_to_schema(camera.camera.intrinsics) if options.fit_focal_length or camera.lens_found else None,
                    lights.get(camera.camera.id),
                    displacement_to_schema(found.pitch, camera, nights.anchors.get(camera.camera.id)),
                ),
                "refined": refined_to_schema(found.pitch, camera),
                "lens_change": lens_change_to_schema(camera, nights.taken_at),
                "nights": _nights(found.pitch, remembered.get(camera.camera.id)),
                "seen_by_network": "full" if camera.camera.id in found.in_full else "overview",
            }
            for camera in found.cameras
        ],
        ridge=ridge.tolist() if options.fit_ridge and ridge is not None else None,
        diagnosis=[_suspicion(one) for one in found.suspicions],
        adoptable=_adoptable(venue, found),
        warnings=[*venue.lens_warnings, *warnings],
        stitch_error_px=finite_or_none(found.stitch_error_px),
        stitch_error_before_px=finite_or_none(found.stitch_error_before_px),
        stitch_error_limit_px=GATE.largest_stitch_error_px,
        pairs=[pair_to_schema(*pair) for pair in found.pairs],
        loss=finite_or_none(found.loss),
        generations=found.generations,
        path=found.path,
        timings_s=round_to_ms(spent.seconds),
        cpu_s=round_to_ms(spent.core_seconds),
        provenance=provenance,
    )


def _suspicion(of: diagnosis.Suspicion) -> Suspicion:
    return Suspicion(camera=of.camera, quantity=of.quantity, deviation=of.deviation, sigma=of.sigma, detail=of.detail)


def _adoptable(venue: Venue, found: engine.Calibration) -> list[AdoptableNumber]:
    """The numbers of the field that the lines contradict, in millimetres, which are finer than any sigma.

    None where a venue with a ridge was calibrated as if it were flat: they are numbers of another field.
    """
    of_field = [one for one in found.suspicions if one.camera is None]
    if not of_field or (found.pitch.ridge is None and venue.field.ridge is not None):
        return []
    accepted = {camera.camera.id for camera in found.cameras if camera.accepted}
    given = {measure.name: measure.read(found.pitch) for measure in field_measures(found.pitch)}
    return [
        AdoptableNumber(
            name=one.quantity,
            given=given[one.quantity],
            value=round(given[one.quantity] + one.deviation, MILLIMETRE),
            sigma=one.sigma,
            moves_m={camera: round(by, MILLIMETRE) for camera, by in one.moves_m.items() if camera in accepted},
        )
        for one in of_field
        if one.quantity in given
    ]


def _nights(pitch: Field, memory: CameraMemory | None) -> int:
    """How many jobs a memory is of; one of another field is none."""
    (fits,) = memories_of_field([memory], pitch.line_points())
    return 0 if fits is None else fits.jobs


def _allowed(venue: Venue, options: Options, result: Result) -> Result:
    """What of it may hold: poses that belong together only together."""
    if result["verdict"] != "partly":
        return result
    if venue.accept == "all":
        return _refused(result, "the venue accepts the poses of all cameras or none")
    if options.fit_ridge:
        return _refused(result, "a ridge is accepted with the poses of all cameras or not at all")
    return result


def _refused(result: Result, because: str) -> Result:
    """The result with every pose refused."""
    cameras: list[CameraResult] = [
        {**camera, **refuse_camera(camera["rejected_because"], camera["refusal"], because, "all-or-none")}
        for camera in result["cameras"]
    ]
    return {**result, **refuse_result(result["rejected_because"], because), "cameras": cameras}
