"""What a camera shows now, fetched from its source."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Path, Response

from service.api.context import InContext
from service.intake.images import PNG_START
from service.routes.contract.documented import BINARY, needs, problems
from service.routes.contract.guarded import Guarded
from service.routes.venues import ExistingVenue, camera_of
from service.wire.base import ID_PATTERN
from service.wire.venue import Camera

router = APIRouter(tags=["venues"], route_class=Guarded)
PICTURE: dict[int | str, dict[str, Any]] = {200: {"content": {"image/jpeg": BINARY, "image/png": BINARY}}}


def _camera(venue: ExistingVenue, camera: Annotated[str, Path(pattern=ID_PATTERN)]) -> Camera:
    return camera_of(venue, camera)


@router.get(
    "/venues/{venue_id}/cameras/{camera}/snapshot",
    openapi_extra=needs("read"),
    response_class=Response,
    responses={**PICTURE, **problems(404, 413, 422, 502)},
)
def snapshot(venue: ExistingVenue, camera: Annotated[Camera, Depends(_camera)], context: InContext) -> Response:
    """A frame of a camera from its source, as it came."""
    data = context.snapshots.take([camera], context.venues.credentials(venue.id))[camera.id]
    media_type = "image/png" if data.startswith(PNG_START) else "image/jpeg"
    return Response(data, media_type=media_type, headers={"Cache-Control": "no-store"})
