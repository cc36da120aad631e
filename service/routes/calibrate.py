"""Frames in, a job out: checked here once, stored, and queued before the answer leaves."""

from __future__ import annotations

import secrets
from typing import Annotated

from fastapi import APIRouter, Header, Request, Response
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import FormData

from service.api.context import Context, InContext, VenueIdPath
from service.intake.submit import REFUSALS
from service.routes import uploads
from service.routes.documented import frames_upload, headers, needs, problems
from service.routes.guarded import Guarded
from service.routes.jobs import job_answer
from service.routes.venues import no_such_venue
from service.store.ids import new_id
from service.store.jobs import Origin, Submission
from service.wire import callback_urls
from service.wire.job import Job
from service.wire.options import Options
from service.wire.venue import Venue

router = APIRouter(tags=["jobs"], route_class=Guarded)

UPLOAD = frames_upload(Options, required=False)


@router.post(
    "/venues/{venue_id}/calibrate",
    status_code=202,
    response_model=Job,
    responses={
        200: {"model": Job, "description": "This content is already a job", **headers("ETag")},
        202: headers("ETag", "Location", "Retry-After"),
        **problems(400, 404, 408, 409, 413, 415, 422, 429, 502, 507),
    },
    openapi_extra=UPLOAD | needs("calibrate"),
)
async def calibrate(
    venue_id: VenueIdPath,
    request: Request,
    context: InContext,
    idempotency_key: Annotated[
        str | None, Header(pattern=uploads.KEY_PATTERN, description=uploads.KEY_DESCRIPTION)
    ] = None,
) -> Response:
    """Submit a frame (or several) per camera, or none at all. Follow the job at `Location`.

    Without frames (no body, or a form with `options` alone) the service fetches one from the source of each camera.
    """
    bodiless = uploads.is_empty(request)
    if not bodiless:
        uploads.require_form(request)
    stored = await run_in_threadpool(expecting, context, venue_id)
    if bodiless:
        return await run_in_threadpool(fetch, context, stored, Options(), idempotency_key, request.state.origin)
    async with uploads.form_of(request, uploads.most_frames(context, stored)) as form:
        return await run_in_threadpool(submit, context, stored, form, idempotency_key, request.state.origin)


def expecting(context: Context, venue_id: str) -> Venue:
    """The venue that frames arrive for, if there is room for them: the upload is not read before."""
    stored = context.venues.get(venue_id)
    if stored is None:
        raise no_such_venue(venue_id)
    uploads.require_room(context)
    return stored


def submit(context: Context, venue: Venue, form: FormData, idempotency_key: str | None, origin: Origin) -> Response:
    """Make a form a job of `venue`, which is the venue as it was before the form arrived."""
    options = uploads.options_of(form, Options)
    if options.callback_url is not None:
        callback_urls.check(options.callback_url, context.settings)
    if uploads.has_no_frames(form) and any(camera.source for camera in venue.cameras):
        return fetch(context, venue, options, idempotency_key, origin)
    files = uploads.frames_of(venue, form, context)
    content_hash = uploads.checked(context, venue, files, options)
    job_id = new_id()
    seeded = options if options.seed is not None else options.model_copy(update={"seed": secrets.randbelow(2**31)})
    paths = uploads.frame_paths(job_id, files)
    submission = Submission(job_id, venue, seeded, content_hash, idempotency_key, paths, origin=origin)
    job, new = uploads.enqueue_upload(context, submission, files, context.queue.enqueue)
    return job_answer(job, status=202 if new else 200)


def fetch(context: Context, venue: Venue, options: Options, idempotency_key: str | None, origin: Origin) -> Response:
    """Make what the cameras of `venue` show now a job."""
    try:
        job, new = context.from_sources.calibrate(venue, options, idempotency_key, origin, context.queue.enqueue)
    except REFUSALS as refusal:
        raise uploads.in_words(refusal, venue.id, context.settings) from None
    return job_answer(job, status=202 if new else 200)
