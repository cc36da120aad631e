"""What a camera shows now, fetched from its source."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Path, Response

from service.api.context import InContext, VenueIdPath
from service.intake.images import PNG_START
from service.routes.documented import needs, problems
from service.routes.guarded import Guarded
from service.routes.venues import no_such_venue
from service.wire.base import ID_PATTERN
from service.wire.problems import Problem

router = APIRouter(tags=["venues"], route_class=Guarded)
BINARY = {"schema": {"type": "string", "format": "binary"}}
PICTURE: dict[int | str, dict[str, Any]] = {200: {"content": {"image/jpeg": BINARY, "image/png": BINARY}}}


@router.get(
    "/venues/{venue_id}/cameras/{camera}/snapshot",
    openapi_extra=needs("read"),
    response_class=Response,
    responses={**PICTURE, **problems(404, 413, 422, 502)},
)
def snapshot(venue_id: VenueIdPath, camera: Annotated[str, Path(pattern=ID_PATTERN)], context: InContext) -> Response:
    """A frame of a camera from its source, as it came."""
    venue = context.venues.get(venue_id)
    if venue is None:
        raise no_such_venue(venue_id)
    chosen = [one for one in venue.cameras if one.id == camera]
    if not chosen:
        ids = [one.id for one in venue.cameras]
        raise Problem("no-such-camera", f"Venue {venue_id} has {', '.join(ids)}.", camera=camera, expected=ids)
    data = context.snapshots.take(chosen, context.venues.credentials(venue_id))[camera]
    media_type = "image/png" if data.startswith(PNG_START) else "image/jpeg"
    return Response(data, media_type=media_type, headers={"Cache-Control": "no-store"})
