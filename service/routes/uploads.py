"""What all routes that take pictures share: the form, its options, its files, and the job it becomes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from contextlib import AbstractAsyncContextManager
from typing import TypeVar

from fastapi import Request
from pydantic import BaseModel, ValidationError
from starlette.datastructures import FormData, UploadFile

from service.api.context import Context
from service.api.problems import invalid
from service.intake import images as border
from service.intake import submit
from service.intake.submit import REFUSALS, Enqueue, Refusal
from service.routes.jobs import RETRY_AFTER_S
from service.routes.venues import no_such_venue
from service.settings import Settings
from service.store.jobs import (
    KeyReused,
    QueueFull,
    Submission,
    VenueBusy,
    VenueGone,
    VenueReplaced,
)
from service.wire.base import OPTIONS_PART
from service.wire.job import Job
from service.wire.problems import Problem
from service.wire.venue import Venue

KEY_PATTERN = r"^[\x21-\x7e]{1,255}$"
KEY_DESCRIPTION = "The same key and the same content are the same job, for as long as that job is kept."
LONGEST_OPTIONS = 64 * 1024
PARTS_TOO_MANY = 100
M = TypeVar("M", bound=BaseModel)


def require_form(request: Request) -> None:
    """Refuse what is no form before it is read."""
    if not request.headers.get("content-type", "").lower().startswith("multipart/form-data"):
        raise Problem("not-multipart", "Send each picture as a file part of a form, as curl -F does.")


def is_empty(request: Request) -> bool:
    """Whether a request has no body."""
    return request.headers.get("content-length", "0") == "0" and "transfer-encoding" not in request.headers


def has_no_frames(form: FormData) -> bool:
    """Whether a form has options at most."""
    return all(name == OPTIONS_PART for name in form)


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
    context: Context, submission: Submission, files: Mapping[str, Sequence[UploadFile]], enqueue: Enqueue
) -> tuple[Job, bool]:
    """Store the files of a checked submission and make it a job, or find the job it already is; says if it is new."""
    try:
        opened = {name: [upload.file for upload in several] for name, several in files.items()}
        return context.intake.take(submission, opened, enqueue)
    except REFUSALS as refusal:
        raise in_words(refusal, "" if submission.venue is None else submission.venue.id, context.settings) from None


def frame_paths(job_id: str, files: Mapping[str, Sequence[UploadFile]]) -> dict[str, list[str]]:
    """Where the frames of a job will lie, by camera."""
    return submit.frame_paths(job_id, {camera: len(several) for camera, several in files.items()})


def in_words(refusal: Refusal, venue_id: str, settings: Settings) -> Problem:
    """Why a submission becomes no job."""
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
            waiting = settings.queue_limit
            return Problem("queue-full", f"{waiting} jobs wait; try again.", headers={"Retry-After": "30"})
