"""A job of the kind `calibration`: from frames of all cameras to their poses, and the pictures that show them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from datetime import datetime
from functools import partial
from typing import Any

from service.schemas.job import Progress
from service.schemas.lens_map import lens_warnings
from service.schemas.options import Options
from service.schemas.results import AdoptableNumber, CameraResult, Result, Suspicion, View
from service.schemas.trend import Anchor
from service.schemas.venue import Venue
from service.store.jobs.files import names_of_all
from service.store.jobs.task import Task
from worker.calibration import records as engine
from worker.calibration.calibrate import calibrate
from worker.calibration.detection.view_condition import UsualView
from worker.calibration.gate import quality
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.parameters import field_measures
from worker.calibration.memory.camera_memory import CameraMemory, memories_of_field
from worker.calibration.stitching.photometry import Light
from worker.compute_resources import ComputeResources
from worker.jobs.frames_job import FramesJob
from worker.jobs.from_schemas import light_of
from worker.jobs.masks import masks
from worker.jobs.nights import lens_change_to_schema, read_memories, refined_to_schema
from worker.jobs.to_schemas import (
    MILLIMETRE,
    Solution,
    camera_to_schema,
    displacement_to_schema,
    engine_run,
    finite_or_none,
    lens_to_schema,
    light_to_schema,
    pair_to_schema,
    round_to_ms,
)


@dataclass(frozen=True)
class NightHistory:
    """History of the nights before a job, by camera, and the time at which its frames were taken.

    `last_views`: what the frames of the last accepted calibration were like; `memories`: as the engine wrote them;
    `anchors`: the poses that movement is counted from.
    """

    last_views: Mapping[str, View] = field(default_factory=dict)
    memories: Mapping[str, dict[str, Any]] = field(default_factory=dict)
    anchors: Mapping[str, Anchor] = field(default_factory=dict)
    taken_at: datetime | None = None

    @classmethod
    def of(cls, task: Task) -> NightHistory:
        """Return the history that a task carries."""
        return cls(task.last_views, task.memories, task.anchors, task.taken_at)

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
    pictures: Sequence[str] | None = None,
) -> Solution[Result]:
    """Calibrate a venue from the files of its cameras, by what is known of its `nights`.

    `pictures`: names of those to draw, by `names_of_all`; None: as the options say.
    """
    job = FramesJob.prepare(venue, files, options, means, report)
    memories = read_memories(nights.memories)
    with engine_run(job.report) as step:
        found = _method(options)(
            job.pitch,
            job.cameras,
            job.frames,
            job.network,
            _engine_options(venue, options),
            step,
            usual=nights.usual,
            memories=memories,
            taken_at=nights.taken_at,
            recorder=recorder,
        )
    steadied = _steadied(venue, found)
    with job.drawing(found.timings):
        drawn, later = _draw(job, found, options, steadied, pictures)
    remembered = memories if options.dry_run else {**memories, **found.memories}
    result = _result(job, venue, options, found, steadied, remembered, nights)
    accepted_memories = {camera: memory.to_json() for camera, memory in found.memories.items()}
    return Solution(_refused_in_part(venue, options, result), drawn, later, accepted_memories)


def _draw(
    job: FramesJob,
    found: engine.Calibration,
    options: Options,
    lights: Mapping[str, Light],
    names: Sequence[str] | None,
) -> tuple[dict[str, bytes], Sequence[str]]:
    """Return the pictures that only this job can draw, and the names of those that are drawn when somebody looks.

    Without `names`, all are drawn at once where `options` say so, or where a camera was rejected: somebody will want to
    see why.
    """
    seen = masks(job.cameras, found.responses)
    if names is None and found.accepted and not options.pictures:
        return seen, names_of_all([camera.id for camera in job.cameras])
    # Most jobs draw nothing.
    from worker.jobs.pictures import PictureInputs, draw

    scene = PictureInputs(
        (job.pitch, job.cameras),
        (found.pitch, [result.camera for result in found.cameras]),
        {camera: several[0] for camera, several in job.frames.items()},
        {result.camera.id: result.markings for result in found.cameras},
        lights,
    )
    return draw(scene, scene.names if names is None else names) | seen, ()


def _steadied(venue: Venue, found: engine.Calibration) -> dict[str, Light]:
    """Return the photometric corrections that were found, steadied by those that the venue keeps."""
    kept = {camera.id: light_of(camera.light) for camera in venue.cameras if camera.light is not None}
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
        **{name: value for name, value in dict(options).items() if name in shared and value is not None},
        lens_may_drift=venue.lens == "may-drift",
        recover=venue.recover,
    )


def _result(
    job: FramesJob,
    venue: Venue,
    options: Options,
    found: engine.Calibration,
    lights: Mapping[str, Light],
    memories: Mapping[str, CameraMemory],
    nights: NightHistory,
) -> Result:
    ridge = found.pitch.ridge

    def camera_result(camera: quality.CameraResult) -> CameraResult:
        name, lens = camera.camera.id, camera.camera.intrinsics
        return camera_to_schema(camera).model_copy(
            update={
                "intrinsics": lens_to_schema(lens) if options.fit_focal_length or camera.lens_found else None,
                "light": light_to_schema(lights[name]) if name in lights else None,
                "displacement": displacement_to_schema(found.pitch, camera, nights.anchors.get(name)),
                "refined": refined_to_schema(found.pitch, camera),
                "lens_change": lens_change_to_schema(camera, nights.taken_at),
                "nights": _nights(found.pitch, memories.get(name)),
                "seen_by_network": "full" if name in found.in_full else "overview",
            }
        )

    return Result(
        kind="calibration",
        verdict=found.verdict,
        accepted=found.accepted,
        rejected_because=found.rejected_because,
        cameras=[camera_result(camera) for camera in found.cameras],
        ridge=ridge.tolist() if options.fit_ridge and ridge is not None else None,
        diagnosis=[Suspicion.model_validate(one, from_attributes=True) for one in found.suspicions],
        adoptable=_adoptable(venue, found),
        warnings=[*(words for camera in venue.cameras for words in lens_warnings(camera)), *job.remarks],
        stitch_error_px=finite_or_none(found.stitch_error_px),
        stitch_error_before_px=finite_or_none(found.stitch_error_before_px),
        stitch_error_limit_px=quality.GATE.largest_stitch_error_px,
        pairs=[pair_to_schema(*pair) for pair in found.pairs],
        loss=finite_or_none(found.loss),
        generations=found.generations,
        path=found.path,
        timings_s=round_to_ms(job.spent.seconds),
        cpu_s=round_to_ms(job.spent.core_seconds),
        provenance=job.provenance,
    )


def _adoptable(venue: Venue, found: engine.Calibration) -> list[AdoptableNumber]:
    """Return the numbers of the field that the lines contradict, in millimetres, which are finer than any sigma.

    There are none where a venue with a ridge was calibrated as if it were flat: they are numbers of another field.
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
    """Return the number of jobs in a memory, 0 if it is of another field."""
    (fits,) = memories_of_field([memory], pitch.measured_points)
    return 0 if fits is None else fits.jobs


def _refused_in_part(venue: Venue, options: Options, result: Result) -> Result:
    """Return the result, refused if only part of it was accepted and its poses may only be stored together."""
    if result.verdict != "partly":
        return result
    if venue.accept == "all":
        return result.refuse_all("the venue accepts the poses of all cameras or none")
    if options.fit_ridge:
        return result.refuse_all("a ridge is accepted with the poses of all cameras or not at all")
    return result
