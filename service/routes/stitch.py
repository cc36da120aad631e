"""The stitched view of a venue for other tools, and a preview of it."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Depends, Query, Response
from starlette.concurrency import run_in_threadpool

from service.api import etags
from service.api.context import Context, InContext
from service.routes.contract.documented import BINARY, headers, needs, problems
from service.routes.contract.guarded import Guarded
from service.routes.contract.tagged import TAGGED, IfNoneMatch, unless_known
from service.routes.venues import ExistingVenue
from service.store.jobs.files import source_file
from service.wire.names import Projection, StitchFormat
from service.wire.problems import Problem
from service.wire.programs.stitching import Stitching
from service.wire.venue import Venue
from service.wire.view import FieldOfView, Height, Horizon, Pan, ViewChoice, Width

router = APIRouter(prefix="/venues", tags=["venues"], route_class=Guarded)
# Of the files of a package: whoever has one of another edition fetches it anew.
EDITION = 1
JPEG, ZIP = "image/jpeg", "application/zip"
Auto = Literal["auto"]
OR_AUTO = "`auto`: as it suits the cameras, whatever the venue's view says."


@dataclass(frozen=True)
class View:
    """What a request wants otherwise than the venue's view has it; `auto` in place of a number: as it suits."""

    projection: Annotated[Projection | None, Query(description="Absent, like all parts: as the venue's view.")] = None
    width_px: Annotated[Width | None, Query(description="Even.")] = None
    height_px: Annotated[Height | Auto | None, Query(description=f"Even. {OR_AUTO}")] = None
    field_of_view_deg: Annotated[FieldOfView | Auto | None, Query(description=OR_AUTO)] = None
    pan_deg: Annotated[Pan | None, Query(description="To the right.")] = None
    horizon: Annotated[Horizon | Auto | None, Query(description=f"0: top, 1: bottom. {OR_AUTO}")] = None

    def of(self, venue: Venue) -> ViewChoice:
        """The view that is meant."""
        given = {name: value for name, value in vars(self).items() if value is not None}
        changes = {name: None if value == "auto" else value for name, value in given.items()}
        return (venue.view or ViewChoice()).but(changes)


@router.get(
    "/{venue_id}/stitch",
    openapi_extra=needs("read"),
    response_class=Response,
    responses={
        200: {"content": {ZIP: BINARY}, **headers("ETag")},
        304: TAGGED[304],
        **problems(404, 422, 503),
    },
)
def stitch_package(
    venue: ExistingVenue,
    context: InContext,
    view: Annotated[View, Depends()],
    form: Annotated[StitchFormat, Query(alias="format", description="What the maps are made for.")] = "ffmpeg",
    if_none_match: IfNoneMatch = None,
) -> Response:
    """The stitched view for other tools: a zip with maps, weights and lights of each camera and what uses them.

    It holds until a pose, a lens, a light or the view changes: the `ETag` is made of those, and `If-None-Match` is
    answered before anything is computed. `poses.changed` of `/events` says when to ask.
    """
    asked = context.stitches.asked(venue, _revision(context, venue), view=view.of(venue), wanted=form, tag="")

    def package() -> Response:
        tag = etags.quoted(etags.of(_made_of(asked)))
        content = context.stitches.package(asked.model_copy(update={"tag": tag}))
        head = {"Content-Disposition": f'attachment; filename="{venue.id}-stitch-{form}.zip"'}
        return Response(content, headers=head, media_type=ZIP)

    return unless_known(_made_of(asked), if_none_match, package)


@router.get(
    "/{venue_id}/stitch/preview",
    openapi_extra=needs("read"),
    response_class=Response,
    responses={
        200: {"content": {JPEG: BINARY}, **headers("ETag")},
        304: TAGGED[304],
        **problems(404, 422, 503),
    },
)
async def stitch_preview(
    venue: ExistingVenue,
    context: InContext,
    view: Annotated[View, Depends()],
    seam: Annotated[bool, Query(description="Draw where one camera hands over to another.")] = False,
    if_none_match: IfNoneMatch = None,
) -> Response:
    """The stitched view of the frames of the last calibration whose poses were taken, at most 1280 pixels wide."""
    revision = await run_in_threadpool(_revision, context, venue)
    choice = {"view": view.of(venue), "wanted": "picture", "seam": seam}
    asked = context.stitches.asked(venue, revision, tag="", **choice)
    job = await run_in_threadpool(context.past_calibrations.last_taken, venue.id)
    made_of = _made_of(asked) + (job or "").encode()
    tag = etags.of(made_of)
    if if_none_match is not None and etags.names(if_none_match, tag):
        return unless_known(made_of, if_none_match, Response)
    frames = await run_in_threadpool(_frames, context, venue, job)
    picture = await context.stitches.preview(asked, frames)
    return unless_known(made_of, None, lambda: Response(picture, media_type=JPEG))


def _made_of(asked: Stitching) -> bytes:
    """All that a package or picture follows from, but for the machine and its frames."""
    parts: dict[str, Any] = asked.model_dump(mode="json", exclude={"threads", "tag", "sizes"})
    return json.dumps([EDITION, parts]).encode()


def _revision(context: Context, venue: Venue) -> int:
    return context.venues.history(venue.id, None, 1)[0].revision


def _frames(context: Context, venue: Venue, job: str | None) -> dict[str, bytes]:
    """A frame of each camera, from those of a job."""
    drawable = None if job is None else context.jobs.drawable(job)
    pictures = None if job is None else context.jobs.pictures(job)
    sizes = {camera.id: camera.image_size for camera in venue.cameras}
    frames: dict[str, bytes] = {}
    if drawable is not None and pictures is not None:
        for camera in drawable.venue.cameras:
            path = drawable.frames.get(camera.id)
            frame = path and (context.blobs.get(path) or context.blobs.get(source_file(pictures.folder, camera.id)))
            if frame and sizes.get(camera.id) == camera.image_size:
                frames[camera.id] = frame
    if frames.keys() != sizes.keys():
        raise Problem("no-frames", "The next calibration that is accepted brings a frame of each camera.")
    return frames
