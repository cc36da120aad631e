"""Conversion of the wire's models to the types of the engine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from fields.plans import other_shapes, plan_of, size_of
from service.schemas import geometry, view
from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Intrinsics, PosedCamera
from service.schemas.job import JobError
from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.ignored_areas import Ignored
from worker.calibration.geometry.lens import Lens
from worker.calibration.geometry.lens_models import LENSES
from worker.calibration.stitching.photometry import Light
from worker.calibration.stitching.views import ViewChoice

Picture = NDArray[np.uint8]
JPEG_QUALITY = 90


class JobFailedError(Exception):
    """The job has no result; `error` says why."""

    def __init__(self, kind: str, detail: str, camera: str | None = None) -> None:
        super().__init__(detail)
        self.kind = kind
        self.error = JobError.of(kind, detail, camera)

    def because(self, why: str) -> JobFailedError:
        """Return the error with its likeliest cause added."""
        return JobFailedError(self.kind, f"{self.error.detail} {why[0].upper()}{why[1:]}.", self.error.camera)


def encode_jpeg(picture: Picture, quality: int = JPEG_QUALITY) -> bytes:
    """Return the JPEG file of a BGR or grey picture."""
    _, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return data.tobytes()


def encode_png(picture: Picture) -> bytes:
    """Return the PNG file of a picture, with its opacity if it is BGRA."""
    _, data = cv2.imencode(".png", picture)
    return data.tobytes()


def pitch_of(field: FieldOfPlay) -> Field:
    """Return the engine's pitch."""
    template = field.template if isinstance(field.template, str) else field.template.model_dump()
    others = other_shapes([other.model_dump() for other in field.other_markings], size_of(dict(field)))
    ridge = None if field.ridge is None else np.array(field.ridge)
    size = field.length_m, field.width_m, field.line_width_m
    sigma: dict[str, float] = dict(field.sigma.items())
    plan = plan_of(template, field.uneven_m)
    return Field(*size, ridge, plan, field.measures_m, others=others, sigma=sigma)


def lens_of(lens: Intrinsics, image_size: list[int]) -> Lens:
    """Return the engine's lens."""
    matrix, distortion = np.array(lens.matrix, dtype=float), np.array(lens.distortion, dtype=float)
    size = image_size[0], image_size[1]
    return LENSES[lens.model](matrix, distortion, size, dict(lens.sigma or {}), lens.sigma_from)


def pose_of(pose: geometry.Pose) -> Pose:
    """Return the engine's pose."""
    return Pose(np.array(pose.rotation), np.array(pose.position))


def camera_of(camera: PosedCamera) -> Camera:
    """Return the engine's camera at its stored pose."""
    return Camera(camera.id, lens_of(camera.intrinsics, camera.image_size), pose_of(camera.pose))


def choice_of(choice: view.ViewChoice) -> ViewChoice:
    """Return the engine's choice of a stitched view."""
    size = choice.width_px, choice.height_px
    return ViewChoice(choice.projection, *size, choice.field_of_view_deg, choice.pan_deg, choice.horizon)


def light_of(light: geometry.Light) -> Light:
    """Return the engine's photometric correction of a camera, its colours from blue to red."""
    red, green, blue = light.gain
    return Light((blue, green, red), light.contrast, light.falloff, light.reach)


def camera_with_ignored_areas(camera: PosedCamera, ignore: Sequence[Sequence[Sequence[float]]]) -> Camera:
    """Return the engine's camera with the polygons of its frames that are to be ignored."""
    return replace(camera_of(camera), ignored=ignored_areas_of(ignore, camera.image_size))


def ignored_areas_of(ignore: Sequence[Sequence[Sequence[float]]], image_size: Sequence[int]) -> Ignored | None:
    """Return the engine's areas of a camera's frames that are to be ignored, or None without any."""
    width, height = image_size
    polygons = [np.array(polygon, dtype=float) for polygon in ignore]
    return Ignored(polygons, (width, height)) if polygons else None
