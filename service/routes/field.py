"""Frames in, a job out that fits the measures of a venue's pitch to its lines."""

from __future__ import annotations

import hashlib
import secrets
from typing import Annotated

from fastapi import APIRouter, Header, Request, Response
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import FormData

from service.api.context import Context, InContext, VenueIdPath
from service.routes import uploads
from service.routes.calibrate import expecting
from service.routes.documented import frames_upload, headers, needs, problems
from service.routes.guarded import Guarded
from service.routes.jobs import job_answer
from service.store.ids import new_id
from service.store.jobs import Origin, Submission
from service.wire import callback_urls
from service.wire.job import Job
from service.wire.options import FieldOptions
from service.wire.venue import Venue

router = APIRouter(tags=["jobs"], route_class=Guarded)


@router.post(
    "/venues/{venue_id}/field/fit",
    status_code=202,
    response_model=Job,
    responses={
        200: {"model": Job, "description": "This content is already a job", **headers("ETag")},
        202: headers("ETag", "Location", "Retry-After"),
        **problems(400, 404, 408, 409, 413, 415, 422, 429, 507),
    },
    openapi_extra=frames_upload(FieldOptions) | needs("calibrate"),
)
async def fit_field(
    venue_id: VenueIdPath,
    request: Request,
    context: InContext,
    idempotency_key: Annotated[
        str | None, Header(pattern=uploads.KEY_PATTERN, description=uploads.KEY_DESCRIPTION)
    ] = None,
) -> Response:
    """Fit length, width and ridge of the pitch to the frames of all cameras. The stored venue stays as it is.

    The result has each measure with its sigma, says which the frames cannot tell and why, and has a `field` to be put
    into the venue.
    """
    uploads.require_form(request)
    stored = await run_in_threadpool(expecting, context, venue_id)
    async with uploads.form_of(request, uploads.most_frames(context, stored)) as form:
        return await run_in_threadpool(_submit, context, stored, form, idempotency_key, request.state.origin)


def _submit(context: Context, venue: Venue, form: FormData, idempotency_key: str | None, origin: Origin) -> Response:
    options = uploads.options_of(form, FieldOptions)
    if options.callback_url is not None:
        callback_urls.check(options.callback_url, context.settings)
    files = uploads.frames_of(venue, form, context)
    # The same frames may be those of a calibration with the same key, which is another job.
    sent = hashlib.sha256(f"field {uploads.checked(context, venue, files, options)}".encode()).hexdigest()
    job_id = new_id()
    seeded = options if options.seed is not None else options.model_copy(update={"seed": secrets.randbelow(2**31)})
    paths = uploads.frame_paths(job_id, files)
    submission = Submission(job_id, venue, seeded, sent, idempotency_key, paths, "field", origin)
    job, new = uploads.enqueue_upload(context, submission, files, context.queue.enqueue)
    return job_answer(job, status=202 if new else 200)
