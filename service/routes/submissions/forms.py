"""Upload forms: checks before they are read, their options and their frames."""

import json
from collections import Counter
from collections.abc import AsyncIterator, Collection
from contextlib import asynccontextmanager
from typing import TypeVar

from fastapi import Request
from pydantic import ValidationError
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import FormData, UploadFile

from service.api.body_limit import is_form
from service.api.context import Context
from service.api.problems import validation_problem
from service.api.spool import Spool, parsed_form
from service.intake import image_checks
from service.routes.submissions.job_submission import Sender, require_queue_room
from service.schemas.base import Schema
from service.schemas.events import callback_urls
from service.schemas.find import SoughtSite
from service.schemas.names import OPTIONS_PART, JobKind
from service.schemas.options import Handling
from service.schemas.problems import Problem
from service.schemas.venue import Venue
from service.settings import Settings

LONGEST_OPTIONS = 64 * 1024
PARTS_TOO_MANY = 100
Chosen = TypeVar("Chosen", bound=Handling)
Document = TypeVar("Document", bound=Schema)


def is_empty(request: Request) -> bool:
    """True if a request has no body."""
    return request.headers.get("content-length", "0") == "0" and "transfer-encoding" not in request.headers


def has_no_frames(form: FormData) -> bool:
    """True if a form has no parts but options."""
    return all(name == OPTIONS_PART for name in form)


def require_disk_space(context: Context) -> None:
    """Raise the problem `disk-full` for an upload that would fill the disk, before it is read."""
    if context.disk.is_short():
        raise Problem(
            "disk-full",
            f"Less than {context.disk.min_free_bytes / 1e6:.0f} MB are free where the service keeps its files. Free "
            "some, keep frames and pictures for fewer days (ESC_KEEP_FRAMES_DAYS, ESC_KEEP_PICTURES_DAYS), or lower "
            "ESC_MIN_FREE_MB.",
        )


@asynccontextmanager
async def parsed_upload(
    request: Request, context: Context, venue_id: str | None, kind: JobKind, sender: Sender, most_files: int
) -> AsyncIterator[FormData]:
    """Yield the form of a request for a job, with so many files at most; a few too many get the answer that names them.

    Its files are on the disk; `context.uploads.content` reads one. Raises a problem before it reads what is no form, or
    what there is no room for, on the disk and in the queue.
    """
    await run_in_threadpool(require_disk_space, context)
    await run_in_threadpool(require_queue_room, context, venue_id, kind, sender)
    if not is_form(request):
        raise Problem("not-multipart", "Send each picture as a file part of a form, as curl -F does.")
    files = most_files + PARTS_TOO_MANY
    with context.uploads.admitted(request), Spool() as spool:
        yield await parsed_form(request, spool, files, PARTS_TOO_MANY, LONGEST_OPTIONS)


def parse_options(form: FormData, model: type[Chosen], settings: Settings) -> Chosen:
    """Return the part `options` of a form, or the default options without one."""
    options = parse_part(form, OPTIONS_PART, model, absent="{}")
    if options.callback_url is not None:
        callback_urls.check(options.callback_url, settings)
    return options


def parse_part(form: FormData, name: str, model: type[Document], absent: str = "null") -> Document:
    """Return the part of a form that is a JSON document, or the value of `absent` without one."""
    parts = form.getlist(name)
    if len(parts) > 1:
        raise Problem("invalid-request", f"Send one {name} part.", errors=[])
    part = parts[0] if parts else absent
    try:
        data: str | bytes = part.file.read(LONGEST_OPTIONS + 1) if isinstance(part, UploadFile) else part
        document = json.loads(data)
    except (ValueError, RecursionError):
        raise Problem("invalid-request", f"The {name} part is not JSON.", errors=[]) from None
    try:
        return model.model_validate(document)
    except ValidationError as error:
        raise validation_problem(error, model, document, name) from None


def frames_by_camera(
    place: Venue | SoughtSite,
    form: FormData,
    context: Context,
    needed: Collection[str] | None = None,
    documents: Collection[str] = (OPTIONS_PART,),
) -> dict[str, list[UploadFile]]:
    """Return the frames of each camera of a venue, in its order.

    `needed`: the cameras of which there must be some, None: all. `documents`: the parts that are no frames.
    """
    counts = Counter(name for name, _ in form.multi_items() if name not in documents)
    image_checks.check_cameras(place, counts, context.settings, needed)
    files = files_by_camera(form, documents)
    return {camera.id: files[camera.id] for camera in place.cameras if camera.id in files}


def files_by_camera(form: FormData, documents: Collection[str]) -> dict[str, list[UploadFile]]:
    """Return the parts of a form but those of `documents`, by their names; raises a problem for what is no file."""
    files: dict[str, list[UploadFile]] = {}
    for name, part in form.multi_items():
        if name in documents:
            continue
        if not isinstance(part, UploadFile):
            raise Problem("not-a-file", f"Send camera {name} as a file, with curl: -F {name}=@frame.jpg", camera=name)
        files.setdefault(name, []).append(part)
    return files
