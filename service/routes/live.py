"""Reports about the live poses of a venue, from the process that sends them."""

import time
from collections.abc import AsyncIterable
from functools import partial
from operator import ne
from typing import Annotated

import structlog
from fastapi import APIRouter, Query
from fastapi.sse import EventSourceResponse, ServerSentEvent
from starlette.concurrency import run_in_threadpool

from service.api.context import InContext, VenueIdPath
from service.routes.contract.documented import needs_scope
from service.routes.contract.followed import FOLLOWER_SLOT, LONGEST_S
from service.routes.contract.guarded import Guarded
from service.routes.contract.problem_docs import problem_responses
from service.routes.venues import ExistingVenue
from service.schemas.live import LONGEST_HISTORY_MIN, LiveHistory, LiveReport, LiveState
from service.store.database import DATABASE_OUTAGES

log = structlog.get_logger()
router = APIRouter(prefix="/venues/{venue_id}/live", tags=["venues"], route_class=Guarded)
EVENT = "live"
# Without news it is looked whether the venue is still there; the stream itself says ": ping" every 15 s.
LONGEST_WAIT_S = 5


@router.put("", status_code=204, openapi_extra=needs_scope("calibrate"), responses=problem_responses("unknown-camera"))
def report_live_poses(venue_id: VenueIdPath, report: LiveReport, context: InContext) -> None:
    """Report how the live poses of a venue are doing; `esc live` does so twice a second.

    The newest report is kept, and what all of them say by the minute. Counts are those since the last report that was
    answered. Twice the same counts are added twice.
    """
    context.live.report(venue_id, report)


@router.get("", openapi_extra=needs_scope("read"))
def get_live_state(venue: ExistingVenue, context: InContext) -> LiveState:
    """Tell how the live poses of a venue are doing: the newest report of the process that sends them.

    A venue that never had one is `running: false` without cameras.
    """
    return context.live.state(venue.id)


@router.get(
    "/poses", openapi_extra=needs_scope("read"), response_class=EventSourceResponse, dependencies=[FOLLOWER_SLOT]
)
async def stream_live_poses(venue: ExistingVenue, context: InContext) -> AsyncIterable[ServerSentEvent]:
    """Stream the newest report of a venue's live poses as server-sent events named `live`, at most twice a second.

    The first comes at once, the others when something has changed: a new report, or that none came for five seconds.
    The stream ends when the venue is deleted, and otherwise after an hour: connect again.
    """
    until = time.monotonic() + LONGEST_S
    try:
        state = await run_in_threadpool(context.live.state, venue.id)
        yield ServerSentEvent(data=state, event=EVENT)
        while time.monotonic() < until:
            news = await context.live_watch.until(venue.id, partial(ne, state), LONGEST_WAIT_S)
            if news is not None:
                state = news
                yield ServerSentEvent(data=state, event=EVENT)
            elif context.live_watch.closed or not await run_in_threadpool(context.live.newest, [venue.id]):
                return
    except DATABASE_OUTAGES:
        # The client connects again, as after any stream that broke off.
        log.warning("cannot stream live poses", exc_info=True)


@router.get("/history", openapi_extra=needs_scope("read"))
def get_live_history(
    venue: ExistingVenue,
    context: InContext,
    minutes: Annotated[
        int, Query(ge=1, le=LONGEST_HISTORY_MIN, description="So many of the last; at most a week is kept.")
    ] = 60,
) -> LiveHistory:
    """Tell how the live poses of a venue were doing, minute by minute, oldest first."""
    return LiveHistory(venue=venue.id, minutes=context.live.history(venue.id, minutes))
