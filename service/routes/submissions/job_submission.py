"""What all routes that take pictures share once the form is there: its files are checked, stored, and become a job."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Header, Request, Response
from starlette.datastructures import UploadFile

from service.api.context import Context
from service.intake import image_checks
from service.intake.submit import frame_paths
from service.routes.contract.missing import no_such_venue
from service.routes.jobs import job_response
from service.routes.venues import RETRY_AFTER_S, venue_busy
from service.schemas.find import SoughtSite
from service.schemas.job import Job
from service.schemas.names import JobKind
from service.schemas.problems import Problem
from service.schemas.venue import Venue
from service.settings import Settings
from service.store.ids import new_id
from service.store.jobs.files import frame_path
from service.store.jobs.submission import (
    KeyReused,
    QueueFull,
    Submission,
    SubmissionRefused,
    VenueBusy,
    VenueGone,
    VenueReplaced,
    VenueStored,
)
from service.store.jobs.task import AnyOptions, Origin, kind_of, seeded

# By camera, of photos by their names.
Files = Mapping[str, Sequence[UploadFile]]


@dataclass(frozen=True)
class Sender:
    """Whom a job comes from, and what they call it so that it is one job if they send it twice."""

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


def submit_files(
    context: Context, about: Venue | SoughtSite | None, options: AnyOptions, files: Files, sender: Sender
) -> tuple[Job, bool]:
    """Check and store the files, and make them a job or find the job that they already are; says if it is new.

    `about`: the venue, or one that is not stored yet; None: photos of a lens are about none.
    """
    submission = _submission(context, about, options, files, sender)

    def store() -> None:
        for name, paths in submission.frames.items():
            for path, upload in zip(paths, files[name], strict=True):
                with context.uploads.content(upload) as data:
                    context.blobs.put(path, data)
                # Or it would lie beside the next one.
                del data

    return enqueue(context, submission, store)


def enqueue(context: Context, submission: Submission, store: Callable[[], None]) -> tuple[Job, bool]:
    """A submission as a job, or the job that it already is; says if it is new. `store` puts its frames in place."""
    try:
        return context.intake.take(submission, store)
    except SubmissionRefused as refusal:
        raise refusal_problem(refusal, submission.venue_id or "", context.settings) from None


def require_queue_room(context: Context, venue_id: str | None, kind: JobKind, sender: Sender) -> None:
    """Refuse an upload that a full queue will refuse, before it is read."""
    try:
        context.submissions.require_place_for(venue_id, sender.idempotency_key, kind, context.settings.queue_limit)
    except QueueFull as full:
        raise refusal_problem(full, venue_id or "", context.settings) from None


def submission_response(job: Job, new: bool) -> Response:
    """To whoever submitted it: accepted, or what it already is."""
    return job_response(job, status=202 if new else 200)


def _submission(
    context: Context, about: Venue | SoughtSite | None, options: AnyOptions, files: Files, sender: Sender
) -> Submission:
    kind, job_id = kind_of(options), new_id()
    site = about if isinstance(about, SoughtSite) else None
    # The kind too: the same frames with the same key may be those of another job.
    asked = f"{kind} {options.model_dump_json()}" + ("" if site is None else f" {site.model_dump_json()}")
    content = hashlib.sha256(asked.encode())
    part = "photo" if about is None else "camera"
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
                if about is None:
                    image_checks.check_photo(name, data, context.settings)
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
        frames=frame_paths(job_id, hashes) if about else photos,
        origin=sender.origin,
        content_hash=content.hexdigest(),
        idempotency_key=sender.idempotency_key,
    )


def venue_is_stored(venue_id: str) -> Problem:
    """Answer who sends a site for a venue that is there."""
    return Problem(
        "venue-stored",
        f"Venue {venue_id} says itself what it is: leave out the part site, and name in options.cameras those that are "
        "to be found again.",
    )


def refusal_problem(refusal: SubmissionRefused, venue_id: str, settings: Settings) -> Problem:
    """Why a submission becomes no job."""
    match refusal:
        case KeyReused():
            return Problem("idempotency-key-reused", "Use a new key for new frames.", job=refusal.job_id)
        case VenueBusy():
            return venue_busy(refusal.job_id)
        case VenueGone():
            return no_such_venue(venue_id)
        case VenueReplaced():
            return Problem(
                "venue-replaced",
                "Its pitch, cameras or lenses were changed while the frames arrived; see that they fit and send again.",
                headers={"Retry-After": str(RETRY_AFTER_S)},
            )
        case VenueStored():
            return venue_is_stored(venue_id)
        case QueueFull():
            kept = f", and {refusal.kept} of {settings.queue_limit} places are kept for schedules that are due"
            detail = f"{refusal.waiting} jobs wait{kept if refusal.kept else ''}; try again."
            return Problem("queue-full", detail, headers={"Retry-After": "30"})
    raise refusal
