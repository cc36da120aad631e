"""The frames of a job once more: a new job, from the poses that hold now."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from service.api.context import Context, InContext
from service.routes.contract.documented import needs_scope, problem_responses, submission_responses
from service.routes.contract.guarded import Guarded
from service.routes.contract.missing import no_such_venue
from service.routes.jobs import ExistingJob
from service.routes.submissions import forms, job_submission
from service.schemas.job import Job
from service.schemas.problems import Problem
from service.schemas.venue import Venue
from service.store.ids import new_id
from service.store.jobs.files import frame_folder
from service.store.jobs.submission import Submission
from service.store.jobs.task import Origin, UnreadableJob

router = APIRouter(prefix="/jobs", tags=["jobs"], route_class=Guarded)


@router.post(
    "/{job_id}/again",
    status_code=202,
    response_model=Job,
    openapi_extra=needs_scope("calibrate"),
    responses=submission_responses("It is being computed") | problem_responses(404, 409, 410, 507),
)
def submit_again(job: ExistingJob, request: Request, context: InContext) -> Response:
    """Submit the frames of a job again, with its options, as long as its frames are kept."""
    return submit(context, job, request.state.origin)


def submit(context: Context, job: Job, origin: Origin) -> Response:
    """Make a job's frames, which the store copies, a new job."""
    still = context.jobs.get(job.id)
    if still is not None and still.open:
        return job_submission.submission_response(still, new=False)
    forms.require_disk_space(context)
    try:
        before = context.submissions.of(job.id)
    except UnreadableJob as error:
        raise Problem("job-of-newer-version", f"This version cannot read what was asked: {error}", job=job.id) from None
    if before is None:
        raise _gone(context, job)
    if before.venue is not None:
        _require_the_same(context, before.venue)
    renewed = _renewed(before, origin)

    def store() -> None:
        for name, paths in before.frames.items():
            for old, new in zip(paths, renewed.frames[name], strict=True):
                if not context.blobs.copy(old, new):
                    raise _gone(context, job)

    return job_submission.submission_response(*job_submission.enqueue(context, renewed, store))


def _renewed(before: Submission, origin: Origin) -> Submission:
    job_id = new_id()
    old, new = frame_folder(before.job_id), frame_folder(job_id)
    frames = {name: [new + path.removeprefix(old) for path in paths] for name, paths in before.frames.items()}
    content = {"content_hash": before.hash_again, "idempotency_key": None}
    renewed = {"job_id": job_id, "frames": frames, "origin": origin, **content}
    return before.model_copy(update=renewed)


def _require_the_same(context: Context, then: Venue) -> None:
    """Frames of another pitch, other cameras or lenses are frames of another venue."""
    now = context.venues.get(then.id)
    if now is None:
        raise no_such_venue(then.id)
    if not now.accepts_frames_of(then):
        raise Problem("venue-replaced", "Its pitch, cameras or lenses were changed since; send new frames.")


def _gone(context: Context, job: Job) -> Problem:
    days = f"{context.settings.keep_frames_days:g} days"
    never_any = job.status == "failed" and job.started_at is None
    why = "It never had any" if never_any else f"Frames are deleted {days} after the end of their job"
    return Problem("frames-deleted", f"{why}; send new ones.", job=job.id)
