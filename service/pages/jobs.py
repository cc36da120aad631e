"""Pages of jobs: the list with filters, and a job with its progress, numbers and pictures."""

from typing import Annotated, Any, get_args

from fastapi import APIRouter, Query, Request, Response

from service.api.context import Context, InContext, JobIdPath
from service.pages.outcome import outcome_of, poses_in_use
from service.pages.page_rendering import Page, render_page
from service.pages.venues import sizes_of
from service.routes.contract.attribution import hide_other_asker
from service.routes.contract.documented import needs_scope
from service.routes.contract.restricted import OnlyVenues
from service.schemas.job import Job, newest_failed
from service.schemas.names import ID_PATTERN, JOB_ID_PATTERN, FormatName, JobKind, JobStatus
from service.schemas.problems import Problem
from service.store.jobs.queries import JobPage
from service.store.jobs.task import UnreadableJob
from service.store.repositories import Repositories

PER_PAGE = 50
# Stages of a calibration in their order.
STAGES = ("segmentation", "evolution", "refinement", "preview")
router = APIRouter(prefix="/ui/jobs", route_class=Page, include_in_schema=False)


@router.get("", openapi_extra=needs_scope("read"))
def jobs(
    request: Request,
    context: InContext,
    only: OnlyVenues,
    venue: Annotated[str, Query(pattern=rf"^$|{ID_PATTERN}")] = "",
    status: Annotated[str, Query(pattern=f"^({'|'.join(get_args(JobStatus))})?$")] = "",
    kind: Annotated[str, Query(pattern=f"^({'|'.join(get_args(JobKind))})?$")] = "",
    cursor: Annotated[str | None, Query(pattern=JOB_ID_PATTERN)] = None,
) -> Response:
    """List jobs, newest first. A form sends unset filters as empty strings."""
    wanted = JobPage(PER_PAGE, before=cursor, venue=venue or None, status=status or None, kind=kind or None, only=only)
    found = context.jobs.page(wanted)
    return render_page(
        request,
        "jobs.html",
        jobs=[hide_other_asker(one) for one in found.jobs],
        unreadable=found.unreadable,
        failed=newest_failed(found.jobs) if status == "failed" else [],
        chosen={"venue": venue, "status": status, "kind": kind},
        statuses=get_args(JobStatus),
        kinds=get_args(JobKind),
        cursor=found.next_cursor,
    )


@router.get("/{job_id}", openapi_extra=needs_scope("read"))
def job(job_id: JobIdPath, request: Request, context: InContext) -> Response:
    """Show a job, followed while it is open."""
    with context.snapshot():
        content = _job_content(job_id, context)
    return render_page(request, "job.html", **content)


def _job_content(job_id: str, context: Context) -> dict[str, Any]:
    found = context.jobs.get(job_id)
    if found is None:
        kept = f"{context.settings.keep_jobs_days:g} days"
        raise Problem("job-not-found", f"It was deleted: by somebody, or since it ended more than {kept} ago.")
    venue = context.venues.readable(found.venue) if found.venue else None
    return {
        "job": hide_other_asker(found),
        "stages": STAGES,
        "formats": get_args(FormatName),
        "outcome": outcome_of(context, found, poses_in_use(context, found.venue)),
        "sizes": sizes_of(venue),
        "adoptable": context.adoption.adoptable_numbers(job_id),
        "can_take": found.kind == "find" and context.adoption.can_adopt_found(job_id),
        "is_stored": found.venue is not None and context.venues.exists(found.venue),
        # A new venue has those cameras alone that the search had frames of.
        "has_every_frame": bool(found.frames) and (venue is None or venue.poses.keys() <= found.frames.keys()),
        "can_be_repeated": can_be_resubmitted(context, found),
    }


def can_be_resubmitted(context: Repositories, job: Job) -> bool:
    """True if a job's frames are kept and still fit its venue, and the venue has no active job."""
    try:
        before = context.submissions.of(job.id)
    except UnreadableJob:
        return False
    if before is None or before.venue is None:
        return before is not None
    now = context.venues.readable(before.venue.id)
    return now is not None and now.accepts_frames_of(before.venue) and not context.past_calibrations.active([now.id])
