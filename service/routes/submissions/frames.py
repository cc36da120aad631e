"""Submission of calibrations and field fits: frames are checked, stored, and queued as a job before the answer."""

from fastapi import APIRouter, Request, Response
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import FormData

from service.api.context import Context, InContext
from service.routes.contract.documented import frames_form_body
from service.routes.contract.guarded import Guarded
from service.routes.contract.problem_docs import OF_FRAMES, OF_SOURCES
from service.routes.submissions import forms, job_submission
from service.routes.submissions.job_submission import FromSender, Sender, submits_job
from service.routes.venues import ExistingVenue
from service.schemas.names import JobKind
from service.schemas.options import FieldOptions, Options
from service.schemas.venue import Venue

router = APIRouter(tags=["jobs"], route_class=Guarded)


@submits_job(
    router,
    "/venues/{venue_id}/calibrate",
    frames_form_body(Options, required=False),
    (*OF_FRAMES, *OF_SOURCES, "venue-busy"),
)
async def submit_calibration(
    venue: ExistingVenue, request: Request, context: InContext, sender: FromSender
) -> Response:
    """Submit a frame (or several) per camera, or none at all. Follow the job at `Location`.

    Without frames (no body, or a form with `options` alone) the service fetches one from the source of each camera.
    """
    if forms.is_empty(request):
        await run_in_threadpool(forms.require_disk_space, context)
        return await run_in_threadpool(fetch, context, venue.id, Options(), sender)
    return await _uploaded(Options, venue, request, context, sender)


@submits_job(router, "/venues/{venue_id}/field/fit", frames_form_body(FieldOptions), OF_FRAMES)
async def submit_field_fit(venue: ExistingVenue, request: Request, context: InContext, sender: FromSender) -> Response:
    """Fit length, width and ridge of the pitch to the frames of all cameras. The stored venue stays as it is.

    The result has each measure with its sigma, says which the frames cannot tell and why, and has a `field` to be put
    into the venue.
    """
    return await _uploaded(FieldOptions, venue, request, context, sender)


async def _uploaded(
    model: type[Options | FieldOptions], venue: Venue, request: Request, context: Context, sender: Sender
) -> Response:
    kind: JobKind = "calibration" if model is Options else "field"
    most = len(venue.cameras) * context.settings.max_frames_per_camera
    async with forms.parsed_upload(request, context, venue.id, kind, sender, most) as form:
        return await run_in_threadpool(submit, context, venue, form, model, sender)


def submit(
    context: Context, venue: Venue, form: FormData, model: type[Options | FieldOptions], sender: Sender
) -> Response:
    """Make a form, with options of this `model`, a job of `venue`, which is the venue before the form arrived."""
    options = forms.parse_options(form, model, context.settings)
    fetched = forms.has_no_frames(form) and any(camera.source for camera in venue.cameras)
    if fetched and isinstance(options, Options):
        return fetch(context, venue.id, options, sender)
    files = forms.frames_by_camera(venue, form, context)
    return job_submission.submission_response(*job_submission.submit_files(context, venue, options, files, sender))


def fetch(context: Context, venue_id: str, options: Options, sender: Sender) -> Response:
    """Submit frames that are fetched from the cameras of a venue."""
    submitted = context.from_sources.calibrate(venue_id, options, sender.idempotency_key, sender.origin)
    return job_submission.submission_response(*submitted)
