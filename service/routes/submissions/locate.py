"""Clicked points in, a job out that finds where a camera stands."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Query, Request, Response
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import FormData, UploadFile

from service.api.context import Context, InContext, VenueIdPath
from service.routes.contract.documented import form, needs, problems, submitted
from service.routes.contract.guarded import Guarded
from service.routes.jobs import at_its_end, job_answer
from service.routes.submissions import forms, taking
from service.routes.submissions.taking import FromSender, Sender
from service.routes.venues import camera_of
from service.wire.job import Job
from service.wire.names import ID_PATTERN, OPTIONS_PART
from service.wire.options import LocateOptions
from service.wire.problems import Problem
from service.wire.venue import Camera, Venue

router = APIRouter(tags=["jobs"], route_class=Guarded)

UPLOAD = form(
    LocateOptions,
    "The points, and if you like the frame they were clicked in, its part named by the camera's id: then `points.jpg` "
    "shows them in it.",
    needed=[OPTIONS_PART],
)


@router.post(
    "/venues/{venue_id}/cameras/{camera}/locate",
    status_code=202,
    response_model=Job,
    responses=submitted("The job has ended, or this content is already a job")
    | problems(400, 404, 408, 409, 413, 415, 422, 429, 507),
    openapi_extra=UPLOAD | needs("calibrate"),
)
async def locate(
    venue_id: VenueIdPath,
    camera: Annotated[str, Path(pattern=ID_PATTERN)],
    request: Request,
    context: InContext,
    sender: FromSender,
    wait: Annotated[
        float, Query(ge=0, allow_inf_nan=False, description="Seconds that the answer is held, at most 60.")
    ] = 0,
) -> Response:
    """Find the first pose of a camera from points of the pitch and their pixels. The stored pose stays as it is.

    The job takes about a second and waits for no calibration; with `wait` the answer is its end.
    """
    forms.require_form(request)
    stored = await run_in_threadpool(forms.expecting, context, venue_id)
    async with forms.form_of(request, context, 1) as form:
        job, new = await run_in_threadpool(_submit, context, stored, camera, form, sender)
    job = await at_its_end(context, job, wait)
    return job_answer(job, status=202 if new and job.open else 200)


def _submit(context: Context, venue: Venue, camera_id: str, form: FormData, sender: Sender) -> tuple[Job, bool]:
    camera = camera_of(venue, camera_id)
    options = forms.options_of(form, LocateOptions, context.settings)
    return taking.take(context, venue, options, {camera_id: _frame(camera, form)}, sender)


def _frame(camera: Camera, form: FormData) -> list[UploadFile]:
    """The frame that was sent, or none."""
    frames = []
    for name, part in form.multi_items():
        if name == OPTIONS_PART:
            continue
        if name != camera.id:
            raise Problem(
                "unknown-camera",
                f"A frame of camera {camera.id} is a part named {camera.id}.",
                camera=name[:64],
                expected=[camera.id],
            )
        if not isinstance(part, UploadFile):
            raise Problem("not-a-file", f"Send the frame as a file, with curl: -F {name}=@frame.jpg", camera=name)
        frames.append(part)
    if len(frames) > 1:
        raise Problem(
            "too-many-frames",
            f"Send the one frame of camera {camera.id} that the points were clicked in.",
            camera=camera.id,
            expected=1,
            got=len(frames),
        )
    return frames
