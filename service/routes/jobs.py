"""Jobs: their progress, results and decisions about them."""

from collections.abc import AsyncIterable, AsyncIterator, Callable
from datetime import timedelta
from http import HTTPStatus
from typing import Annotated

import structlog
from fastapi import APIRouter, Depends, Header, HTTPException, Query, Request, Response
from fastapi.sse import EventSourceResponse, ServerSentEvent
from starlette.concurrency import run_in_threadpool

from service.api.context import ByActor, Context, InContext, JobIdPath
from service.routes.contract.attribution import hide_other_asker
from service.routes.contract.documented import needs_scope
from service.routes.contract.exported import DOCUMENTS, ExportQuery, FormatQuery, export_response, with_refined_poses
from service.routes.contract.guarded import Guarded
from service.routes.contract.paged import CURSOR, LIMIT, NEXT_PAGE, next_page
from service.routes.contract.problem_docs import OF_EXPORTS, problem_responses
from service.routes.contract.restricted import OnlyVenues
from service.routes.contract.tagged import TAGGED, IfNoneMatch, tagged_json
from service.schemas.job import Job, Jobs
from service.schemas.names import ID_PATTERN, JOB_ID_PATTERN, OPEN_STATUSES, JobKind, JobStatus, ListFields
from service.schemas.problems import Problem
from service.schemas.results import Result
from service.store.blobs import BLOB_OUTAGES
from service.store.database import DATABASE_OUTAGES
from service.store.jobs.files import frame_folder, pictures_folder
from service.store.jobs.queries import JobPage, JobState
from service.store.refusals import RETRY_AFTER_S, no_poses, no_such_job

log = structlog.get_logger()
router = APIRouter(prefix="/jobs", tags=["jobs"], route_class=Guarded)

LONGEST_WAIT_S = 60
# A worker notices within seconds that its job was taken away.
STRAGGLING = timedelta(minutes=10)
# An event at least this often, so that a client sees the queue move.
EVENT_AT_LEAST_EVERY_S = 10


def job_response(job: Job, *, status: int = 200, if_none_match: str | None = None) -> Response:
    """Return a job as response: body, ETag, Location of a new one, Retry-After while it is open."""
    answer = tagged_json(hide_other_asker(job), if_none_match, status)
    if job.open:
        answer.headers["Retry-After"] = str(RETRY_AFTER_S)
    if answer.status_code == HTTPStatus.ACCEPTED:
        answer.headers["Location"] = job.links["self"]
    return answer


async def wait_for_end(context: Context, job: Job, wait_s: float) -> Job:
    """Return a job once it has ended, or as it is after `wait_s`."""
    if not wait_s or not job.open:
        return job
    await context.job_watch.until(job.id, lambda state: state.status not in OPEN_STATUSES, min(wait_s, LONGEST_WAIT_S))
    return await _read_again(context, job)


async def _existing_job(job_id: JobIdPath, context: InContext) -> Job:
    job = await context.reads.get(job_id)
    if job is None:
        raise no_such_job(context.settings.keep_jobs_days)
    return job


def _existing_state(job_id: JobIdPath, context: InContext) -> JobState:
    state = context.jobs.states([job_id]).get(job_id)
    if state is None:
        raise no_such_job(context.settings.keep_jobs_days)
    return state


ExistingJob = Annotated[Job, Depends(_existing_job)]
# The job need not be readable.
ExistingState = Annotated[JobState, Depends(_existing_state)]


@router.get("", openapi_extra=needs_scope("read"), responses={200: {"headers": NEXT_PAGE}})
def list_jobs(
    context: InContext,
    only: OnlyVenues,
    request: Request,
    response: Response,
    venue: Annotated[str | None, Query(pattern=ID_PATTERN, description="Only jobs of this venue.")] = None,
    status: Annotated[JobStatus | None, Query(description="Only jobs in this state.")] = None,
    kind: Annotated[JobKind | None, Query(description="Only jobs of this kind.")] = None,
    limit: Annotated[int, Query(ge=1, le=200, description=LIMIT)] = 50,
    cursor: Annotated[str | None, Query(pattern=JOB_ID_PATTERN, description=CURSOR)] = None,
    fields: Annotated[ListFields, Query(description="`summary`: a line of each, in `summaries`.")] = "all",
) -> Jobs:
    """List jobs, newest first, in pages; with a key for some venues, theirs."""
    wanted = JobPage(limit, before=cursor, venue=venue, status=status, kind=kind, only=only)
    in_lines = fields == "summary"
    found = context.jobs.summaries(wanted) if in_lines else context.jobs.page(wanted)
    shown = Jobs(
        jobs=[hide_other_asker(job) for job in found.jobs],
        summaries=[hide_other_asker(line) for line in found.summaries] if in_lines else None,
        unreadable=found.unreadable,
        next_cursor=found.next_cursor,
    )
    response.headers.update(next_page(request, shown.next_cursor))
    return shown


