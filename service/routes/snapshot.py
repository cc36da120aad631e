"""What a camera shows now, fetched from its source."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Path, Response

from service.api.context import InContext, VenueIdPath
from service.intake.images import PNG_START
from service.routes.contract.documented import BINARY, needs, problems
from service.routes.contract.guarded import Guarded
from service.routes.venues import camera_of, no_such_venue
from service.wire.names import ID_PATTERN

router = APIRouter(tags=["venues"], route_class=Guarded)
PICTURE: dict[int | str, dict[str, Any]] = {200: {"content": {"image/jpeg": BINARY, "image/png": BINARY}}}


@router.get(
    "/venues/{venue_id}/cameras/{camera}/snapshot",
    openapi_extra=needs("read"),
    response_class=Response,
    responses={**PICTURE, **problems(404, 413, 422, 502)},
)
def snapshot(venue_id: VenueIdPath, camera: Annotated[str, Path(pattern=ID_PATTERN)], context: InContext) -> Response:
    """A frame of a camera from its source, as it came."""
    found = context.venues.with_credentials(venue_id)
    if found is None:
        raise no_such_venue(venue_id)
    venue, credentials = found
    data = context.snapshots.take([camera_of(venue, camera)], credentials)[camera]
    media_type = "image/png" if data.startswith(PNG_START) else "image/jpeg"
    return Response(data, media_type=media_type, headers={"Cache-Control": "no-store"})
