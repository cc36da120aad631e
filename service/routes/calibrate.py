"""Frames in, a job out: checked here once, stored, and queued before the answer leaves."""

from __future__ import annotations

import hashlib
import json
import secrets
from datetime import timedelta
from typing import Annotated, Any

from fastapi import APIRouter, Header, Request, Response
from pydantic import ValidationError
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import FormData, UploadFile

from service import callbacks
from service import frames as border
from service.context import Context, InContext, VenueIdPath
from service.problems import Problem, invalid
from service.routes.documented import headers, needs, problems, reference
from service.routes.guarded import Guarded
from service.routes.jobs import RETRY_AFTER_S, job_answer
from service.routes.venues import no_such_venue
from service.schemas import OPTIONS_PART, Job, Options, Venue
from service.store.jobs import (
    KeyReused,
    Origin,
    QueueFull,
    Submission,
    VenueBusy,
    VenueGone,
    VenueReplaced,
    frame_folder,
    new_job_id,
)

router = APIRouter(tags=["jobs"], route_class=Guarded)

KEY_PATTERN = r"^[\x21-\x7e]{1,255}$"
KEY_DESCRIPTION = "The same key and the same content are the same job, for as long as that job is kept."
LONGEST_OPTIONS = 64 * 1024
PARTS_TOO_MANY = 100
# Longer than any upload takes from its first stored frame to its job.
UPLOAD_GRACE = timedelta(hours=1)
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
                    # Not an array: generators write code for a repeated part of any name that does not compile.
                    "additionalProperties": {"type": "string", "format": "binary"},
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
        200: {"model": Job, "description": "This content is already a job", **headers("ETag")},
        202: headers("ETag", "Location", "Retry-After"),
        **problems(400, 404, 408, 409, 413, 415, 422, 429, 507),
    },
    openapi_extra=UPLOAD | needs("calibrate"),
)
async def calibrate(
    venue_id: VenueIdPath,
    request: Request,
    context: InContext,
    idempotency_key: Annotated[str | None, Header(pattern=KEY_PATTERN, description=KEY_DESCRIPTION)] = None,
) -> Response:
    """Submit a frame (or several) per camera. Follow the job at `Location`."""
    if not request.headers.get("content-type", "").lower().startswith("multipart/form-data"):
        raise Problem("not-multipart", "Send each frame as a file part named by its camera, as curl -F does.")
    stored = await run_in_threadpool(_expecting, context, venue_id)
    # A form's files beyond 1 MB are spooled to disk, so what is in memory is one frame at a time. A few parts too many
    # get the answer that names their camera.
    most = len(stored.cameras) * context.settings.max_frames_per_camera + PARTS_TOO_MANY
    async with request.form(max_files=most, max_fields=PARTS_TOO_MANY, max_part_size=LONGEST_OPTIONS) as form:
        return await run_in_threadpool(submit, context, stored, form, idempotency_key, request.state.origin)


def _expecting(context: Context, venue_id: str) -> Venue:
    """The venue that frames arrive for, if there is room for them: the upload is not read before."""
    stored = context.venues.get(venue_id)
    if stored is None:
        raise no_such_venue(venue_id)
    if context.disk.short():
        raise Problem(
            "disk-full",
            f"Less than {context.disk.least_bytes / 1e6:.0f} MB are free where the service keeps its files. Free some, "
            "keep frames and pictures for fewer days (ESC_KEEP_FRAMES_DAYS, ESC_KEEP_PICTURES_DAYS), or lower "
            "ESC_MIN_FREE_MB.",
        )
    return stored


def submit(context: Context, venue: Venue, form: FormData, idempotency_key: str | None, origin: Origin) -> Response:
    """Make a form a job of `venue`, which is the venue as it was before the form arrived."""
    options = _options(form)
    if options.callback_url is not None:
        callbacks.check(options.callback_url, context.settings)
    files = _files(venue, form, context)
    content_hash = _check(context, venue, files, options)
    job_id = new_job_id()
    try:
        known = context.jobs.same_as(venue.id, idempotency_key, content_hash)
        if known is not None:
            return job_answer(known)
        seeded = options if options.seed is not None else options.model_copy(update={"seed": secrets.randbelow(2**31)})
        # On the list of what is to be deleted before the first byte is stored, off it in the job's own transaction.
        context.expiry.expect_upload(job_id, UPLOAD_GRACE)
        paths = _store(context, job_id, files)
        submission = Submission(job_id, venue, seeded, content_hash, idempotency_key, paths, origin)
        job, new = context.jobs.submit(submission, context.settings.queue_limit, context.queue.enqueue)
    except (KeyReused, VenueBusy, VenueGone, VenueReplaced, QueueFull) as refusal:
        context.blobs.delete_under(frame_folder(job_id))
        raise _in_words(refusal, venue, context) from None
    if not new:
        context.blobs.delete_under(frame_folder(job_id))
    # After any other error the frames stay: whether the transaction was committed is then not known.
    return job_answer(job, status=202 if new else 200)


def _in_words(
    refusal: KeyReused | VenueBusy | VenueGone | VenueReplaced | QueueFull, venue: Venue, context: Context
) -> Problem:
    match refusal:
        case KeyReused():
            return Problem("idempotency-key-reused", "Use a new key for new frames.", job=refusal.job_id)
        case VenueBusy():
            return Problem(
                "venue-busy",
                f"Wait for job {refusal.job_id} of the same venue or cancel it.",
                headers={"Retry-After": str(RETRY_AFTER_S), "Location": f"/jobs/{refusal.job_id}"},
                job=refusal.job_id,
            )
        case VenueGone():
            return no_such_venue(venue.id)
        case VenueReplaced():
            return Problem(
                "venue-replaced",
                "Its pitch, cameras or lenses were changed while the frames arrived; see that they fit and send again.",
                headers={"Retry-After": str(RETRY_AFTER_S)},
            )
        case QueueFull():
            waiting = context.settings.queue_limit
            return Problem("queue-full", f"{waiting} jobs wait; try again.", headers={"Retry-After": "30"})


def _options(form: FormData) -> Options:
    parts = form.getlist(OPTIONS_PART)
    if not parts:
        return Options()
    if len(parts) > 1:
        raise Problem("invalid-request", "Send one options part.", errors=[])
    part = parts[0]
    try:
        data: str | bytes = part.file.read(LONGEST_OPTIONS + 1) if isinstance(part, UploadFile) else part
        return Options.model_validate(json.loads(data))
    except ValidationError as error:
        raise invalid(error, OPTIONS_PART) from None
    except (ValueError, RecursionError):
        raise Problem("invalid-request", "The options part is not JSON.", errors=[]) from None


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


def _store(context: Context, job_id: str, files: dict[str, list[UploadFile]]) -> dict[str, list[str]]:
    paths: dict[str, list[str]] = {}
    for camera, uploads in files.items():
        paths[camera] = []
        for number, file in enumerate(uploads):
            path = f"{frame_folder(job_id)}/{camera}/{number}"
            file.file.seek(0)
            context.blobs.put(path, file.file.read())
            paths[camera].append(path)
    return paths
