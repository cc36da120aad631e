"""Pictures of jobs, and layers to lay over them."""

from typing import Annotated

from fastapi import APIRouter, Path, Response
from starlette.concurrency import run_in_threadpool

from service.api.context import CameraIdPath, Context, InContext
from service.routes.contract.documented import BINARY, PICTURE, needs_scope
from service.routes.contract.guarded import Guarded
from service.routes.contract.problem_docs import problem_responses
from service.routes.jobs import ExistingJob
from service.schemas.file_kinds import picture_media_type
from service.schemas.job import Job
from service.schemas.problems import Problem
from service.store.blobs import DamagedBlob
from service.store.jobs.queries import Pictures

router = APIRouter(prefix="/jobs", tags=["jobs"], route_class=Guarded)

# Name of the route, address below that of the job, description. The picture's name is the address without its suffix,
# with underscores for slashes.
PICTURES = (
    ("get_preview", "preview.jpg", "Draw one wide view stitched from all cameras by the poses that were found."),
    ("get_preview_before", "preview/before.jpg", "Draw the stitched view by the poses that were stored."),
    ("get_seam", "seam.png", "Draw where in the stitched view one camera hands over to another, to lay over it."),
    ("get_birdseye", "birdseye.jpg", "Draw the pitch from above, 10 px/m, more of small ones."),
    ("get_overlay", "overlay/{camera}.jpg", "Draw the field on a camera's frame, before and after."),
    (
        "get_camera_frame",
        "frame/{camera}.jpg",
        "Return a camera's frame, at most 1920 pixels wide, which the three layers are for.",
    ),
    ("get_stored_layer", "stored/{camera}.png", "Draw the field by the pose that was stored, to lay over a frame."),
    ("get_new_layer", "new/{camera}.png", "Draw the field by the pose that was found, to lay over a frame."),
    ("get_mask_layer", "mask/{camera}.png", "Draw where the network saw markings, to lay over a frame."),
    (
        "get_board_coverage",
        "coverage.jpg",
        "Draw where in the picture of a lens the board was seen, and residuals enlarged.",
    ),
    (
        "get_candidate_overlay",
        "candidate/{camera}/{number}.jpg",
        "Draw the field on a camera's frame as a candidate of it has it, from 1, the best first.",
    ),
    (
        "get_clicked_points",
        "points.jpg",
        "Draw the clicked points of a first pose and the pitch as the pose has it, in the frame if one was sent.",
    ),
)


def _show(route: str, address: str, shows: str) -> None:
    name, _, suffix = address.replace("/", "_").partition(".")

    async def of_job(job: ExistingJob, context: InContext) -> Response:
        return await _picture(context, job, name)

    async def of_camera(job: ExistingJob, camera: CameraIdPath, context: InContext) -> Response:
        return await _picture(context, job, name.format(camera=camera))

    async def of_candidate(
        job: ExistingJob,
        camera: CameraIdPath,
        number: Annotated[int, Path(ge=1, le=100, description="Number of the candidate, from 1.")],
        context: InContext,
    ) -> Response:
        return await _picture(context, job, name.format(camera=camera, number=number))

    router.add_api_route(
        f"/{{job_id}}/{address}",
        of_candidate if "{number}" in address else of_camera if "{camera}" in address else of_job,
        name=route,
        description=shows,
        openapi_extra=needs_scope("read"),
        response_class=Response,
        responses={
            200: {"content": {"image/png" if suffix == "png" else "image/jpeg": BINARY}},
            **problem_responses("picture-not-found", "picture-deleted"),
        },
    )


async def _picture(context: Context, job: Job, name: str) -> Response:
    pictures = await run_in_threadpool(context.jobs.pictures, job.id)
    if pictures is None or name not in pictures.names:
        detail = "The job has not come to its pictures yet." if job.open else "The job made no such picture."
        raise Problem("picture-not-found", detail, job=job.id)
    data = None if pictures.deleted else await context.drawings.picture(job.id, pictures, name)
    if data is None:
        raise Problem("picture-deleted", _why_deleted(pictures, context.settings.keep_pictures_days), job=job.id)
    return _shown(data)


def _shown(data: bytes) -> Response:
    return Response(data, media_type=picture_media_type(data), headers={"Cache-Control": "private, max-age=3600"})


def _why_deleted(pictures: Pictures, keep_days: float) -> str:
    if pictures.deleted:
        return f"Pictures are deleted {keep_days:g} days after the end of their job; the job and its numbers stay."
    return "Its file, or the frames to draw it of, are gone from the store or damaged, and not by the service."


for each in PICTURES:
    _show(*each)


@router.get(
    "/{job_id}/frames/{number}",
    openapi_extra=needs_scope("read"),
    response_class=Response,
    responses={200: {"content": PICTURE}, **problem_responses("picture-not-found", "frames-deleted")},
)
def get_frame(
    job: ExistingJob,
    number: Annotated[int, Path(ge=0, le=10_000, description="Number of the frame, from 0.")],
    context: InContext,
) -> Response:
    """Return a frame or photo of a job as it came. `frames` of the job has the addresses of all."""
    path = context.jobs.frame(job.id, number)
    try:
        data = None if path is None else context.blobs.read(path)
    except DamagedBlob as damage:
        detail = f"The frame was damaged in the store, and not by the service: {damage}."
        raise Problem("frames-deleted", detail, job=job.id) from None
    if data is None and job.frames:
        raise Problem("picture-not-found", "The job has no frame of this number.", job=job.id)
    if data is None:
        kept = f"{context.settings.keep_frames_days:g} days"
        raise Problem("frames-deleted", f"It never had any, or they were deleted {kept} after its end.", job=job.id)
    return _shown(data)
