"""Forms of a venue: its settings, ignored areas and first poses, and frames for a calibration or a search."""

import json
from typing import get_args

from fastapi import APIRouter, Request, Response

from fields.template import NAMES
from service.api.context import InContext
from service.pages.alarm_suggestions import suggested_limits
from service.pages.page_rendering import Page, render_page
from service.routes.contract.documented import needs_scope
from service.routes.venues import ExistingVenue
from service.schemas import etags
from service.schemas.geometry import Intrinsics
from service.schemas.health import Alarms
from service.schemas.names import LensModel
from service.settings import Settings
from service.store.preconditions import venue_etag

# Calibrations and revisions that suggest limits of alarms: three months of nights.
SUGGESTED_BY = 100
router = APIRouter(route_class=Page, include_in_schema=False)


@router.get("/ui/venues/{venue_id}/settings", openapi_extra=needs_scope("admin"))
def settings(venue: ExistingVenue, request: Request, context: InContext) -> Response:
    """Show name, field, alarms and lenses of a venue, and the button that deletes it."""
    # Imported late: NumPy loads slowly.
    from service.schemas.lens_map import lens_doubts

    lenses = {camera.id: _readable(camera.intrinsics) for camera in venue.cameras}
    with_alarms = venue.model_copy(update={"alarms": venue.alarms or Alarms()})
    return render_page(
        request,
        "settings.html",
        venue=with_alarms,
        lenses=lenses,
        templates=NAMES,
        suggested=suggested_limits(
            context.past_calibrations.of(venue.id, SUGGESTED_BY),
            context.venues.history(venue.id, None, SUGGESTED_BY),
            [context.trends.of(venue, camera.id) for camera in venue.cameras],
        ),
        doubts={camera.id: lens_doubts(camera.intrinsics, camera.image_size) for camera in venue.cameras},
        tag=etags.quoted(venue_etag(venue)),
    )


@router.get("/ui/venues/{venue_id}/first-pose", openapi_extra=needs_scope("admin"))
def first_pose(venue: ExistingVenue, request: Request, context: InContext) -> Response:
    """Show the form for clicking points in new frames of a venue's cameras."""
    return render_page(
        request,
        "first_pose.html",
        venue=venue,
        venue_json=venue.model_dump_json(include={"id", "field", "cameras"}),
        models=get_args(LensModel),
        most=round(context.settings.max_frame_mb * 1e6),
        tag=etags.quoted(venue_etag(venue)),
    )


@router.get("/ui/venues/{venue_id}/ignore", openapi_extra=needs_scope("admin"))
def ignore(venue: ExistingVenue, request: Request, context: InContext) -> Response:
    """Show the ignored areas of each camera over the frames of the newest result."""
    newest = context.past_calibrations.newest_result(venue.id)
    job = context.jobs.get(newest) if newest else None
    links = job.links if job else {}
    frames = {camera.id: links.get(f"frame/{camera.id}") for camera in venue.cameras}
    return render_page(request, "ignore.html", venue=venue, frames=frames)


@router.get("/ui/venues/{venue_id}/calibrate", openapi_extra=needs_scope("calibrate"))
def calibrate(venue: ExistingVenue, request: Request, context: InContext) -> Response:
    """Show the form for a calibration."""
    return render_page(request, "calibrate.html", venue=venue, limits=_upload_limits(context.settings))


@router.get("/ui/venues/{venue_id}/find", openapi_extra=needs_scope("calibrate"))
def find(venue: ExistingVenue, request: Request, context: InContext) -> Response:
    """Show the form for a search for cameras."""
    return render_page(request, "find.html", venue=venue, limits=_upload_limits(context.settings))


def _upload_limits(limits: Settings) -> dict[str, int]:
    return {"frames": limits.max_frames_per_camera, "bytes": round(limits.max_frame_mb * 1e6)}


def _readable(lens: Intrinsics) -> str:
    """Return a lens as JSON with a line for each member."""
    parts = [f"  {json.dumps(name)}: {json.dumps(value)}" for name, value in lens.model_dump(mode="json").items()]
    return "{\n" + ",\n".join(parts) + "\n}"
