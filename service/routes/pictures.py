"""The pictures of jobs, and the layers that can be laid over them."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Path, Response

from service.api.context import Context, InContext
from service.routes.contract.documented import needs, problems
from service.routes.contract.guarded import Guarded
from service.routes.jobs import Existing
from service.store.jobs.files import picture_file
from service.store.jobs.reading import Pictures
from service.wire.base import ID_PATTERN
from service.wire.job import Job
from service.wire.problems import Problem

router = APIRouter(prefix="/jobs", tags=["jobs"], route_class=Guarded)

CameraPath = Annotated[str, Path(pattern=ID_PATTERN)]
PNG = "image/png"


def _answers(media_type: str = "image/jpeg") -> dict[str, Any]:
    """Arguments of a picture's route."""
    content = {media_type: {"schema": {"type": "string", "format": "binary"}}}
    responses = {200: {"content": content}, **problems(404, 410)}
    return {"openapi_extra": needs("read"), "response_class": Response, "responses": responses}


@router.get("/{job_id}/preview.jpg", **_answers())
def preview(job: Existing, context: InContext) -> Response:
    """One wide view stitched from all cameras."""
    return _picture(context, job, "preview")


@router.get("/{job_id}/preview/before.jpg", **_answers())
def preview_before(job: Existing, context: InContext) -> Response:
    """The same view by the stored poses."""
    return _picture(context, job, "preview_before")


@router.get("/{job_id}/seam.png", **_answers(PNG))
def seam(job: Existing, context: InContext) -> Response:
    """Over the stitched view: where one camera hands over to another."""
    return _picture(context, job, "seam")


@router.get("/{job_id}/birdseye.jpg", **_answers())
def birdseye(job: Existing, context: InContext) -> Response:
    """The pitch from above, 10 px/m, more of small ones."""
    return _picture(context, job, "birdseye")


@router.get("/{job_id}/overlay/{camera}.jpg", **_answers())
def overlay(job: Existing, camera: CameraPath, context: InContext) -> Response:
    """A camera's frame with the field drawn on it, before and after."""
    return _picture(context, job, f"overlay_{camera}")


@router.get("/{job_id}/frame/{camera}.jpg", **_answers())
def frame(job: Existing, camera: CameraPath, context: InContext) -> Response:
    """A camera's frame, at most 1920 pixels wide, which the three layers are for."""
    return _picture(context, job, f"frame_{camera}")


@router.get("/{job_id}/stored/{camera}.png", **_answers(PNG))
def stored_layer(job: Existing, camera: CameraPath, context: InContext) -> Response:
    """Over a camera's frame: the field by the pose that was stored."""
    return _picture(context, job, f"stored_{camera}")


@router.get("/{job_id}/new/{camera}.png", **_answers(PNG))
def new_layer(job: Existing, camera: CameraPath, context: InContext) -> Response:
    """Over a camera's frame: the field by the pose that was found."""
    return _picture(context, job, f"new_{camera}")


@router.get("/{job_id}/mask/{camera}.png", **_answers(PNG))
def mask_layer(job: Existing, camera: CameraPath, context: InContext) -> Response:
    """Over a camera's frame: where the network saw markings."""
    return _picture(context, job, f"mask_{camera}")


@router.get("/{job_id}/coverage.jpg", **_answers())
def coverage(job: Existing, context: InContext) -> Response:
    """Of the intrinsics of a lens: where in the picture the board was seen, and residuals enlarged."""
    return _picture(context, job, "coverage")


@router.get("/{job_id}/points.jpg", **_answers())
def points(job: Existing, context: InContext) -> Response:
    """Of a first pose: the clicked points and the pitch as the pose has it, in the frame if one was sent."""
    return _picture(context, job, "points")


def _picture(context: Context, job: Job, name: str) -> Response:
    pictures = context.jobs.pictures(job.id)
    if pictures is None or name not in pictures.names:
        detail = "The job has not come to its pictures yet." if job.open else "The job made no such picture."
        raise Problem("picture-not-found", detail, job=job.id)
    file = picture_file(name)
    data = None if pictures.deleted else context.blobs.get(f"{pictures.folder}/{file}")
    if data is None:
        raise Problem("picture-deleted", _why_deleted(pictures, context.settings.keep_pictures_days), job=job.id)
    media_type = PNG if file.endswith(".png") else "image/jpeg"
    return Response(data, media_type=media_type, headers={"Cache-Control": "private, max-age=3600"})


def _why_deleted(pictures: Pictures, keep_days: float) -> str:
    if pictures.deleted:
        return f"Pictures are deleted {keep_days:g} days after the end of their job; the job and its numbers stay."
    return "The job made it, but its file is gone from the store, and not by the service."
