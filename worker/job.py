"""One job, in a process of its own: load, calibrate, draw, hand back.

`python -m worker.job JOB_ID RUN_TOKEN` prints a line of JSON for each step of progress and one for the end, a
`worker.message.Message` each. It writes no row: its parent does.
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from math import isfinite
from typing import Any

import cv2
import numpy as np
import structlog
from numpy.typing import NDArray

from service import lifeline, logs, schemas
from service.problems import KINDS, type_of
from service.schemas import CameraResult, JobError, Moved, Progress, Provenance, Result, Sigma, Venue
from service.settings import Settings
from service.store.blobs import Blobs
from service.store.engine import connect
from service.store.jobs import Jobs, Task, picture_folder
from worker.calibration import calibrate as engine
from worker.calibration import stitching
from worker.calibration.calibrate import CalibrationError, calibrate
from worker.calibration.camera import LENSES, Camera, Pose
from worker.calibration.field import Field
from worker.calibration.segmentation import ProviderMissing, Segmenter
from worker.message import Message

Picture = NDArray[np.uint8]
JPEG_QUALITY = 90
PROVIDERS = {"cpu": "CPUExecutionProvider", "cuda": "CUDAExecutionProvider", "openvino": "OpenVINOExecutionProvider"}
# The engine's report ends with the refinement; what is left is drawing.
PREVIEW_FRACTION = 0.96
log = structlog.get_logger()


@dataclass(frozen=True)
class Outcome:
    """A result and its pictures, JPEG by name: `preview`, `birdseye`, `overlay_<camera>`."""

    result: Result
    pictures: dict[str, bytes]


class Failure(Exception):  # noqa: N818
    """The job has no result; `error` says why."""

    def __init__(self, kind: str, detail: str, camera: str | None = None) -> None:
        super().__init__(detail)
        self.error = JobError(type=type_of(kind), title=KINDS[kind].title, detail=detail, camera=camera)


def main(job_id: str, run_token: str) -> None:
    """Compute the job that the parent has begun."""
    lifeline.end_with_parent()
    say = _line_to_parent()
    settings = Settings()
    logs.configure(settings)
    structlog.contextvars.bind_contextvars(job=job_id)
    task = Jobs(connect(settings.home_database_url)).task(job_id, run_token)
    if task is None:
        return
    blobs = Blobs(settings.home_blob_url)
    try:
        outcome = solve(
            task.venue,
            _load(task, blobs),
            task.options,
            settings,
            lambda progress: say(Message(progress=progress)),
        )
    except Failure as failure:
        say(Message(error=failure.error))
        return
    for name, picture in outcome.pictures.items():
        blobs.put(f"{picture_folder(job_id, run_token)}/{name}.jpg", picture)
    say(Message(result=outcome.result, pictures=list(outcome.pictures)))


def solve(
    venue: Venue,
    files: Mapping[str, Sequence[bytes]],
    options: schemas.Options,
    settings: Settings,
    report: Callable[[Progress], None],
) -> Outcome:
    """Calibrate a venue from the files of its cameras, with or without a server around it."""
    if not settings.model.is_file():
        raise Failure("model-missing", f"{settings.model} is not there; set ESC_MODEL or train one.")
    cv2.setNumThreads(settings.threads)
    begun = time.perf_counter()
    frames = {camera.id: _decode(camera, files[camera.id]) for camera in venue.cameras}
    decoded = time.perf_counter()
    pitch, cameras = _pitch(venue.field), [_camera(camera) for camera in venue.cameras]
    segmenter = _segmenter(settings)
    try:
        found = calibrate(
            pitch, cameras, frames, segmenter, _engine_options(options), lambda step: report(_progress(step))
        )
    except CalibrationError as error:
        raise Failure(error.kind, error.detail, error.camera) from error
    report(Progress(stage="preview", fraction=PREVIEW_FRACTION))
    drawing = time.perf_counter()
    pictures = _draw(cameras, found, frames)
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


def _segmenter(settings: Settings) -> Segmenter:
    try:
        return Segmenter(settings.model, settings.threads, PROVIDERS[settings.provider])
    except ProviderMissing as missing:
        raise Failure("provider-missing", f"{missing} Set ESC_PROVIDER=cpu or install what is asked for.") from missing


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
            data = blobs.get(path)
            if data is None:
                raise Failure("job-crashed", f"The stored frame {path} is gone.", camera)
            files[camera].append(data)
    return files


def _decode(camera: schemas.Camera, files: Sequence[bytes]) -> list[Picture]:
    """BGR frames (height, width, 3) of the size of the intrinsics; a camera's EXIF orientation is not obeyed."""
    frames = []
    for file in files:
        try:
            frame = cv2.imdecode(
                np.frombuffer(file, dtype=np.uint8), cv2.IMREAD_COLOR_BGR | cv2.IMREAD_IGNORE_ORIENTATION
            )
        except cv2.error:
            frame = None
        if frame is None:
            raise Failure("broken-image", f"A frame of camera {camera.id} cannot be decoded; grab it again.", camera.id)
        (height, width), wanted = frame.shape[:2], camera.image_size
        if [width, height] != wanted:
            raise Failure(
                "frame-size",
                f"A frame of camera {camera.id} decodes to {width}x{height} pixels; its intrinsics are for "
                f"{wanted[0]}x{wanted[1]}.",
                camera.id,
            )
        frames.append(np.asarray(frame, dtype=np.uint8))
    return frames


