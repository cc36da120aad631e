"""New jobs from the frames of old ones, beginning with the poses that are stored now."""

import hashlib

from fastapi import APIRouter, Request, Response

from service.api.context import Context, InContext
from service.routes.contract.guarded import Guarded
from service.routes.jobs import ExistingJob
from service.routes.submissions import forms, job_submission
from service.routes.submissions.job_submission import submits_job
from service.routes.venues import existing_venue
from service.schemas.job import Job
from service.schemas.options import Options
from service.schemas.problems import Problem
from service.schemas.venue import Venue
from service.store.ids import new_id
from service.store.jobs.files import frame_folder
from service.store.jobs.submission import Submission
from service.store.jobs.task import Origin, UnreadableJob, seeded

OF_COPIES = (
    "frames-deleted",
    "job-of-newer-version",
    "venue-not-found",
    "venue-replaced",
    "venue-stored",
    "venue-busy",
    "queue-full",
    "disk-full",
)
KNOWN = "It is being computed"
router = APIRouter(prefix="/jobs", tags=["jobs"], route_class=Guarded)


@submits_job(router, "/{job_id}/again", {}, OF_COPIES, known=KNOWN)
def resubmit_job(job: ExistingJob, request: Request, context: InContext) -> Response:
    """Submit the frames of a job again, with its options, as long as its frames are kept."""
    return submit(context, job, request.state.origin)


@submits_job(router, "/{job_id}/calibrate", {}, (*OF_COPIES, "poses-not-found", "missing-camera"), known=KNOWN)
def calibrate_found_cameras(job: ExistingJob, request: Request, context: InContext) -> Response:
    """Calibrate a venue with the frames of a search for its cameras, once what was found is stored.

    `POST /venues/{id}/adopt-found` stores it. The calibration has the default options and begins with the poses that
    hold now; frames of cameras that were left out are not used. Only as long as the frames of the search are kept.
    """
    if job.kind != "find":
        detail = f"It is no search for cameras but of the kind {job.kind}: POST /jobs/{job.id}/again takes its frames."
        raise Problem("poses-not-found", detail, job=job.id)
    forms.require_disk_space(context)
    venue = existing_venue(job.venue or "", context)
    search = _kept(context, job)
    missing = [camera for camera in venue.poses if camera not in search.frames]
    if missing:
        raise Problem(
            "missing-camera",
            f"The search had no frame of {', '.join(missing)}: POST /venues/{venue.id}/calibrate with a frame of each.",
            expected=list(venue.poses),
            got=list(search.frames),
        )
    of_search = {
        "kind": "calibration",
        "venue": venue,
        "site": None,
        "options": seeded(Options()),
        "frames": {camera: search.frames[camera] for camera in venue.poses},
        # A request that is repeated while the calibration is open is the same job.
        "content_hash": hashlib.sha256(f"calibration of {job.id}".encode()).hexdigest(),
    }
    return _submit_copy(context, job, search.model_copy(update=of_search), request.state.origin)


def submit(context: Context, job: Job, origin: Origin) -> Response:
    """Make a job's frames, which the store copies, a new job."""
    still = context.jobs.get(job.id)
    if still is not None and still.open:
        return job_submission.submission_response(still, new=False)
    forms.require_disk_space(context)
    before = _kept(context, job)
    if before.venue is not None:
        _require_the_same(context, before.venue)
    return _submit_copy(context, job, before.model_copy(update={"content_hash": before.hash_again}), origin)


def _kept(context: Context, job: Job) -> Submission:
    """Return the submission of a job; raises a problem if this version cannot read it or its frames are gone."""
    try:
        kept = context.submissions.of(job.id)
    except UnreadableJob as error:
        raise Problem("job-of-newer-version", f"This version cannot read what was asked: {error}", job=job.id) from None
    if kept is None:
        raise _gone(context, job)
    return kept


def _submit_copy(context: Context, job: Job, wanted: Submission, origin: Origin) -> Response:
    """Submit what is wanted as a new job, whose frames are copies of those of `job`."""
    job_id = new_id()
    old, new = frame_folder(job.id), frame_folder(job_id)
    copies = {name: [new + path.removeprefix(old) for path in paths] for name, paths in wanted.frames.items()}
    changes = {"job_id": job_id, "frames": copies, "origin": origin, "idempotency_key": None}

    def store() -> None:
        for name, paths in wanted.frames.items():
            for path, copy in zip(paths, copies[name], strict=True):
                if not context.blobs.copy(path, copy):
                    raise _gone(context, job)

    submission = wanted.model_copy(update=changes)
    return job_submission.submission_response(*context.intake.take(submission, store))


def _require_the_same(context: Context, then: Venue) -> None:
    """Raise the problem `venue-replaced` if the pitch, the cameras or their lenses were changed since."""
    now = existing_venue(then.id, context)
    if not now.accepts_frames_of(then):
        raise Problem("venue-replaced", "Its pitch, cameras or lenses were changed since; send new frames.")


def _gone(context: Context, job: Job) -> Problem:
    days = f"{context.settings.keep_frames_days:g} days"
    never_any = job.status == "failed" and job.started_at is None
    why = "It never had any" if never_any else f"Frames are deleted {days} after the end of their job"
    return Problem("frames-deleted", f"{why}; send new ones.", job=job.id)
