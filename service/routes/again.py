"""The frames of a job once more: a new job, from the poses that hold now."""

from __future__ import annotations

from dataclasses import replace
from io import BytesIO

from fastapi import APIRouter, Request, Response
from starlette.datastructures import UploadFile

from service.api.context import Context, InContext
from service.routes import uploads
from service.routes.documented import headers, needs, problems
from service.routes.guarded import Guarded
from service.routes.jobs import Existing, job_answer
from service.routes.venues import no_such_venue
from service.store.ids import new_id
from service.store.jobs import Submission, frame_folder
from service.wire.job import Job
from service.wire.problems import Problem
from service.wire.venue import Venue

router = APIRouter(prefix="/jobs", tags=["jobs"], route_class=Guarded)


@router.post(
    "/{job_id}/again",
    status_code=202,
    response_model=Job,
    openapi_extra=needs("calibrate"),
    responses={
        200: {"model": Job, "description": "It is being computed", **headers("ETag")},
        202: headers("ETag", "Location", "Retry-After"),
        **problems(404, 409, 410, 507),
    },
)
def submit_again(job: Existing, request: Request, context: InContext) -> Response:
    """Submit what a job was made of again, with its options, as long as its frames are kept."""
    uploads.require_room(context)
    before = context.jobs.submission(job.id)
    if before is None:
        raise _gone(context, job)
    if before.venue is not None:
        _require_the_same(context, before.venue)
    files = {name: [_read(context, job, path) for path in paths] for name, paths in before.frames.items()}
    submission = _renewed(before, request)
    enqueue = context.queue.enqueue_light if job.kind == "locate" else context.queue.enqueue
    again, new = uploads.enqueue_upload(context, submission, files, enqueue)
    return job_answer(again, status=202 if new else 200)


def _renewed(before: Submission, request: Request) -> Submission:
    job_id = new_id()
    old, new = frame_folder(before.job_id), frame_folder(job_id)
    frames = {name: [new + path.removeprefix(old) for path in paths] for name, paths in before.frames.items()}
    return replace(before, job_id=job_id, frames=frames, idempotency_key=None, origin=request.state.origin)


def _require_the_same(context: Context, then: Venue) -> None:
    """Frames of another pitch, other cameras or lenses are frames of another venue."""
    now = context.venues.get(then.id)
    if now is None:
        raise no_such_venue(then.id)
    if not now.films_like(then):
        raise Problem("venue-replaced", "Its pitch, cameras or lenses were changed since; send new frames.")


def _read(context: Context, job: Job, path: str) -> UploadFile:
    data = context.blobs.get(path)
    if data is None:
        raise _gone(context, job)
    return UploadFile(BytesIO(data))


def _gone(context: Context, job: Job) -> Problem:
    days = f"{context.settings.keep_frames_days:g} days"
    return Problem(
        "frames-deleted", f"Frames are deleted {days} after the end of their job; send new ones.", job=job.id
    )
