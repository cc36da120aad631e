"""Photos of a board in, a job out that finds the lens."""

from __future__ import annotations

import hashlib
from pathlib import PurePath
from typing import Annotated, Any

from fastapi import APIRouter, Header, Request, Response
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import FormData, UploadFile

from service.api.context import Context, InContext
from service.intake import images as border
from service.routes import uploads
from service.routes.documented import headers, needs, problems, reference
from service.routes.guarded import Guarded
from service.routes.jobs import job_answer
from service.store.ids import new_id
from service.store.jobs import Origin, Submission, frame_folder
from service.wire import callback_urls
from service.wire.base import OPTIONS_PART, PHOTOS_PART
from service.wire.job import Job
from service.wire.options import IntrinsicsOptions
from service.wire.problems import Problem

router = APIRouter(tags=["jobs"], route_class=Guarded)

LONGEST_NAME = 100
UPLOAD: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "content": {
            "multipart/form-data": {
                "schema": {
                    "type": "object",
                    "description": "JPEG or PNG photos of one board, all by one camera in one size, each a part "
                    "`photos` with its file name.",
                    "properties": {
                        OPTIONS_PART: reference(IntrinsicsOptions),
                        PHOTOS_PART: {"type": "array", "items": {"type": "string", "format": "binary"}},
                    },
                    "required": [OPTIONS_PART, PHOTOS_PART],
                    "additionalProperties": False,
                },
                "encoding": {OPTIONS_PART: {"contentType": "application/json"}},
            }
        },
    }
}


@router.post(
    "/intrinsics",
    status_code=202,
    response_model=Job,
    responses={
        200: {"model": Job, "description": "This content is already a job", **headers("ETag")},
        202: headers("ETag", "Location", "Retry-After"),
        **problems(400, 408, 413, 415, 422, 429, 507),
    },
    openapi_extra=UPLOAD | needs("calibrate"),
)
async def intrinsics(
    request: Request,
    context: InContext,
    idempotency_key: Annotated[
        str | None, Header(pattern=uploads.KEY_PATTERN, description=uploads.KEY_DESCRIPTION)
    ] = None,
) -> Response:
    """Submit photos of a board: the job's result is the lens of the camera that took them, `coverage.jpg` its basis."""
    uploads.require_form(request)
    await run_in_threadpool(uploads.require_room, context)
    async with uploads.form_of(request, context.settings.max_photos) as form:
        return await run_in_threadpool(_submit, context, form, idempotency_key, request.state.origin)


def _submit(context: Context, form: FormData, idempotency_key: str | None, origin: Origin) -> Response:
    options = uploads.options_of(form, IntrinsicsOptions)
    if options.callback_url is not None:
        callback_urls.check(options.callback_url, context.settings)
    files = _photos(form, context)
    sent = hashlib.sha256(b"intrinsics " + options.model_dump_json().encode())
    for name, (photo,) in files.items():
        data = photo.file.read()
        border.check_photo(name, data, context.settings)
        sent.update(f"\n{name} {hashlib.sha256(data).hexdigest()}".encode())
    job_id = new_id()
    # A file may be called anything.
    paths = {name: [f"{frame_folder(job_id)}/photos/{number}"] for number, name in enumerate(files)}
    submission = Submission(job_id, None, options, sent.hexdigest(), idempotency_key, paths, "intrinsics", origin)
    job, new = uploads.enqueue_upload(context, submission, files, context.queue.enqueue)
    return job_answer(job, status=202 if new else 200)


def _photos(form: FormData, context: Context) -> dict[str, list[UploadFile]]:
    """The photos by their names, those that share one told apart by a number."""
    files: dict[str, list[UploadFile]] = {}
    for part_name, part in form.multi_items():
        if part_name == OPTIONS_PART:
            continue
        if part_name != PHOTOS_PART or not isinstance(part, UploadFile):
            raise Problem(
                "not-a-file",
                f"Send each photo as a file part named {PHOTOS_PART}, with curl: -F {PHOTOS_PART}=@board1.jpg",
                got=part_name[:64],
            )
        name = printable_name(part.filename, len(files))
        files[name if name not in files else f"{name} ({len(files) + 1})"] = [part]
    if not files:
        raise Problem("missing-photos", f"Send photos of the board as file parts named {PHOTOS_PART}.")
    if len(files) > context.settings.max_photos:
        raise Problem(
            "too-many-photos",
            f"Send at most {context.settings.max_photos} photos; 15 to 30 good ones are enough.",
            expected=context.settings.max_photos,
            got=len(files),
        )
    return files


def printable_name(filename: str | None, number: int) -> str:
    """The last part of a file name, as far as it can be printed."""
    last = PurePath((filename or "").replace("\\", "/")).name
    shown = "".join(letter for letter in last if letter.isprintable())[-LONGEST_NAME:]
    return shown or f"photo {number + 1}"
