"""Stitched view of a venue for other tools, and its preview."""

import json
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Depends, Query, Request, Response
from starlette.concurrency import run_in_threadpool

from service.api.context import Context, InContext
from service.api.programs.drawings import drawable_frame
from service.routes.contract.documented import BINARY, header_docs, needs_scope
from service.routes.contract.guarded import Guarded
from service.routes.contract.problem_docs import problem_responses
from service.routes.contract.tagged import TAGGED, IfNoneMatch, is_known, tagged_response
from service.routes.venues import ExistingVenue
from service.schemas import etags
from service.schemas.names import Projection, StitchFormat
from service.schemas.problems import Problem
from service.schemas.programs.stitching import StitchRequest
from service.schemas.venue import Venue
from service.schemas.view import FieldOfView, Height, Horizon, Pan, ViewChoice, Width

router = APIRouter(prefix="/venues", tags=["venues"], route_class=Guarded)
# Edition of the files of a package: clients that have another one fetch it anew.
EDITION = 1
JPEG, ZIP = "image/jpeg", "application/zip"
Auto = Literal["auto"]
OR_AUTO = "`auto`: as it suits the cameras, whatever the venue's view says."


@dataclass(frozen=True)
class ViewQuery:
    """Changes of the venue's view in a query; `auto` in place of a number: as it suits the cameras."""

    projection: Annotated[Projection | None, Query(description="Absent, like all parts: as the venue's view.")] = None
    width_px: Annotated[Width | None, Query(description="Even.")] = None
    height_px: Annotated[Height | Auto | None, Query(description=f"Even. {OR_AUTO}")] = None
    field_of_view_deg: Annotated[FieldOfView | Auto | None, Query(description=OR_AUTO)] = None
    pan_deg: Annotated[Pan | None, Query(description="To the right.")] = None
    horizon: Annotated[Horizon | Auto | None, Query(description=f"0: top, 1: bottom. {OR_AUTO}")] = None

    def of(self, venue: Venue) -> ViewChoice:
        """Return the view of a venue with these changes."""
        given = {name: value for name, value in vars(self).items() if value is not None}
        changes = {name: None if value == "auto" else value for name, value in given.items()}
        return (venue.view or ViewChoice()).but(changes)


@router.get(
    "/{venue_id}/stitch",
    openapi_extra=needs_scope("read"),
    response_class=Response,
    responses={
        200: {"content": {ZIP: BINARY}, **header_docs("ETag")},
        304: TAGGED[304],
        **problem_responses("view-too-large", "extra-missing"),
    },
)
async def export_stitched_view(
    venue: ExistingVenue,
    context: InContext,
    request: Request,
    view: Annotated[ViewQuery, Depends()],
    form: Annotated[StitchFormat, Query(alias="format", description="What the maps are made for.")] = "ffmpeg",
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Export the stitched view for other tools: a zip with maps, weights and lights of each camera and what uses them.

    It holds until a pose, a lens, a light or the view changes: the `ETag` is made of those, and `If-None-Match` is
    answered before anything is computed. `poses.changed` of `/events` says when to ask.
    """
    revision = await run_in_threadpool(_revision, context, venue)
    asked = context.stitches.asked(venue, revision, view=view.of(venue), wanted=form, tag="")
    made_of = _made_of(asked)
    if is_known(made_of, if_none_match):
        return tagged_response(made_of, if_none_match, Response)
    key = request.state.key
    tagged = asked.model_copy(update={"tag": etags.quoted(etags.of(made_of))})
    content = await context.stitches.package(tagged, "" if key is None else key.name)
    head = {"Content-Disposition": f'attachment; filename="{venue.id}-stitch-{form}.zip"'}
    return tagged_response(made_of, None, lambda: Response(content, headers=head, media_type=ZIP))


@router.get(
    "/{venue_id}/stitch/preview",
    openapi_extra=needs_scope("read"),
    response_class=Response,
    responses={
        200: {"content": {JPEG: BINARY}, **header_docs("ETag")},
        304: TAGGED[304],
        **problem_responses("view-too-large", "no-frames", "extra-missing"),
    },
)
async def draw_stitched_view(
    venue: ExistingVenue,
    context: InContext,
    view: Annotated[ViewQuery, Depends()],
    seam: Annotated[bool, Query(description="Draw where one camera hands over to another.")] = False,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """Draw the stitched view of the frames of the last calibration whose poses were taken, at most 1280 pixels wide."""
    revision = await run_in_threadpool(_revision, context, venue)
    choice = {"view": view.of(venue), "wanted": "picture", "seam": seam}
    asked = context.stitches.asked(venue, revision, tag="", **choice)
    job = await run_in_threadpool(context.past_calibrations.last_taken, venue.id)
    made_of = _made_of(asked) + (job or "").encode()
    if is_known(made_of, if_none_match):
        return tagged_response(made_of, if_none_match, Response)
    frames = await run_in_threadpool(_frames, context, venue, job)
    picture = await context.stitches.preview(asked, frames)
    return tagged_response(made_of, None, lambda: Response(picture, media_type=JPEG))


def _made_of(asked: StitchRequest) -> bytes:
    """Return all that a package or picture depends on, without frames, threads and tag."""
    parts: dict[str, Any] = asked.model_dump(mode="json", exclude={"threads", "tag", "sizes"})
    return json.dumps([EDITION, parts]).encode()


def _revision(context: Context, venue: Venue) -> int:
    return context.venues.history(venue.id, None, 1)[0].revision


def _frames(context: Context, venue: Venue, job: str | None) -> dict[str, bytes]:
    """Return a frame of each camera, from those of a job; raises the problem `no-frames`."""
    drawable = None if job is None else context.jobs.drawable(job)
    pictures = None if job is None else context.jobs.pictures(job)
    sizes = {camera.id: camera.image_size for camera in venue.cameras}
    frames: dict[str, bytes] = {}
    if drawable is not None and pictures is not None:
        for camera in drawable.venue.cameras:
            path = drawable.frames.get(camera.id)
            frame = path and drawable_frame(context.blobs, path, pictures.folder, camera.id)
            if frame and sizes.get(camera.id) == camera.image_size:
                frames[camera.id] = frame
    if frames.keys() != sizes.keys():
        raise Problem("no-frames", "The next calibration that is accepted brings a frame of each camera.")
    return frames
