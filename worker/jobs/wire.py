"""What the kinds of jobs share: how they end, how files become pictures, how the wire becomes the engine's types."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.metadata import version
from math import isfinite, isnan
from typing import Any, Generic, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from service.settings import Settings
from service.wire import geometry, venue
from service.wire.field import FieldOfPlay
from service.wire.geometry import Moved
from service.wire.job import JobError, Progress
from service.wire.options import FieldOptions, Options
from service.wire.problems import KINDS, refusal_of, type_of
from service.wire.results import (
    AnyResult,
    CameraResult,
    MarkingResult,
    PairResult,
    Provenance,
    SeamPlace,
    Sigma,
    View,
)
from worker.calibration import records
from worker.calibration.finish import uncertainty
from worker.calibration.judge import quality, seam
from worker.calibration.judge.markings import MarkingSeen
from worker.calibration.judge.pairs import Pair
from worker.calibration.scene.camera import LENSES, Camera, Intrinsics, Pose
from worker.calibration.scene.field import Field
from worker.calibration.scene.ignored import Ignored
from worker.calibration.see.segmentation import ProviderMissing, Segmenter
from worker.calibration.see.view import ViewCondition

Picture = NDArray[np.uint8]
JPEG_QUALITY = 90
PROVIDERS = {"cpu": "CPUExecutionProvider", "cuda": "CUDAExecutionProvider", "openvino": "OpenVINOExecutionProvider"}
# The engine's report ends with the refinement; what is left is drawing.
PREVIEW_FRACTION = 0.96
R = TypeVar("R", bound=AnyResult, covariant=True)


@dataclass(frozen=True)
class Solution(Generic[R]):
    """A result and the files of its pictures, by the names that `service.store.jobs.files.picture_file` knows."""

    result: R
    pictures: dict[str, bytes]


def provenance_of(segmenter: Segmenter, options: Options | FieldOptions) -> Provenance:
    """What computes a solution, so that it can be computed again."""
    return Provenance(
        software=version("esc-calibration"),
        model_sha256=segmenter.sha256,
        seed=options.seed or 0,
        # Who is told changes no number, and the address may be a secret.
        options=options.model_dump(mode="json", exclude={"callback_url"}),
    )


def to_the_millisecond(timings_s: Mapping[str, float]) -> dict[str, float]:
    """The seconds of each stage, as a result shows them."""
    return {stage: round(seconds, 3) for stage, seconds in timings_s.items()}


class Failure(Exception):  # noqa: N818
    """The job has no result; `error` says why."""

    def __init__(self, kind: str, detail: str, camera: str | None = None) -> None:
        super().__init__(detail)
        self.error = JobError(type=type_of(kind), title=KINDS[kind].title, detail=detail, camera=camera)


def decoded(file: bytes, flags: int) -> Picture | None:
    """A picture from a file's bytes, None where it has none; a camera's EXIF orientation is not obeyed."""
    try:
        picture = cv2.imdecode(np.frombuffer(file, dtype=np.uint8), flags | cv2.IMREAD_IGNORE_ORIENTATION)
    except cv2.error:
        return None
    return None if picture is None else np.asarray(picture, dtype=np.uint8)


def decoded_frame(camera: str, image_size: list[int], file: bytes) -> Picture:
    """A BGR frame (height, width, 3) of the size of the intrinsics."""
    frame = decoded(file, cv2.IMREAD_COLOR_BGR)
    if frame is None:
        raise Failure("broken-image", f"A frame of camera {camera} cannot be decoded; grab it again.", camera)
    height, width = frame.shape[:2]
    if [width, height] != image_size:
        raise Failure(
            "frame-size",
            f"A frame of camera {camera} decodes to {width}x{height} pixels; its intrinsics are for "
            f"{image_size[0]}x{image_size[1]}.",
            camera,
        )
    return frame


def jpeg(picture: Picture, quality: int = JPEG_QUALITY) -> bytes:
    """The file of a picture."""
    _, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return data.tobytes()


def png(picture: Picture) -> bytes:
    """The file of a picture with an opacity, BGRA."""
    _, data = cv2.imencode(".png", picture)
    return data.tobytes()


def pitch_of(field: FieldOfPlay) -> Field:
    """The engine's pitch."""
    ridge = None if field.ridge is None else np.array(field.ridge)
    size = field.length_m, field.width_m, field.line_width_m
    return Field(*size, ridge, field.plan, field.measures_m, others=field.others)


def lens_of(lens: geometry.Intrinsics, image_size: list[int]) -> Intrinsics:
    """The engine's lens."""
    matrix, distortion = np.array(lens.matrix, dtype=float), np.array(lens.distortion, dtype=float)
    return LENSES[lens.model](matrix, distortion, (image_size[0], image_size[1]), dict(lens.sigma or {}))


def camera_of(camera: geometry.PosedCamera) -> Camera:
    """The engine's camera at its stored pose."""
    pose = Pose(np.array(camera.pose.rotation), np.array(camera.pose.position))
    return Camera(camera.id, lens_of(camera.intrinsics, camera.image_size), pose)


