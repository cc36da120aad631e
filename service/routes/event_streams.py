"""Stream of a venue's events (server-sent events): its poses now, then every change."""

import time
from collections.abc import AsyncIterable
from typing import Annotated

import structlog
from fastapi import APIRouter, Depends, Header, Query
from fastapi.sse import EventSourceResponse, ServerSentEvent
from starlette.concurrency import run_in_threadpool

from service.api.context import InContext, VenueIdPath
from service.routes.contract.attribution import hide_other_actor
from service.routes.contract.documented import needs_scope
from service.routes.contract.followed import FOLLOWER_SLOT, LONGEST_S
from service.routes.contract.guarded import Guarded
from service.schemas.events.venue_event import FINAL_EVENT
from service.schemas.names import EVENT_KINDS, EventKind
from service.store.database import DATABASE_OUTAGES
from service.store.events.feed import NumberedEvent
from service.store.refusals import no_such_venue
from service.store.unreadable import UnreadableRow

log = structlog.get_logger()
router = APIRouter(tags=["venues"], route_class=Guarded)
# Events that are read at once.
PAGE = 50
# Between two looks, should one that was waited for be missed; the stream itself says ": ping" every 15 s.
LONGEST_POLL_INTERVAL_S = 30
# Digits of a number of 64 bits.
LONGEST_NUMBER = 19


def _last_seen_number(
    last_event_id: Annotated[str | None, Header(description="The id of the last event that arrived.")] = None,
) -> int | None:
    """Return the number of the last event that a client has seen, None if it sends no number of ours."""
    given = last_event_id or ""
    return int(given) if given.isascii() and given.isdecimal() and len(given) < LONGEST_NUMBER else None


LastSeenNumber = Annotated[int | None, Depends(_last_seen_number)]


def _followed_venue(venue_id: VenueIdPath, context: InContext, seen: LastSeenNumber) -> str:
    """Return the id of a venue that is stored, or whose deletion the client has not seen yet."""
    if context.venues.get(venue_id) is None and not (seen is not None and context.events.ends_after(venue_id, seen)):
        raise no_such_venue(venue_id)
    return venue_id


@router.get(
    "/venues/{venue_id}/events",
    openapi_extra=needs_scope("read"),
    response_class=EventSourceResponse,
    dependencies=[FOLLOWER_SLOT],
)
async def stream_venue_events(
    venue_id: Annotated[str, Depends(_followed_venue)],
    context: InContext,
    seen: LastSeenNumber,
    events: Annotated[list[EventKind], Query(max_length=len(EVENT_KINDS), description="Only these; absent: all.")] = [],  # noqa: B006
) -> AsyncIterable[ServerSentEvent]:
    """Stream what happens to a venue as server-sent events: each has the name of its `type`, and the body of a webhook.

    The first is `poses.current`, the poses that hold. Who comes back with the id of the last event that arrived
    (`Last-Event-ID`) gets what was missed instead; if that is more than is kept, `poses.current` again. The stream ends
    after `venue.deleted`, which is told after the fact as well, and otherwise after an hour: connect again.
    """
    until, number = time.monotonic() + LONGEST_S, seen or 0
    try:
        beginning = await run_in_threadpool(context.events.beginning, venue_id, seen)
        if beginning is not None:
            number = beginning.number
            yield _server_sent_event(beginning)
        while not context.venue_watch.closed and time.monotonic() < until:
            page = await run_in_threadpool(context.events.since, venue_id, number, events, PAGE)
            number = page.up_to
            for event in page.events:
                yield _server_sent_event(event)
                if event.event.type == FINAL_EVENT:
                    return
            if not page.more:
                await context.venue_watch.until(venue_id, number.__lt__, LONGEST_POLL_INTERVAL_S)
    except (*DATABASE_OUTAGES, UnreadableRow):
        # The client connects again, as after any stream that broke off.
        log.warning("cannot stream events of a venue", exc_info=True)


def _server_sent_event(event: NumberedEvent) -> ServerSentEvent:
    return ServerSentEvent(data=hide_other_actor(event.event), event=event.event.type, id=str(event.number))
