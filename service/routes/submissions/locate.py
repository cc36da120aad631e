"""Submission of first poses: clicked points become a job that finds the pose of a camera."""

from typing import Annotated

from fastapi import APIRouter, Query, Request, Response
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import FormData, UploadFile

from service.api.context import CameraIdPath, Context, InContext
from service.routes.contract.documented import form_body
from service.routes.contract.guarded import Guarded
from service.routes.contract.problem_docs import OF_FRAMES
from service.routes.jobs import job_response, wait_for_end
from service.routes.submissions import forms, job_submission
from service.routes.submissions.job_submission import FromSender, Sender, submits_job
from service.routes.venues import ExistingVenue
from service.schemas.job import Job
from service.schemas.names import OPTIONS_PART
from service.schemas.options import LocateOptions
from service.schemas.problems import Problem
from service.schemas.venue import Camera, Venue
from service.store.refusals import camera_of

router = APIRouter(tags=["jobs"], route_class=Guarded)

UPLOAD = form_body(
    LocateOptions,
    "The points, and if you like the frame they were clicked in, its part named by the camera's id: then `points.jpg` "
    "shows them in it.",
    needed=[OPTIONS_PART],
)


@submits_job(
    router,
    "/venues/{venue_id}/cameras/{camera}/locate",
    UPLOAD,
    OF_FRAMES,
    known="The job has ended, or this content is already a job",
)
async def submit_first_pose(
    venue: ExistingVenue,
    camera: CameraIdPath,
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
    async with forms.parsed_upload(request, context, venue.id, "locate", sender, 1) as form:
        job, new = await run_in_threadpool(_submit, context, venue, camera, form, sender)
    job = await wait_for_end(context, job, wait)
    return job_response(job, status=202 if new and job.open else 200)


def _submit(context: Context, venue: Venue, camera_id: str, form: FormData, sender: Sender) -> tuple[Job, bool]:
    camera = camera_of(venue, camera_id)
    options = forms.parse_options(form, LocateOptions, context.settings)
    return job_submission.submit_files(context, venue, options, {camera_id: _frame(camera, form)}, sender)


def _frame(camera: Camera, form: FormData) -> list[UploadFile]:
    """Return the frame that was sent, in a list that is empty without one."""
    files = forms.files_by_camera(form, (OPTIONS_PART,))
    frames = files.pop(camera.id, [])
    if files:
        detail = f"A frame of camera {camera.id} is a part named {camera.id}."
        raise Problem("unknown-camera", detail, camera=next(iter(files))[:64], expected=[camera.id])
    if len(frames) > 1:
        detail = f"Send the one frame of camera {camera.id} that the points were clicked in."
        raise Problem("too-many-frames", detail, camera=camera.id, expected=1, got=len(frames))
    return frames
