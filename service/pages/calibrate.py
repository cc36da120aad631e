"""Sending frames: which camera gets which, whether they fit, and how the calibration is to be done."""

from __future__ import annotations

from fastapi import APIRouter, Request, Response

from service.api.context import InContext
from service.pages.page_rendering import Page, render_page
from service.routes.contract.documented import needs_scope
from service.routes.venues import ExistingVenue

router = APIRouter(route_class=Page, include_in_schema=False)


@router.get("/ui/venues/{venue_id}/calibrate", openapi_extra=needs_scope("calibrate"))
def calibrate(venue: ExistingVenue, request: Request, context: InContext) -> Response:
    """The form that a calibration begins with."""
    limits = {
        "frames": context.settings.max_frames_per_camera,
        "bytes": round(context.settings.max_frame_mb * 1e6),
    }
    return render_page(request, "calibrate.html", venue=venue, limits=limits)
