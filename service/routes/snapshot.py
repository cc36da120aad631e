"""Frame of what a camera shows now, fetched from its source."""

from fastapi import APIRouter, Response
from starlette.concurrency import run_in_threadpool

from service.api.context import CameraIdPath, InContext, VenueIdPath
from service.routes.contract.documented import PICTURE, needs_scope
from service.routes.contract.guarded import Guarded
from service.routes.contract.problem_docs import OF_IMAGES, OF_SOURCES, problem_responses
from service.schemas.file_kinds import picture_media_type
from service.store.refusals import camera_of

router = APIRouter(tags=["venues"], route_class=Guarded)


@router.get(
    "/venues/{venue_id}/cameras/{camera}/snapshot",
    openapi_extra=needs_scope("read"),
    response_class=Response,
    responses={200: {"content": PICTURE}, **problem_responses(*OF_SOURCES, "missing-camera", *OF_IMAGES, "frame-size")},
)
async def fetch_snapshot(venue_id: VenueIdPath, camera: CameraIdPath, context: InContext) -> Response:
    """Fetch a frame of a camera from its source, as it comes. Requests within two seconds get the same."""
    venue, credentials = await run_in_threadpool(context.venues.with_credentials, venue_id)
    data = await context.camera_views.frame(venue.id, camera_of(venue, camera), credentials)
    return Response(data, media_type=picture_media_type(data), headers={"Cache-Control": "no-store"})