@router.get("/{job_id}", openapi_extra=needs_scope("read"), response_model=Job, responses=TAGGED)
async def get_job(
    job: ExistingJob,
    context: InContext,
    wait: Annotated[float, Query(ge=0, allow_inf_nan=False, description="Seconds, at most 60 are waited.")] = 0,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Return a job in whatever state. With `wait` the answer is held until the job ends."""
    if wait and job.open:
        with context.waiters.taken():
            job = await wait_for_end(context, job, wait)
    return job_response(job, if_none_match=if_none_match)


@router.post("/{job_id}/cancel", openapi_extra=needs_scope("calibrate"), response_model=Job)
async def cancel_job(state: ExistingState, job_id: JobIdPath, context: InContext, by: ByActor) -> Response:  # noqa: ARG001
    """End a job that is still open: queued at once, running within two seconds. Others stay as they are."""
    await run_in_threadpool(context.decisions.cancel, job_id, by)
    return job_response(await _existing_job(job_id, context))


@router.delete(
    "/{job_id}", openapi_extra=needs_scope("admin"), status_code=204, responses=problem_responses("job-open")
)
def delete_job(state: ExistingState, job_id: JobIdPath, context: InContext) -> None:
    """Forget a job that has ended, with its frames and its pictures. Poses that it brought to its venue stay."""
    if state.status in OPEN_STATUSES:
        raise Problem("job-open", f"Cancel it first: POST /jobs/{job_id}/cancel.", job=job_id)
    # The queue first: without the row nobody would ever ask it to forget.
    context.queue.forget([job_id])
    # Swept once more, as a worker that was at the job until now may write another picture.
    context.expiry.delete_jobs([job_id], context.expiry.now() + STRAGGLING)
    for folder in (frame_folder(job_id), pictures_folder(job_id)):
        try:
            context.blobs.delete_under(folder)
        except BLOB_OUTAGES:
            log.warning("cannot delete yet", folder=folder, exc_info=True)


@router.post(
    "/{job_id}/accept",
    openapi_extra=needs_scope("calibrate"),
    response_model=Job,
    responses=problem_responses("poses-not-found", "venue-moved-on", "poses-refused"),
)
def accept_job(
    job: ExistingJob,
    context: InContext,
    by: ByActor,
    camera: Annotated[str | None, Query(pattern=ID_PATTERN, description="One camera; absent: all.")] = None,
) -> Response:
    """Store the poses of a calibration that the gate rejected, or that was a dry run, unless they are stored already.

    Only while the venue is as the calibration found or left it.
    """
    ids = [one.id for one in job.result.cameras] if isinstance(job.result, Result) else []
    if camera is not None and ids and camera not in ids:
        raise Problem("poses-not-found", f"It found those of {', '.join(ids)}.", camera=camera, expected=ids)
    context.decisions.accept(job.id, None if camera is None else [camera], by)
    return job_response(context.jobs.get(job.id) or job)


@router.post(
    "/{job_id}/reject",
    openapi_extra=needs_scope("calibrate"),
    response_model=Job,
    responses=problem_responses("poses-not-found", "venue-moved-on", "poses-refused"),
)
def reject_job(job: ExistingJob, context: InContext, by: ByActor) -> Response:
    """Restore the poses from before a calibration. Nothing changes if its own were never stored or are no more.

    Only while they are the last that came; to go back further, `POST /venues/{id}/restore`.
    """
    context.decisions.reject(job.id, by)
    return job_response(context.jobs.get(job.id) or job)


async def _require_unseen_events(
    job: ExistingJob,
    context: InContext,
    last_event_id: Annotated[str | None, Header(description="The id of the last event that arrived.")] = None,
) -> None:
    """Answer 204 to a client that has seen the end: browsers reconnect until they get it."""
    if job.open or last_event_id is None:
        return
    state = await _state(context, job)
    if state is not None and last_event_id == str(state.revision):
        raise HTTPException(HTTPStatus.NO_CONTENT)


async def _waiter_place(context: InContext) -> AsyncIterator[None]:
    with context.waiters.taken():
        yield


@router.get(
    "/{job_id}/events",
    openapi_extra=needs_scope("read"),
    response_class=EventSourceResponse,
    dependencies=[Depends(_require_unseen_events), Depends(_waiter_place)],
    responses={204: {"description": "The event of `Last-Event-ID` was the end"}},
)
async def stream_job_events(job: ExistingJob, context: InContext) -> AsyncIterable[ServerSentEvent]:
    """Stream the job as server-sent events: `progress` whenever it changes and every 10 s, `end` when it has ended."""
    while not context.job_watch.closed:
        try:
            state = await _state(context, job)
            job = await _read_again(context, job)
        except DATABASE_OUTAGES:
            # The client connects again, as after any stream that broke off.
            log.warning("cannot read a job for its event stream", exc_info=True)
            return
        number = None if state is None else str(state.revision)
        yield ServerSentEvent(data=hide_other_asker(job), event="progress" if job.open else "end", id=number)
        if not job.open:
            return
        await context.job_watch.until(job.id, _is_newer_than(state), EVENT_AT_LEAST_EVERY_S)


@router.get(
    "/{job_id}/poses",
    openapi_extra=needs_scope("read"),
    response_class=Response,
    responses=DOCUMENTS | problem_responses("poses-not-found", *OF_EXPORTS),
)
def export_job_poses(
    job: ExistingJob, context: InContext, wanted: Annotated[ExportQuery, Depends()], form: FormatQuery = "json"
) -> Response:
    """Export the poses that a job found, accepted or not, to another tool's format."""
    venue = context.jobs.posed(job.id)
    if venue is None:
        raise no_poses(job)
    if wanted.lens == "refined":
        why_none = "its lines do not determine a lens, or the job is one of an earlier release."
        venue = with_refined_poses(venue, context.adoption.refined_of_job(job.id), wanted.camera, why_none)
    return export_response(context, venue, f"{venue.id}-{job.id}", form, wanted)


def _is_newer_than(seen: JobState | None) -> Callable[[JobState], bool]:
    return lambda state: seen is None or state.revision > seen.revision


async def _state(context: Context, job: Job) -> JobState | None:
    return (await run_in_threadpool(context.jobs.states, [job.id])).get(job.id)


async def _read_again(context: Context, job: Job) -> Job:
    return await context.reads.get(job.id) or job
