"""Sending frames: which camera gets which, whether they fit, and what is to be done with them."""

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
    """The form that a calibration begins with."""
    return _form(request, "calibrate.html", venue, context.settings)


@router.get("/ui/venues/{venue_id}/find", openapi_extra=needs_scope("calibrate"))
def find(venue: ExistingVenue, request: Request, context: InContext) -> Response:
    """The form by which cameras are looked for, wherever they are stored."""
    return _form(request, "find.html", venue, context.settings)


def _form(request: Request, template: str, venue: Venue, settings: Settings) -> Response:
    limits = {"frames": settings.max_frames_per_camera, "bytes": round(settings.max_frame_mb * 1e6)}
    return render_page(request, template, venue=venue, limits=limits)
