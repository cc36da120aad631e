"""Pages for a new venue: a plan of its cameras, from frames alone, or from pitch, lenses and clicked first poses."""

import math
from typing import Annotated, Any, get_args

from fastapi import APIRouter, Query, Request, Response
from starlette.concurrency import run_in_threadpool

from fields.shapes import Arc, Line, Point, Shape
from fields.template import NAMES
from service.api.context import Context, InContext
from service.pages.page_rendering import Page, render_page
from service.routes.contract.documented import needs_scope
from service.routes.contract.guarded import Guarded
from service.routes.submissions.check import MOST_CALIBRATION_FILES, read_calibration
from service.routes.submissions.forms import parsed_upload
from service.routes.submissions.job_submission import FromSender
from service.schemas.field import FieldOfPlay
from service.schemas.names import ID_PATTERN, LensModel
from service.schemas.programs.clicked_pose import ClickedPose, ClickedPoseRequest

ARC_STEP_RAD = math.radians(4)
router = APIRouter(route_class=Page, include_in_schema=False)
data = APIRouter(prefix="/ui/new-venue", route_class=Guarded, include_in_schema=False)


@router.get("/ui/new-venue", openapi_extra=needs_scope("admin"))
def new_venue(request: Request, context: InContext) -> Response:
    """Show the form for a sport and a frame of each camera, from which a job finds the cameras."""
    return _described(request, context, "new_venue.html")


@router.get("/ui/new-venue/by-hand", openapi_extra=needs_scope("admin"))
def by_hand(request: Request, context: InContext) -> Response:
    """Show the guided form; its data stay in the browser until the venue is created."""
    return _described(request, context, "venue_by_hand.html")


@router.get("/ui/plan", openapi_extra=needs_scope("calibrate"))
def planning(request: Request) -> Response:
    """Show the form for a plan of cameras before they are mounted."""
    return render_page(request, "planning.html", templates=NAMES)


def _described(request: Request, context: Context, template: str) -> Response:
    return render_page(
        request,
        template,
        templates=NAMES,
        models=get_args(LensModel),
        most=round(context.settings.max_frame_mb * 1e6),
        free_id=context.venues.free_id(),
    )


@data.get("/free", openapi_extra=needs_scope("read"))
def free_id(context: InContext) -> dict[str, str]:
    """Propose an id for a new venue, for a page on which the one that it was given may have been taken meanwhile."""
    return {"id": context.venues.free_id()}


@data.get("/taken", openapi_extra=needs_scope("read"))
def is_id_taken(context: InContext, venue_id: Annotated[str, Query(alias="id", pattern=ID_PATTERN)]) -> dict[str, bool]:
    """Answer whether a venue has this id."""
    return {"taken": context.venues.get(venue_id) is not None}


@data.post("/plan", openapi_extra=needs_scope("read"))
def plan(field: FieldOfPlay) -> dict[str, Any]:
    """Answer a pitch from above: the field with all dimensions, its lines and its named points, in metres."""
    return {
        "field": field.model_dump(mode="json"),
        "lines": [_polyline(shape) for shape in field.markings],
        "points": field.plan.places(field.size),
    }


@data.post("/calibration", openapi_extra=needs_scope("admin"))
async def calibration(request: Request, context: InContext, sender: FromSender) -> dict[str, Any]:
    """Answer the cameras of a calibration of any tool, as a venue takes them, and which of its files were not read."""
    async with parsed_upload(request, context, None, "calibration", sender, MOST_CALIBRATION_FILES) as form:
        found = await run_in_threadpool(read_calibration, context, form)
    cameras = [one.model_dump(mode="json") for one in found.cameras_of_venue()]
    return {"format": found.format, "cameras": cameras, "not_read": found.not_read}


@data.post("/pose", openapi_extra=needs_scope("calibrate"))
async def pose(clicked: ClickedPoseRequest, context: InContext) -> ClickedPose:
    """Answer the pose of a camera by the points that were clicked so far."""
    return ClickedPose.model_validate_json(await context.clicked_poses.run(clicked.model_dump_json().encode()))


def _polyline(shape: Shape) -> list[Point]:
    match shape:
        case Line():
            return list(shape.points)
        case Arc():
            return _around(shape.centre, shape.radius, shape.start, shape.end)
        case _:
            return _around(shape.centre, shape.diameter / 2, 0.0, 2 * math.pi)


def _around(centre: Point, radius: float, start: float, end: float) -> list[Point]:
    steps = max(2, math.ceil((end - start) / ARC_STEP_RAD))
    angles = [start + (end - start) * step / steps for step in range(steps + 1)]
    return [(centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle)) for angle in angles]
