"""Jobs: all of them with filters, and one with its course, its numbers and its pictures."""

from __future__ import annotations

from typing import Annotated, get_args

from fastapi import APIRouter, Query, Request, Response

from service.api.context import InContext, JobIdPath
from service.pages.shown import Page, page
from service.pages.venues import holds
from service.routes.contract.documented import needs
from service.wire.names import ID_PATTERN, JOB_ID_PATTERN, FormatName, Kind, Status
from service.wire.problems import Problem

PER_PAGE = 50
# In their order; other kinds of jobs have others.
STAGES = ("segmentation", "evolution", "refinement", "preview")
router = APIRouter(prefix="/ui/jobs", route_class=Page, include_in_schema=False)


@router.get("", openapi_extra=needs("read"))
def jobs(
    request: Request,
    context: InContext,
    venue: Annotated[str, Query(pattern=rf"^$|{ID_PATTERN}")] = "",
    status: Annotated[str, Query(pattern=f"^({'|'.join(get_args(Status))})?$")] = "",
    kind: Annotated[str, Query(pattern=f"^({'|'.join(get_args(Kind))})?$")] = "",
    cursor: Annotated[str | None, Query(pattern=JOB_ID_PATTERN)] = None,
) -> Response:
    """Jobs, newest first. A form sends the filters that were left open as empty strings."""
    found = context.jobs.page(venue or None, status or None, cursor, PER_PAGE + 1, kind or None)
    shown = found[:PER_PAGE]
    return page(
        request,
        "jobs.html",
        jobs=shown,
        chosen={"venue": venue, "status": status, "kind": kind},
        statuses=get_args(Status),
        kinds=get_args(Kind),
        cursor=shown[-1].id if len(found) > PER_PAGE else None,
    )


@router.get("/{job_id}", openapi_extra=needs("read"))
def job(job_id: JobIdPath, request: Request, context: InContext) -> Response:
    """One job, followed while it is open."""
    found = context.jobs.get(job_id)
    if found is None:
        kept = f"{context.settings.keep_jobs_days:g} days"
        raise Problem("job-not-found", f"Jobs are deleted {kept} after their end.")
    newest = context.venues.history(found.venue, None, 1) if found.venue and found.kind == "calibration" else []
    return page(
        request,
        "job.html",
        job=found,
        stages=STAGES,
        formats=get_args(FormatName),
        holds=bool(newest) and holds(found, newest[0]),
    )