def watching(camera: venue.Camera) -> Camera:
    """The engine's camera of a venue, with what of its frames is to be ignored."""
    width, height = camera.image_size
    polygons = [np.array(polygon, dtype=float) for polygon in camera.ignore]
    return replace(camera_of(camera), ignored=Ignored(polygons, (width, height)) if polygons else None)


def wire_lens(lens: Intrinsics) -> geometry.Intrinsics:
    """A lens of the engine for the wire."""
    # What photos or clicks hardly tell has a deviation beyond any number that says something.
    sigma = {
        name: min(max(value, geometry.LEAST_SIGMA), geometry.LARGEST_SIGMA)
        for name, value in lens.sigma.items()
        if not isnan(value)
    }
    return geometry.Intrinsics(
        model=lens.model, matrix=lens.matrix.tolist(), distortion=lens.distortion.tolist(), sigma=sigma or None
    )


def wire_pose(pose: Pose) -> geometry.Pose:
    """A pose of the engine for the wire."""
    return geometry.Pose(
        rotation=pose.rotation.tolist(), position=pose.position.tolist(), translation=pose.translation.tolist()
    )


def number(value: Any) -> float | None:
    """JSON has no NaN and no infinity."""
    return float(value) if value is not None and isfinite(value) else None


def segmenter_of(settings: Settings) -> Segmenter:
    """The network that the settings name."""
    if not settings.model.is_file():
        raise Failure("model-missing", f"{settings.model} is not there; set ESC_MODEL or train one.")
    try:
        return Segmenter(settings.model, settings.threads, PROVIDERS[settings.provider])
    except ProviderMissing as missing:
        raise Failure("provider-missing", f"{missing} Set ESC_PROVIDER=cpu or install what is asked for.") from missing


def wire_progress(step: records.Progress) -> Progress:
    """How far the engine is, with room for the pictures."""
    return Progress(
        stage=step.stage,
        fraction=min(max(step.fraction, 0.0), PREVIEW_FRACTION),
        generation=step.generation,
        loss=number(step.loss),
    )


def wire_camera(found: quality.CameraResult, lens: geometry.Intrinsics | None = None) -> CameraResult:
    """What a finish has to say of a camera; `lens` where it was found as well."""
    return CameraResult(
        id=found.camera.id,
        accepted=found.accepted,
        rejected_because=found.rejected_because,
        refusal=None if found.refusal is None else refusal_of(found.refusal.reason),
        pose=wire_pose(found.camera.pose),
        intrinsics=lens,
        sigma=_sigma(found.sigma),
        repeatability=_sigma(found.repeatability),
        moved=Moved(
            rotation_deg=found.moved.rotation_deg,
            position_m=found.moved.position_m,
            pixels=number(found.moved.pixels),
        ),
        iou=number(found.overlap.iou),
        expected_found=number(found.overlap.found),
        unexpected=number(found.overlap.unexpected),
        found=number(found.evidence.share),
        by_chance=number(found.evidence.by_chance),
        view=_view(found.view),
        residual_px=number(found.residual_px),
        markings=[_marking(one) for one in found.markings],
    )


def _marking(seen: MarkingSeen) -> MarkingResult:
    return MarkingResult(
        name=seen.name,
        expected_m=round(seen.expected_m, 1),
        found=round(seen.found, 3),
        offset_cm=_rounded_cm(seen.offset_m),
        sigma_cm=_rounded_cm(seen.sigma_m),
        side=seen.side,
        elsewhere=seen.is_elsewhere,
    )


def wire_pair(pair: Pair, found: seam.Seam) -> PairResult:
    """What two cameras say of each other."""
    return PairResult(
        cameras=list(pair.cameras),
        stitch_error_px=number(pair.error_px),
        seam=[_place(place) for place in found.places],
        worst=None if found.worst is None else _place(found.worst),
    )


def _place(place: seam.SeamPlace) -> SeamPlace:
    return SeamPlace(
        at=place.at.round(1).tolist(),
        across=(place.across.round(2) + 0.0).tolist(),
        error_cm=round(100 * place.error_m, 1),
        sigma_cm=round(100 * place.sigma_m, 1),
    )


def _rounded_cm(metres: float | None) -> float | None:
    """To the millimetre."""
    return None if metres is None or not isfinite(metres) else round(100 * metres, 1)


def _view(found: ViewCondition) -> View:
    return View(
        usable=found.usable,
        cause=found.cause,
        where=found.where,
        detail=found.words,
        lines_found=number(found.figures.lines_found),
        blur_px=number(found.figures.blur_px),
    )


def _sigma(sigma: uncertainty.Sigma | None) -> Sigma | None:
    if sigma is None or not isfinite(sigma.rotation_deg) or not isfinite(sigma.position_m):
        return None
    return Sigma(rotation_deg=sigma.rotation_deg, position_m=sigma.position_m)
