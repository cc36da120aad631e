"""Plan of cameras before they are mounted."""

from typing import Annotated

from fastapi import APIRouter, Query, Response

from service.api.context import InContext
from service.routes.contract.documented import needs_scope
from service.routes.contract.guarded import Guarded
from service.schemas.plan import HiddenShare, LineStateName, PlanAnswer, PlannedSite, PlanRequest
from service.schemas.problems import Problem

router = APIRouter(tags=["venues"], route_class=Guarded)
# A plan takes as long as the cube of the number of its cameras.
MOST_CAMERAS = 12


@router.post("/plan", response_model=PlanAnswer, openapi_extra=needs_scope("calibrate"))
async def plan_site(
    site: PlannedSite,
    context: InContext,
    lines: Annotated[LineStateName, Query(description="State of the lines: `fresh` paint, `worn`, or `night`.")] = (
        "fresh"
    ),
    hidden: Annotated[HiddenShare, Query(description="Share of the lines that something covers.")] = 0.0,
) -> Response:
    """Plan cameras before they are mounted: how exactly they would be calibrated, as numbers, maps and warnings.

    The body is what `esc plan` reads: a field and up to 12 cameras, each with a place, a direction, a lens and an image
    size; a venue is one, too. Two cameras take a second or two, twelve half a minute. Nothing is stored.
    """
    cameras = len(site.cameras) + sum(stand.cameras for stand in site.stands)
    if cameras > MOST_CAMERAS:
        raise Problem(
            "invalid-request",
            f"Expected at most {MOST_CAMERAS} cameras, got {cameras}: plan a part of them at a time, or all of them "
            "with `esc plan`.",
        )
    made = await context.plans.run(PlanRequest(site=site, lines=lines, hidden=hidden).model_dump_json().encode())
    return Response(made, media_type="application/json")
