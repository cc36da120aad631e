"""Jobs: how far they are, how they ended, what they look like."""

from __future__ import annotations

from collections.abc import AsyncIterable, Callable
from datetime import timedelta
from http import HTTPStatus
from typing import Annotated

import structlog
from fastapi import APIRouter, Depends, Header, HTTPException, Query, Response
from fastapi.sse import EventSourceResponse, ServerSentEvent
from starlette.concurrency import run_in_threadpool

from service.api.context import Context, InContext, JobIdPath
from service.routes.contract.documented import needs, problems
from service.routes.contract.exported import DOCUMENTS, Wanted, exported, refined_venue
from service.routes.contract.guarded import Guarded
from service.routes.contract.tagged import TAGGED, IfNoneMatch, unless_known
from service.routes.venues import RETRY_AFTER_S, revision_unfit
from service.store.blobs import AWAY as BLOBS_AWAY
from service.store.engine import AWAY
from service.store.jobs.decisions import MovedOn, NoPoses
from service.store.jobs.files import frame_folder, pictures_folder
from service.store.jobs.reading import State
from service.store.revisions import RevisionUnfit
from service.wire.job import Job, Jobs
from service.wire.names import ID_PATTERN, JOB_ID_PATTERN, OPEN, FormatName, Kind, Status
from service.wire.problems import Problem
from service.wire.results import Result

log = structlog.get_logger()
router = APIRouter(prefix="/jobs", tags=["jobs"], route_class=Guarded)

LONGEST_WAIT_S = 60
# A worker notices within seconds that its job was taken away.
STRAGGLING = timedelta(minutes=10)
# An event at least this often, so that a client sees the queue move.
EVENT_AT_LEAST_EVERY_S = 10


def job_answer(job: Job, *, status: int = 200, if_none_match: str | None = None) -> Response:
    """The one form a job leaves in: body, ETag, Location of a new one, Retry-After while it is open."""
    body = job.model_dump_json().encode()
    answer = unless_known(body, if_none_match, lambda: Response(body, status, media_type="application/json"))
    if job.open:
        answer.headers["Retry-After"] = str(RETRY_AFTER_S)
    if answer.status_code == HTTPStatus.ACCEPTED:
        answer.headers["Location"] = job.links["self"]
    return answer


async def at_its_end(context: Context, job: Job, wait_s: float) -> Job:
    """The job when it has ended, or as it is after the time that somebody waits."""
    if not wait_s or not job.open:
        return job
    await context.watch.until(job.id, lambda state: state.status not in OPEN, min(wait_s, LONGEST_WAIT_S))
    return await _read_again(context, job)


async def _existing(job_id: JobIdPath, context: InContext) -> Job:
    job = await context.reads.get(job_id)
    if job is None:
        kept = f"{context.settings.keep_jobs_days:g} days"
        raise Problem("job-not-found", f"GET /jobs lists those there are; they are deleted {kept} after their end.")
    return job


Existing = Annotated[Job, Depends(_existing)]


@router.get("", openapi_extra=needs("read"))
def list_jobs(
    context: InContext,
    venue: Annotated[str | None, Query(pattern=ID_PATTERN)] = None,
    status: Status | None = None,
    kind: Kind | None = None,
    limit: Annotated[int, Query(ge=1, le=200)] = 50,
    cursor: Annotated[str | None, Query(pattern=JOB_ID_PATTERN)] = None,
) -> Jobs:
    """Jobs, newest first, in pages."""
    page = context.jobs.page(venue, status, cursor, limit + 1, kind)
    more = len(page) > limit
    return Jobs(jobs=page[:limit], next_cursor=page[limit - 1].id if more else None)