def _pitch(field: schemas.FieldOfPlay) -> Field:
    ridge = None if field.ridge is None else np.array(field.ridge)
    return Field(field.length_m, field.width_m, field.line_width_m, ridge)


def _camera(camera: schemas.Camera) -> Camera:
    lens = camera.intrinsics
    intrinsics = LENSES[lens.model](
        np.array(lens.matrix, dtype=float),
        np.array(lens.distortion, dtype=float),
        (camera.image_size[0], camera.image_size[1]),
    )
    return Camera(camera.id, intrinsics, Pose(np.array(camera.pose.rotation), np.array(camera.pose.position)))


def _engine_options(options: schemas.Options) -> engine.Options:
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


def _progress(step: engine.Progress) -> Progress:
    return Progress(
        stage=step.stage,
        fraction=min(max(step.fraction, 0.0), PREVIEW_FRACTION),
        generation=step.generation,
        loss=_number(step.loss),
    )


def _draw(
    before: Sequence[Camera],
    found: engine.Calibration,
    frames: Mapping[str, Sequence[Picture]],
) -> dict[str, bytes]:
    after = [Camera(camera.id, camera.intrinsics, camera.pose) for camera in found.cameras]
    first = {camera: several[0] for camera, several in frames.items()}
    drawn: dict[str, Callable[[], Picture]] = {
        "preview": lambda: stitching.preview(found.pitch, after, first),
        "birdseye": lambda: stitching.birdseye(found.pitch, after, first),
    }
    for old, new in zip(before, after, strict=True):
        drawn[f"overlay_{old.id}"] = lambda old=old, new=new: stitching.overlay(  # type: ignore[misc]
            found.pitch, old, new, first[old.id]
        )
    pictures = {}
    for name, draw in drawn.items():
        try:
            pictures[name] = _jpeg(draw())
        except Exception:  # poses that were rejected may look anywhere; a picture is not worth losing the reason
            log.warning("cannot draw", picture=name, exc_info=True)
    return pictures


def _jpeg(picture: Picture) -> bytes:
    _, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return data.tobytes()


def _result(
    found: engine.Calibration, options: schemas.Options, timings_s: Mapping[str, float], provenance: Provenance
) -> Result:
    ridge = found.pitch.ridge
    return Result(
        accepted=found.accepted,
        rejected_because=found.rejected_because,
        cameras=[_camera_result(camera, options) for camera in found.cameras],
        ridge=ridge.tolist() if options.fit_ridge and ridge is not None else None,
        diagnosis=[schemas.Suspicion(**vars(suspicion)) for suspicion in found.suspicions],
        stitch_error_px=_number(found.stitch_error_px),
        stitch_error_before_px=_number(found.stitch_error_before_px),
        loss=_number(found.loss),
        generations=found.generations,
        timings_s={stage: round(seconds, 3) for stage, seconds in timings_s.items()},
        provenance=provenance,
    )


def _camera_result(camera: engine.CameraResult, options: schemas.Options) -> CameraResult:
    lens = camera.intrinsics
    sigma = camera.sigma
    known = sigma is not None and isfinite(sigma.rotation_deg) and isfinite(sigma.position_m)
    return CameraResult(
        id=camera.id,
        pose=schemas.Pose(
            rotation=camera.pose.rotation.tolist(),
            position=camera.pose.position.tolist(),
            translation=camera.pose.translation.tolist(),
        ),
        intrinsics=schemas.Intrinsics(matrix=lens.matrix.tolist(), distortion=lens.distortion.tolist())
        if options.fit_focal_length
        else None,
        sigma=Sigma(rotation_deg=sigma.rotation_deg, position_m=sigma.position_m) if sigma and known else None,
        moved=Moved(
            rotation_deg=camera.moved.rotation_deg,
            position_m=camera.moved.position_m,
            pixels=_number(camera.moved.pixels),
        ),
        iou=_number(camera.iou),
        residual_px=_number(camera.residual_px),
    )


def _number(value: Any) -> float | None:
    """JSON has no NaN and no infinity."""
    return float(value) if value is not None and isfinite(value) else None


if __name__ == "__main__":
    main(*sys.argv[1:])
