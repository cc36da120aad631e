"""Page for drawing the ignored areas of a venue's cameras."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from service.api.context import InContext
from service.pages.page_rendering import Page, render_page
from service.routes.contract.documented import needs_scope
from service.routes.venues import ExistingVenue

router = APIRouter(route_class=Page, include_in_schema=False)


@router.get("/ui/venues/{venue_id}/ignore", openapi_extra=needs_scope("admin"))
def ignore(venue: ExistingVenue, request: Request, context: InContext) -> Response:
    """Show the ignored areas of each camera over the frames of the newest result."""
    newest = context.past_calibrations.newest_result(venue.id)
    job = context.jobs.get(newest) if newest else None
    links = job.links if job else {}
    frames = {camera.id: links.get(f"frame/{camera.id}") for camera in venue.cameras}
    return render_page(request, "ignore.html", venue=venue, frames=frames)