@router.get(
    "/{job_id}",
    openapi_extra=needs("read"),
    response_model=Job,
    responses=TAGGED | problems(404),
)
async def get_job(
    job: Existing,
    context: InContext,
    wait: Annotated[float, Query(ge=0, allow_inf_nan=False, description="Seconds, at most 60 are waited.")] = 0,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """A job in whatever state. With `wait` the answer is held until the job ends."""
    return job_answer(await at_its_end(context, job, wait), if_none_match=if_none_match)


@router.post("/{job_id}/cancel", openapi_extra=needs("calibrate"), response_model=Job, responses=problems(404))
def cancel_job(job: Existing, context: InContext) -> Response:
    """End a job that is still open: queued at once, running within two seconds. Others stay as they are."""
    context.decisions.cancel(job.id)
    return job_answer(context.jobs.get(job.id) or job)


@router.delete("/{job_id}", openapi_extra=needs("admin"), status_code=204, responses=problems(404, 409))
def delete_job(job: Existing, context: InContext) -> None:
    """Forget a job that has ended, with its frames and its pictures. Poses that it brought to its venue stay."""
    if job.open:
        raise Problem("job-open", f"Cancel it first: POST /jobs/{job.id}/cancel.", job=job.id)
    # The queue first: without the row nobody would ever ask it to forget.
    context.queue.forget([job.id])
    # Swept once more, as a worker that was at the job until now may write another picture.
    context.expiry.delete_jobs([job.id], context.expiry.now() + STRAGGLING)
    for folder in (frame_folder(job.id), pictures_folder(job.id)):
        try:
            context.blobs.delete_under(folder)
        except BLOBS_AWAY:
            log.warning("cannot delete yet", folder=folder, exc_info=True)


@router.post("/{job_id}/accept", openapi_extra=needs("calibrate"), response_model=Job, responses=problems(404, 409))
def accept_job(
    job: Existing,
    context: InContext,
    camera: Annotated[str | None, Query(pattern=ID_PATTERN, description="One camera; absent: all.")] = None,
) -> Response:
    """Let the poses of a calibration hold that the gate rejected, or that was a dry run. Nothing changes if they do.

    Only while the venue is as the calibration found or left it.
    """
    ids = [one.id for one in job.result.cameras] if isinstance(job.result, Result) else []
    if camera is not None and ids and camera not in ids:
        raise Problem("poses-not-found", f"It found those of {', '.join(ids)}.", camera=camera, expected=ids)
    cameras = None if camera is None else [camera]
    return _decided(context, job, lambda job_id: context.decisions.accept(job_id, cameras))


@router.post("/{job_id}/reject", openapi_extra=needs("calibrate"), response_model=Job, responses=problems(404, 409))
def reject_job(job: Existing, context: InContext) -> Response:
    """Put back what was before the poses of a calibration. Nothing changes if they never held or were put back.

    Only while they are the last that came; to go back further, `POST /venues/{id}/restore`.
    """
    return _decided(context, job, context.decisions.reject)


def _decided(context: Context, job: Job, decide: Callable[[str], None]) -> Response:
    try:
        decide(job.id)
    except NoPoses:
        raise _no_poses(job) from None
    except MovedOn as moved:
        newest = moved.newest
        is_now = f"at revision {newest.revision} ({newest.cause})" if newest else "deleted"
        raise Problem(
            "venue-moved-on",
            f"Venue {job.venue} is {is_now}, or has another pitch; see GET /venues/{job.venue}/history and decide.",
            job=job.id,
            got=newest and newest.revision,
        ) from None
    except RevisionUnfit as unfit:
        raise revision_unfit(unfit) from None
    return job_answer(context.jobs.get(job.id) or job)


def _no_poses(job: Job) -> Problem:
    return Problem("poses-not-found", "It has not found any yet." if job.open else "It found none.", job=job.id)


async def _not_seen_to_its_end(
    job: Existing,
    context: InContext,
    last_event_id: Annotated[str | None, Header(description="The id of the last event that arrived.")] = None,
) -> None:
    """A browser connects again after the end, and again: 204 is how it is told that there is no more."""
    if job.open or last_event_id is None:
        return
    state = await _state(context, job)
    if state is not None and last_event_id == str(state.revision):
        raise HTTPException(HTTPStatus.NO_CONTENT)


@router.get(
    "/{job_id}/events",
    openapi_extra=needs("read"),
    response_class=EventSourceResponse,
    dependencies=[Depends(_not_seen_to_its_end)],
    responses={204: {"description": "The event of `Last-Event-ID` was the end"}, **problems(404)},
)
async def job_events(job: Existing, context: InContext) -> AsyncIterable[ServerSentEvent]:
    """The job as server-sent events: `progress` whenever it changes and every 10 s, `end` when it has ended."""
    while not context.watch.closed:
        try:
            state = await _state(context, job)
            job = await _read_again(context, job)
        except AWAY:
            # The client connects again, as after any stream that broke off.
            log.warning("cannot tell of a job", exc_info=True)
            return
        number = None if state is None else str(state.revision)
        yield ServerSentEvent(data=job, event="progress" if job.open else "end", id=number)
        if not job.open:
            return
        await context.watch.until(job.id, _later_than(state), EVENT_AT_LEAST_EVERY_S)


@router.get(
    "/{job_id}/poses",
    openapi_extra=needs("read"),
    response_class=Response,
    responses=DOCUMENTS | problems(404),
)
def job_poses(
    job: Existing,
    context: InContext,
    wanted: Annotated[Wanted, Depends()],
    form: Annotated[FormatName, Query(alias="format")] = "json",
) -> Response:
    """The poses that a job found, accepted or not, in the format of another tool."""
    venue = context.jobs.posed(job.id)
    if venue is None:
        raise _no_poses(job)
    if wanted.lens == "refined":
        why_none = "its lines do not determine a lens, or the job is one of an earlier release."
        venue = refined_venue(venue, context.refined.of_job(job.id), wanted.camera, why_none)
    return exported(context, venue, f"{venue.id}-{job.id}", form, wanted)


def _later_than(seen: State | None) -> Callable[[State], bool]:
    return lambda state: seen is None or state.revision > seen.revision


async def _state(context: Context, job: Job) -> State | None:
    return (await run_in_threadpool(context.jobs.states, [job.id])).get(job.id)


async def _read_again(context: Context, job: Job) -> Job:
    return await context.reads.get(job.id) or job
