"""Frames in, a job out that fits the measures of a venue's pitch to its lines."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import FormData

from service.api.context import Context, InContext, VenueIdPath
from service.routes.contract.documented import frames_form, needs, problems, submitted
from service.routes.contract.guarded import Guarded
from service.routes.submissions import forms, taking
from service.routes.submissions.taking import FromSender, Sender
from service.wire.job import Job
from service.wire.options import FieldOptions
from service.wire.venue import Venue

router = APIRouter(tags=["jobs"], route_class=Guarded)


@router.post(
    "/venues/{venue_id}/field/fit",
    status_code=202,
    response_model=Job,
    responses=submitted() | problems(400, 404, 408, 409, 413, 415, 422, 429, 507),
    openapi_extra=frames_form(FieldOptions) | needs("calibrate"),
)
async def fit_field(
    venue_id: VenueIdPath,
    request: Request,
    context: InContext,
    sender: FromSender,
) -> Response:
    """Fit length, width and ridge of the pitch to the frames of all cameras. The stored venue stays as it is.

    The result has each measure with its sigma, says which the frames cannot tell and why, and has a `field` to be put
    into the venue.
    """
    forms.require_form(request)
    stored = await run_in_threadpool(forms.expecting, context, venue_id)
    async with forms.form_of(request, forms.most_frames(context, stored)) as form:
        return await run_in_threadpool(_submit, context, stored, form, sender)


def _submit(context: Context, venue: Venue, form: FormData, sender: Sender) -> Response:
    options = forms.options_of(form, FieldOptions, context.settings)
    files = forms.frames_of(venue, form, context)
    return taking.answer(*taking.take(context, venue, options, files, sender))
