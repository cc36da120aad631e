"""Clicked points in, a job out that finds where a camera stands."""

from __future__ import annotations

import hashlib
from typing import Annotated, Any

from fastapi import APIRouter, Header, Path, Query, Request, Response
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import FormData, UploadFile

from service.api.context import Context, InContext, VenueIdPath
from service.intake import images as border
from service.routes import uploads
from service.routes.calibrate import expecting
from service.routes.documented import headers, needs, problems, reference
from service.routes.guarded import Guarded
from service.routes.jobs import LONGEST_WAIT_S, job_answer
from service.store.ids import new_id
from service.store.jobs import Origin, Submission
from service.wire import callback_urls
from service.wire.base import ID_PATTERN, OPTIONS_PART
from service.wire.job import OPEN, Job
from service.wire.options import LocateOptions
from service.wire.problems import Problem
from service.wire.venue import Camera, Venue

router = APIRouter(tags=["jobs"], route_class=Guarded)

UPLOAD: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "description": "The points, and if you like the frame they were clicked in, its part named by the "
                    "camera's id: then `points.jpg` shows them in it.",
                    "properties": {OPTIONS_PART: reference(LocateOptions)},
                    "required": [OPTIONS_PART],
                    "additionalProperties": {"type": "string", "format": "binary"},
                },
                "encoding": {OPTIONS_PART: {"contentType": "application/json"}},
            }
        },
    }
}


@router.post(
    "/venues/{venue_id}/cameras/{camera}/locate",
    status_code=202,
    response_model=Job,
    responses={
        200: {"model": Job, "description": "The job has ended, or this content is already a job", **headers("ETag")},
        202: headers("ETag", "Location", "Retry-After"),
        **problems(400, 404, 408, 409, 413, 415, 422, 429, 507),
    },
    openapi_extra=UPLOAD | needs("calibrate"),
)
async def locate(
    venue_id: VenueIdPath,
    camera: Annotated[str, Path(pattern=ID_PATTERN)],
    request: Request,
    context: InContext,
    wait: Annotated[
        float, Query(ge=0, allow_inf_nan=False, description="Seconds that the answer is held, at most 60.")
    ] = 0,
    idempotency_key: Annotated[
        str | None, Header(pattern=uploads.KEY_PATTERN, description=uploads.KEY_DESCRIPTION)
    ] = None,
) -> Response:
    """Find the first pose of a camera from points of the pitch and their pixels. The stored pose stays as it is.

    The job takes about a second and waits for no calibration; with `wait` the answer is its end.
    """
    uploads.require_form(request)
    stored = await run_in_threadpool(expecting, context, venue_id)
    async with uploads.form_of(request, 1) as form:
        origin = request.state.origin
        job, new = await run_in_threadpool(_submit, context, stored, camera, form, idempotency_key, origin)
    if wait and job.open:
        await context.watch.until(job.id, lambda state: state.status not in OPEN, min(wait, LONGEST_WAIT_S))
        ended: Job | None = await run_in_threadpool(context.jobs.get, job.id)
        job = ended or job
    return job_answer(job, status=202 if new and job.open else 200)


def _submit(
    context: Context, venue: Venue, camera_id: str, form: FormData, idempotency_key: str | None, origin: Origin
) -> tuple[Job, bool]:
    camera = _camera(venue, camera_id)
    options = uploads.options_of(form, LocateOptions)
    if options.callback_url is not None:
        callback_urls.check(options.callback_url, context.settings)
    files = {camera_id: _frame(camera, form)}
    sent = hashlib.sha256(f"locate {camera_id} {options.model_dump_json()}".encode())
    for frame in files[camera_id]:
        data = frame.file.read()
        border.check(camera, data, context.settings)
        sent.update(hashlib.sha256(data).digest())
    job_id = new_id()
    paths = uploads.frame_paths(job_id, files)
    submission = Submission(job_id, venue, options, sent.hexdigest(), idempotency_key, paths, "locate", origin)
    return uploads.enqueue_upload(context, submission, files, context.queue.enqueue_light)


def _camera(venue: Venue, camera_id: str) -> Camera:
    for camera in venue.cameras:
        if camera.id == camera_id:
            return camera
    ids = [camera.id for camera in venue.cameras]
    raise Problem(
        "no-such-camera", f"Venue {venue.id} has the cameras {', '.join(ids)}.", camera=camera_id, expected=ids
    )


def _frame(camera: Camera, form: FormData) -> list[UploadFile]:
    """The frame that was sent, or none."""
    frames = []
    for name, part in form.multi_items():
        if name == OPTIONS_PART:
            continue
        if name != camera.id:
            raise Problem(
                "unknown-camera",
                f"A frame of camera {camera.id} is a part named {camera.id}.",
                camera=name[:64],
                expected=[camera.id],
            )
        if not isinstance(part, UploadFile):
            raise Problem("not-a-file", f"Send the frame as a file, with curl: -F {name}=@frame.jpg", camera=name)
        frames.append(part)
    if len(frames) > 1:
        raise Problem(
            "too-many-frames",
            f"Send the one frame of camera {camera.id} that the points were clicked in.",
            camera=camera.id,
            expected=1,
            got=len(frames),
        )
    return frames
