"""What all routes that take pictures share once the form is there: its files are checked, stored, and become a job."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, BinaryIO

from fastapi import Header, Response
from starlette.datastructures import UploadFile

from service.api.context import Context
from service.intake import images
from service.intake.submit import REFUSALS, Refusal, frame_paths
from service.routes.jobs import RETRY_AFTER_S, job_answer
from service.routes.venues import no_such_venue
from service.settings import Settings
from service.store.ids import new_id
from service.store.jobs.files import frame_folder
from service.store.jobs.submission import KeyReused, QueueFull, Submission, VenueBusy, VenueGone, VenueReplaced
from service.store.jobs.task import AnyOptions, Origin, seeded
from service.wire.job import Job, Kind
from service.wire.problems import Problem
from service.wire.venue import Camera, Venue

IdempotencyKey = Annotated[
    str | None,
    Header(
        pattern=r"^[\x21-\x7e]{1,255}$",
        description="The same key and the same content are the same job, for as long as that job is kept.",
    ),
]
# By camera, of photos by their names.
Files = Mapping[str, Sequence[UploadFile]]


@dataclass(frozen=True)
class Sent:
    """What came with a form, checked but for the content of its files, which `check(name, content)` refuses or not."""

    kind: Kind
    venue: Venue | None
    options: AnyOptions
    files: Files
    check: Callable[[str, bytes], None]
    idempotency_key: str | None
    origin: Origin


def take(context: Context, sent: Sent) -> tuple[Job, bool]:
    """Check and store the files, and make them a job or find the job that they already are; says if it is new."""
    submission = _submission(sent)
    opened = {name: [file.file for file in several] for name, several in sent.files.items()}
    return enqueued(context, submission, opened)


def enqueued(context: Context, submission: Submission, files: Mapping[str, Sequence[BinaryIO]]) -> tuple[Job, bool]:
    """A submission as a job, or the job that it already is; says if it is new."""
    # A first pose takes a second, and somebody waits for it.
    enqueue = context.queue.enqueue_light if submission.kind == "locate" else context.queue.enqueue
    try:
        return context.intake.take(submission, files, enqueue)
    except REFUSALS as refusal:
        raise in_words(refusal, "" if submission.venue is None else submission.venue.id, context.settings) from None


def answer(job: Job, new: bool) -> Response:
    """To whoever submitted it: accepted, or what it already is."""
    return job_answer(job, status=202 if new else 200)


def _submission(sent: Sent) -> Submission:
    # The kind too: the same frames with the same key may be those of another job.
    content = hashlib.sha256(f"{sent.kind} {sent.options.model_dump_json()}".encode())
    for name, several in sent.files.items():
        content.update(f"\n{name}".encode())
        for file in several:
            data = file.file.read()
            sent.check(name, data)
            content.update(hashlib.sha256(data).digest())
    job_id = new_id()
    return Submission(
        job_id=job_id,
        kind=sent.kind,
        venue=sent.venue,
        options=seeded(sent.options),
        frames=_paths(job_id, sent),
        origin=sent.origin,
        content_hash=content.hexdigest(),
        idempotency_key=sent.idempotency_key,
    )


def _paths(job_id: str, sent: Sent) -> dict[str, list[str]]:
    if sent.venue is None:
        # A photo may be called anything.
        return {name: [f"{frame_folder(job_id)}/photos/{number}"] for number, name in enumerate(sent.files)}
    return frame_paths(job_id, {camera: len(several) for camera, several in sent.files.items()})


def of_cameras(cameras: Sequence[Camera], settings: Settings) -> Callable[[str, bytes], None]:
    """What refuses a file that is no frame of its camera."""
    by_id = {camera.id: camera for camera in cameras}
    return lambda camera, data: images.check(by_id[camera], data, settings)


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
