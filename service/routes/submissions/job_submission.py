"""Submission of jobs: the files of a form are checked, stored, and become a job."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, TypeVar

from fastapi import APIRouter, Depends, Header, Request, Response
from starlette.datastructures import UploadFile

from service.api.context import Context
from service.intake import image_checks
from service.intake.submit import frame_paths
from service.routes.contract.documented import header_docs, needs_scope
from service.routes.contract.problem_docs import problem_responses
from service.routes.jobs import job_response
from service.schemas.find import SoughtSite
from service.schemas.job import Job
from service.schemas.names import JobKind
from service.schemas.venue import Venue
from service.store.ids import new_id
from service.store.jobs.files import frame_path
from service.store.jobs.submission import Submission
from service.store.jobs.task import AnyOptions, Origin, kind_of, seeded

Endpoint = TypeVar("Endpoint", bound=Callable[..., Any])
# Files by camera; photos by name.
Files = Mapping[str, Sequence[UploadFile]]


@dataclass(frozen=True)
class Sender:
    """Origin of a request for a job, and its idempotency key: a request that is sent twice is one job."""

    idempotency_key: str | None
    origin: Origin


def _sender(
    request: Request,
    idempotency_key: Annotated[
        str | None,
        Header(
            pattern=r"^[\x21-\x7e]{1,255}$",
            description="The same key and the same content are the same job, for as long as that job is kept.",
        ),
    ] = None,
) -> Sender:
    return Sender(idempotency_key, request.state.origin)


FromSender = Annotated[Sender, Depends(_sender)]


def submits_job(
    router: APIRouter,
    path: str,
    body: Mapping[str, Any],
    problems: Sequence[str],
    known: str = "This content is already a job",
) -> Callable[[Endpoint], Endpoint]:
    """Return the decorator of a route that makes a job of a body; `known`: description where there is no new one."""
    responses: dict[int | str, dict[str, Any]] = {
        200: {"model": Job, "description": known, **header_docs("ETag")},
        202: header_docs("ETag", "Location", "Retry-After"),
    }
    return router.post(
        path,
        status_code=202,
        response_model=Job,
        responses=responses | problem_responses(*problems),
        openapi_extra={**body, **needs_scope("calibrate")},
    )


def submit_files(
    context: Context, about: Venue | SoughtSite | None, options: AnyOptions, files: Files, sender: Sender
) -> tuple[Job, bool]:
    """Check and store files and submit them; return the job, which may be an older one, and True if it is new.

    `about`: the venue, or the site of one that is not stored yet; None for photos of a lens and for a check.
    """
    submission = _submission(context, about, options, files, sender)

    def store() -> None:
        for name, paths in submission.frames.items():
            for path, upload in zip(paths, files[name], strict=True):
                with context.uploads.content(upload) as data:
                    context.blobs.put(path, data)
                # Or it would stay in memory together with the next one.
                del data

    return context.intake.take(submission, store)


def require_queue_room(context: Context, venue_id: str | None, kind: JobKind, sender: Sender) -> None:
    """Raise the problem `queue-full` for an upload that a full queue will refuse, before it is read."""
    context.submissions.require_place_for(venue_id, sender.idempotency_key, kind, context.settings.queue_limit)


def submission_response(job: Job, new: bool) -> Response:
    """Return 202 with a new job, 200 with one that the content already is."""
    return job_response(job, status=202 if new else 200)


def _submission(
    context: Context, about: Venue | SoughtSite | None, options: AnyOptions, files: Files, sender: Sender
) -> Submission:
    kind, job_id = kind_of(options), new_id()
    site = about if isinstance(about, SoughtSite) else None
    # The kind too: the same frames with the same key may be those of another job.
    asked = f"{kind} {options.model_dump_json()}" + ("" if site is None else f" {site.model_dump_json()}")
    content = hashlib.sha256(asked.encode())
    part = "photo" if kind == "intrinsics" else "camera"
    for name, upload in ((name, upload) for name, several in files.items() for upload in several):
        # All of them before the first is read: a size costs nothing.
        image_checks.check_length(upload.size or 0, context.settings, **{part: name})
    cameras = {camera.id: camera for camera in about.cameras} if about else {}
    budget = image_checks.PixelBudget(context.settings)
    # A camera without a frame is named all the same: points are enough for its pose.
    hashes: dict[str, list[str]] = {name: [] for name in files}
    for name, several in files.items():
        content.update(f"\n{name}".encode())
        for upload in several:
            with context.uploads.content(upload) as data:
                if kind == "intrinsics":
                    image_checks.check_whole(data, context.settings, photo=name)
                elif about is None:
                    budget.spend(image_checks.check_whole(data, context.settings, camera=name), camera=name)
                else:
                    resize = kind != "locate"
                    image_checks.check(cameras[name], data, context.settings, budget, of_any_size=resize)
                digest = hashlib.sha256(data)
                content.update(digest.digest())
                hashes[name].append(digest.hexdigest())
            del data
    # A photo may be called anything.
    photos = {
        name: [frame_path(job_id, "photos", number, one) for one in several]
        for number, (name, several) in enumerate(hashes.items())
    }
    return Submission(
        job_id=job_id,
        kind=kind,
        venue=None if isinstance(about, SoughtSite) else about,
        site=site,
        options=seeded(options),
        frames=photos if kind == "intrinsics" else frame_paths(job_id, hashes),
        origin=sender.origin,
        content_hash=content.hexdigest(),
        idempotency_key=sender.idempotency_key,
    )
