"""Frames in, a job out: checked here once, stored, and queued before the answer leaves."""

from __future__ import annotations

import hashlib
import secrets
from typing import Annotated, Any

from fastapi import APIRouter, Header, Request, Response
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import FormData, UploadFile

from service import callbacks
from service import frames as border
from service.context import Context, InContext, VenueIdPath
from service.problems import Problem
from service.routes import uploads
from service.routes.documented import needs, problems, reference
from service.routes.guarded import Guarded
from service.routes.jobs import job_answer
from service.routes.venues import no_such_venue
from service.schemas import OPTIONS_PART, Job, Options, Venue
from service.store.jobs import Submission, new_job_id

router = APIRouter(tags=["jobs"], route_class=Guarded)

UPLOAD: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "description": "A JPEG or PNG file per camera, the part named by the camera's id; repeat a part "
                    "to send several frames of a camera, they are fused.",
                    "properties": {OPTIONS_PART: reference(Options)},
                    "additionalProperties": {"type": "array", "items": {"type": "string", "format": "binary"}},
                },
                "encoding": {OPTIONS_PART: {"contentType": "application/json"}},
            }
        },
    }
}


@router.post(
    "/venues/{venue_id}/calibrate",
    status_code=202,
    response_model=Job,
    responses={
        200: {"model": Job, "description": "This content is already a job"},
        **problems(404, 409, 413, 415, 422, 429, 507),
    },
    openapi_extra=UPLOAD | needs("calibrate"),
)
async def calibrate(
    venue_id: VenueIdPath,
    request: Request,
    context: InContext,
    idempotency_key: Annotated[
        str | None, Header(pattern=uploads.KEY_PATTERN, description=uploads.KEY_DESCRIPTION)
    ] = None,
) -> Response:
    """Submit a frame (or several) per camera. Follow the job at `Location`."""
    uploads.require_form(request)
    stored = await run_in_threadpool(expecting, context, venue_id)
    # A form's files beyond 1 MB are spooled to disk, so what is in memory is one frame at a time.
    async with request.form(
        max_files=uploads.MOST_FILES, max_fields=uploads.MOST_FIELDS, max_part_size=uploads.LONGEST_OPTIONS
    ) as form:
        return await run_in_threadpool(submit, context, stored, form, idempotency_key)


def expecting(context: Context, venue_id: str) -> Venue:
    """The venue that frames arrive for, if there is room for them: the upload is not read before."""
    stored = context.venues.get(venue_id)
    if stored is None:
        raise no_such_venue(venue_id)
    uploads.require_room(context)
    return stored


def submit(context: Context, venue: Venue, form: FormData, idempotency_key: str | None) -> Response:
    """Make a form a job of `venue`, which is the venue as it was before the form arrived."""
    options = uploads.options_of(form, Options)
    if options.callback_url is not None:
        callbacks.check(options.callback_url, context.settings)
    files = _files(venue, form, context)
    content_hash = _check(context, venue, files, options)
    job_id = new_job_id()
    seeded = options if options.seed is not None else options.model_copy(update={"seed": secrets.randbelow(2**31)})
    submission = Submission(job_id, venue, seeded, content_hash, idempotency_key, uploads.frame_paths(job_id, files))
    job, new = uploads.enqueue_upload(context, submission, files, context.queue.enqueue)
    return job_answer(job, status=202 if new else 200)


def _files(venue: Venue, form: FormData, context: Context) -> dict[str, list[UploadFile]]:
    names = [name for name, _ in form.multi_items() if name != OPTIONS_PART]
    border.check_cameras(venue, {name: names.count(name) for name in names}, context.settings)
    files: dict[str, list[UploadFile]] = {camera.id: [] for camera in venue.cameras}
    for name, part in form.multi_items():
        if name == OPTIONS_PART:
            continue
        if not isinstance(part, UploadFile):
            raise Problem("not-a-file", f"Send camera {name} as a file, with curl: -F {name}=@frame.jpg", camera=name)
        files[name].append(part)
    return files


def _check(context: Context, venue: Venue, files: dict[str, list[UploadFile]], options: Options) -> str:
    """Let each frame pass the border; returns the hash of all that was sent."""
    sent = hashlib.sha256(options.model_dump_json().encode())
    for camera in venue.cameras:
        for file in files[camera.id]:
            data = file.file.read()
            border.check(camera, data, context.settings)
            sent.update(f"\n{camera.id} {hashlib.sha256(data).hexdigest()}".encode())
    return sent.hexdigest()
