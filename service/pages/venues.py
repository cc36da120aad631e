"""All venues at a glance, and one of them: is the seam clean, did the cameras move, shall it be taken?"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Annotated, Any, get_args

from fastapi import APIRouter, Query, Request, Response

from service.api import etags
from service.api.context import InContext, VenueIdPath
from service.pages.shown import Page, page
from service.pages.sparkline import Sparkline, sparkline
from service.routes.contract.documented import needs
from service.routes.contract.guarded import Guarded
from service.routes.venues import ExistingVenue, tag_of
from service.store.counts.glances import Glance
from service.store.revisions import TAKEN
from service.store.stores import Stores
from service.wire.health import Alarm
from service.wire.history import Revision
from service.wire.job import Job
from service.wire.names import ID_PATTERN, FormatName
from service.wire.venue import Venue
from service.wire.view import ViewChoice

PER_PAGE = 50
# What a chart shows, and a table beside it.
IN_CHART, IN_TABLE = 1000, 12
# Of the trends: a year has every season in it, and three would be three times as slow to draw.
IN_TRENDS = timedelta(days=365)
router = APIRouter(route_class=Page, include_in_schema=False)
data = APIRouter(route_class=Guarded, include_in_schema=False)


@dataclass(frozen=True)
class Row:
    """A venue in the list: its last calibration that ended, the one that is going on, and what rings."""

    venue: Venue
    glance: Glance | None
    active: Job | None
    alarms: list[Alarm]

    @property
    def curve(self) -> Sparkline | None:
        """The stitch errors of the last results."""
        return sparkline(self.glance.errors, self.glance.limit_px) if self.glance else None


@router.get("/", openapi_extra=needs("read"))
def venues(
    request: Request, context: InContext, after: Annotated[str | None, Query(pattern=ID_PATTERN)] = None
) -> Response:
    """Every venue, with its last result."""
    found = context.venues.page(after, PER_PAGE + 1)
    shown, more = found[:PER_PAGE], len(found) > PER_PAGE
    return page(
        request, "venues.html", rows=rows_of(context, shown), after=shown[-1].id if more else None, first=not after
    )


def rows_of(context: Stores, venues: list[Venue]) -> list[Row]:
    """A few queries for all of them, however many jobs there are."""
    ids = [venue.id for venue in venues]
    glances, alarms = context.glances.of(ids), context.glances.alarms(ids)
    active = context.past_calibrations.active(ids)
    jobs = context.jobs.several(active.values())
    return [
        Row(venue, glances.get(venue.id), jobs.get(active.get(venue.id, "")), alarms.get(venue.id, []))
        for venue in venues
    ]


@router.get("/ui/venues/{venue_id}", openapi_extra=needs("read"))
def venue(stored: ExistingVenue, request: Request, context: InContext) -> Response:
    """One venue: its last result in pictures and numbers, and how it came to it."""
    venue_id = stored.id
    ends = context.past_calibrations.of(venue_id, IN_TABLE)
    newest = context.past_calibrations.newest_result(venue_id)
    job = context.jobs.get(newest) if newest else None
    revisions = context.venues.history(venue_id, None, IN_TABLE)
    health = context.venues.health(venue_id)
    active = context.past_calibrations.active([venue_id]).get(venue_id)
    a_year_ago = datetime.now(UTC) - IN_TRENDS
    return page(
        request,
        "venue.html",
        venue=stored,
        ends=ends,
        job=job,
        revisions=revisions,
        health=health,
        holds=job is not None and holds(job, revisions[0]),
        trends=[context.trends.of(stored, camera.id, a_year_ago) for camera in stored.cameras],
        active=context.jobs.get(active) if active else None,
        formats=get_args(FormatName),
        usual_view=ViewChoice(),
        previewed=context.past_calibrations.last_taken(venue_id) is not None,
        tag=etags.quoted(tag_of(stored)),
    )


@data.get("/ui/venues/{venue_id}/history.json", openapi_extra=needs("read"))
def history(venue_id: VenueIdPath, context: InContext) -> dict[str, Any]:
    """What the chart draws, oldest first: times in seconds, a value or null for each."""
    ends = [end for end in reversed(context.past_calibrations.of(venue_id, IN_CHART)) if end.accepted is not None]
    cameras = sorted({camera for end in ends for camera in end.moved})
    return {
        "at": [end.finished_at.timestamp() for end in ends],
        "job": [end.job for end in ends],
        "verdict": [end.verdict for end in ends],
        "accepted": [end.accepted for end in ends],
        "stitch_error_px": [end.stitch_error_px for end in ends],
        "stitch_error_limit_px": next((end.stitch_error_limit_px for end in reversed(ends)), None),
        "moved_px": {
            camera: [end.moved[camera].pixels if camera in end.moved else None for end in ends] for camera in cameras
        },
    }


def holds(job: Job, newest: Revision) -> bool:
    """Whether the poses that a job found are those that its venue has."""
    return newest.job == job.id and newest.cause in TAKEN
