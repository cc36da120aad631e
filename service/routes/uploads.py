"""What all routes that take pictures share: the form, its options, its files, and the job it becomes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractAsyncContextManager
from datetime import timedelta
from typing import TypeVar

import sqlalchemy as sa
from fastapi import Request
from pydantic import BaseModel, ValidationError
from starlette.datastructures import FormData, UploadFile

from service import frames as border
from service.context import Context
from service.problems import Problem, invalid
from service.routes.jobs import RETRY_AFTER_S
from service.routes.venues import no_such_venue
from service.schemas import OPTIONS_PART, Job, Venue
from service.store.jobs import (
    KeyReused,
    QueueFull,
    Submission,
    VenueBusy,
    VenueGone,
    VenueReplaced,
    frame_folder,
)

KEY_PATTERN = r"^[\x21-\x7e]{1,255}$"
KEY_DESCRIPTION = "The same key and the same content are the same job, for as long as that job is kept."
LONGEST_OPTIONS = 64 * 1024
PARTS_TOO_MANY = 100
# Longer than any upload takes from its first stored frame to its job.
UPLOAD_GRACE = timedelta(hours=1)
M = TypeVar("M", bound=BaseModel)


def require_form(request: Request) -> None:
    """Refuse what is no form before it is read."""
    if not request.headers.get("content-type", "").lower().startswith("multipart/form-data"):
        raise Problem("not-multipart", "Send each picture as a file part of a form, as curl -F does.")


def require_room(context: Context) -> None:
    """Refuse an upload that would fill the disk before it is read."""
    if context.disk.short():
        raise Problem(
            "disk-full",
            f"Less than {context.disk.least_bytes / 1e6:.0f} MB are free where the service keeps its files. Free some, "
            "keep frames and pictures for fewer days (ESC_KEEP_FRAMES_DAYS, ESC_KEEP_PICTURES_DAYS), or lower "
            "ESC_MIN_FREE_MB.",
        )


def form_of(request: Request, most_files: int) -> AbstractAsyncContextManager[FormData]:
    """The form of a request, with so many files at most; a few too many get the answer that names them."""
    # A form's files beyond 1 MB are spooled to disk, so what is in memory is one frame at a time.
    return request.form(max_files=most_files + PARTS_TOO_MANY, max_fields=PARTS_TOO_MANY, max_part_size=LONGEST_OPTIONS)


def most_frames(context: Context, venue: Venue) -> int:
    """How many frames the cameras of a venue may have together."""
    return len(venue.cameras) * context.settings.max_frames_per_camera


def options_of(form: FormData, model: type[M]) -> M:
    """The part `options`; without one, what the model is when nothing is chosen."""
    parts = form.getlist(OPTIONS_PART)
    if len(parts) > 1:
        raise Problem("invalid-request", "Send one options part.", errors=[])
    part = parts[0] if parts else "{}"
    try:
        data: str | bytes = part.file.read(LONGEST_OPTIONS + 1) if isinstance(part, UploadFile) else part
        return model.model_validate(json.loads(data))
    except ValidationError as error:
        raise invalid(error, OPTIONS_PART) from None
    except (ValueError, RecursionError):
        raise Problem("invalid-request", "The options part is not JSON.", errors=[]) from None


def frames_of(venue: Venue, form: FormData, context: Context) -> dict[str, list[UploadFile]]:
    """The frames of each camera of a venue, none of which may be missing."""
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


def checked(context: Context, venue: Venue, files: dict[str, list[UploadFile]], options: BaseModel) -> str:
    """Let each frame pass the border; returns the hash of all that was sent."""
    sent = hashlib.sha256(options.model_dump_json().encode())
    for camera in venue.cameras:
        for file in files[camera.id]:
            data = file.file.read()
            border.check(camera, data, context.settings)
            sent.update(f"\n{camera.id} {hashlib.sha256(data).hexdigest()}".encode())
    return sent.hexdigest()


def enqueue_upload(
    context: Context,
    submission: Submission,
    files: Mapping[str, Sequence[UploadFile]],
    enqueue: Callable[[sa.Connection, str, int], None],
) -> tuple[Job, bool]:
    """Store the files of a checked submission and make it a job, or find the job it already is; says if it is new."""
    venue_id = None if submission.venue is None else submission.venue.id
    try:
        known = context.jobs.same_as(venue_id, submission.idempotency_key, submission.content_hash, submission.kind)
        if known is not None:
            return known, False
        # On the list of what is to be deleted before the first byte is stored, off it in the job's own transaction.
        context.expiry.expect_upload(submission.job_id, UPLOAD_GRACE)
        _store(context, submission, files)
        job, new = context.jobs.submit(submission, context.settings.queue_limit, enqueue)
    except (KeyReused, VenueBusy, VenueGone, VenueReplaced, QueueFull) as refusal:
        context.blobs.delete_under(frame_folder(submission.job_id))
        raise _in_words(refusal, venue_id or "", context) from None
    if not new:
        context.blobs.delete_under(frame_folder(submission.job_id))
    # After any other error the frames stay: whether the transaction was committed is then not known.
    return job, new


def frame_paths(job_id: str, files: Mapping[str, Sequence[UploadFile]]) -> dict[str, list[str]]:
    """Where the frames of a job will lie, by camera."""
    return {
        camera: [f"{frame_folder(job_id)}/{camera}/{number}" for number in range(len(frames))]
        for camera, frames in files.items()
    }


def _store(context: Context, submission: Submission, files: Mapping[str, Sequence[UploadFile]]) -> None:
    for name, uploads in files.items():
        for path, file in zip(submission.frames[name], uploads, strict=True):
            file.file.seek(0)
            context.blobs.put(path, file.file.read())


def _in_words(
    refusal: KeyReused | VenueBusy | VenueGone | VenueReplaced | QueueFull, venue_id: str, context: Context
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
            return no_such_venue(venue_id)
        case VenueReplaced():
            return Problem(
                "venue-replaced",
                "Its pitch, cameras or lenses were changed while the frames arrived; see that they fit and send again.",
                headers={"Retry-After": str(RETRY_AFTER_S)},
            )
        case QueueFull():
            waiting = context.settings.queue_limit
            return Problem("queue-full", f"{waiting} jobs wait; try again.", headers={"Retry-After": "30"})
