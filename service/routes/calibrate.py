"""Frames in, a job out: checked here once, stored, and queued before the answer leaves."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import FormData

from service.api.context import Context, InContext, VenueIdPath
from service.intake.submit import REFUSALS
from service.routes import forms, submissions
from service.routes.documented import frames_form, needs, problems, submitted
from service.routes.guarded import Guarded
from service.routes.submissions import IdempotencyKey, Sent
from service.store.jobs.task import Origin
from service.wire.job import Job
from service.wire.options import Options
from service.wire.venue import Venue

router = APIRouter(tags=["jobs"], route_class=Guarded)


@router.post(
    "/venues/{venue_id}/calibrate",
    status_code=202,
    response_model=Job,
    responses=submitted() | problems(400, 404, 408, 409, 413, 415, 422, 429, 502, 507),
    openapi_extra=frames_form(Options, required=False) | needs("calibrate"),
)
async def calibrate(
    venue_id: VenueIdPath,
    request: Request,
    context: InContext,
    idempotency_key: IdempotencyKey = None,
) -> Response:
    """Submit a frame (or several) per camera, or none at all. Follow the job at `Location`.

    Without frames (no body, or a form with `options` alone) the service fetches one from the source of each camera.
    """
    bodiless = forms.is_empty(request)
    if not bodiless:
        forms.require_form(request)
    stored = await run_in_threadpool(forms.expecting, context, venue_id)
    if bodiless:
        return await run_in_threadpool(fetch, context, stored, Options(), idempotency_key, request.state.origin)
    async with forms.form_of(request, forms.most_frames(context, stored)) as form:
        return await run_in_threadpool(submit, context, stored, form, idempotency_key, request.state.origin)


def submit(context: Context, venue: Venue, form: FormData, idempotency_key: str | None, origin: Origin) -> Response:
    """Make a form a job of `venue`, which is the venue as it was before the form arrived."""
    options = forms.options_of(form, Options, context.settings)
    if forms.has_no_frames(form) and any(camera.source for camera in venue.cameras):
        return fetch(context, venue, options, idempotency_key, origin)
    files = forms.frames_of(venue, form, context)
    check = submissions.of_cameras(venue.cameras, context.settings)
    sent = Sent("calibration", venue, options, files, check, idempotency_key, origin)
    return submissions.answer(*submissions.take(context, sent))


def fetch(context: Context, venue: Venue, options: Options, idempotency_key: str | None, origin: Origin) -> Response:
    """Make what the cameras of `venue` show now a job."""
    try:
        job, new = context.from_sources.calibrate(venue, options, idempotency_key, origin, context.queue.enqueue)
    except REFUSALS as refusal:
        raise submissions.in_words(refusal, venue.id, context.settings) from None
    return submissions.answer(job, new)
