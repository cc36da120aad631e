"""Forms that upload frames, for a calibration or a search for cameras."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from service.api.context import InContext
from service.pages.page_rendering import Page, render_page
from service.routes.contract.documented import needs_scope
from service.routes.venues import ExistingVenue
from service.schemas.venue import Venue
from service.settings import Settings

router = APIRouter(route_class=Page, include_in_schema=False)


@router.get("/ui/venues/{venue_id}/calibrate", openapi_extra=needs_scope("calibrate"))
def calibrate(venue: ExistingVenue, request: Request, context: InContext) -> Response:
    """Show the form for a calibration."""
    return _form(request, "calibrate.html", venue, context.settings)


@router.get("/ui/venues/{venue_id}/find", openapi_extra=needs_scope("calibrate"))
def find(venue: ExistingVenue, request: Request, context: InContext) -> Response:
    """Show the form for a search for cameras."""
    return _form(request, "find.html", venue, context.settings)


def _form(request: Request, template: str, venue: Venue, settings: Settings) -> Response:
    limits = {"frames": settings.max_frames_per_camera, "bytes": round(settings.max_frame_mb * 1e6)}
    return render_page(request, template, venue=venue, limits=limits)
