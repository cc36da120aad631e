"""Pages of venues: the list, and one venue with its last result, history and settings."""

from collections.abc import Collection
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from http import HTTPStatus
from typing import Annotated, Any, Literal, get_args

from fastapi import APIRouter, Query, Request, Response

from service.api.context import Context, InContext, VenueIdPath
from service.pages.live import CLOCKS, STATUSES, live_card
from service.pages.outcome import CAME_BY, outcome_of, poses_in_use
from service.pages.page_rendering import Page, render_page
from service.pages.sparkline import Sparkline, sparkline
from service.routes.contract.attribution import hide_other_actor
from service.routes.contract.documented import needs_scope
from service.routes.contract.guarded import Guarded
from service.routes.contract.restricted import OnlyVenues
from service.routes.venues import existing_venue
from service.schemas import etags
from service.schemas.health import Alarm, VenueHealth
from service.schemas.history import Cause, Revision
from service.schemas.job import Job
from service.schemas.names import ID_PATTERN, FormatName
from service.schemas.venue import Venue
from service.schemas.view import ViewChoice
from service.store.preconditions import venue_etag
from service.store.repositories import Repositories
from service.store.statistics.venue_quality import CalibrationSummary
from service.store.unreadable import UnreadableRow

PER_PAGE = 50
# Calibrations in the chart of the history, and in its table.
IN_CHART, IN_TABLE = 1000, 12
# Time that trends show: a year has all seasons, and three years would take three times as long to draw.
IN_TRENDS = timedelta(days=365)
router = APIRouter(route_class=Page, include_in_schema=False)
data = APIRouter(route_class=Guarded, include_in_schema=False)


@dataclass(frozen=True)
class VenueRow:
    """A venue in the list: summary of its calibrations, active job, alarms, and the last decision of a person."""

    venue: Venue
    summary: CalibrationSummary | None
    active: Job | None
    alarms: list[Alarm]
    decided: tuple[Cause, datetime] | None

    @property
    def decision(self) -> Literal["Undone", "Accepted by hand"] | None:
        """Decision of a person since the last calibration ended."""
        if self.decided is None or self.summary is None or self.decided[1] < self.summary.last.finished_at:
            return None
        return "Undone" if self.decided[0] == "restored" else "Accepted by hand"

    @property
    def curve(self) -> Sparkline | None:
        """Curve of the last stitch errors."""
        return sparkline(self.summary.errors, self.summary.limit_px) if self.summary else None


@router.get("/", openapi_extra=needs_scope("read"))
def venues(
    request: Request,
    context: InContext,
    only: OnlyVenues,
    after: Annotated[str | None, Query(pattern=ID_PATTERN)] = None,
) -> Response:
    """List venues with their last results."""
    with context.snapshot():
        found = context.venues.page(after, PER_PAGE, only)
        rows = venue_rows(context, found.venues)
    return render_page(
        request, "venues.html", rows=rows, unreadable=found.unreadable, after=found.next_cursor, first=not after
    )


def venue_rows(context: Repositories, venues: list[Venue]) -> list[VenueRow]:
    """Return the rows of venues, with a fixed number of queries."""
    ids = [venue.id for venue in venues]
    summaries, alarms = context.venues.calibration_summaries(ids), context.venues.alarms(ids)
    active, decided = context.past_calibrations.active(ids), context.past_calibrations.decided(ids)
    jobs = context.jobs.several(active.values())
    return [
        VenueRow(
            venue,
            summaries.get(venue.id),
            jobs.get(active.get(venue.id, "")),
            alarms.get(venue.id, []),
            decided.get(venue.id),
        )
        for venue in venues
    ]


@router.get("/ui/venues/{venue_id}", openapi_extra=needs_scope("read"))
def venue(venue_id: VenueIdPath, request: Request, context: InContext) -> Response:
    """Show a venue: its last result and how it came to it, or the ways out where it cannot be read."""
    try:
        with context.snapshot():
            content = _venue_content(venue_id, context)
    except UnreadableRow as unreadable:
        revisions = context.venues.history(venue_id, None, IN_TABLE)
        return render_page(
            request,
            "unreadable.html",
            HTTPStatus.CONFLICT,
            venue_id=venue_id,
            unreadable=unreadable,
            revisions=[hide_other_actor(one) for one in revisions],
            restorable=context.venues.repairing(venue_id, [one.revision for one in revisions]),
        )
    return render_page(request, "venue.html", **content)


def _venue_content(venue_id: str, context: Context) -> dict[str, Any]:
    """Return the content of the page of a venue. Raises `UnreadableRow`."""
    stored = existing_venue(venue_id, context)
    newest = context.past_calibrations.newest_result(venue_id)
    active = context.past_calibrations.active([venue_id]).get(venue_id)
    jobs = context.jobs.several([one for one in (newest, active) if one])
    job = jobs.get(newest or "")
    revisions = context.venues.history(venue_id, None, IN_TABLE)
    health = context.venues.health(venue_id)
    in_use = poses_in_use(context, venue_id)
    a_year_ago = datetime.now(UTC) - IN_TRENDS
    return {
        "venue": stored,
        "ends": context.past_calibrations.of(venue_id, IN_TABLE),
        "job": job,
        "revisions": [hide_other_actor(one) for one in revisions],
        "remembering": context.venues.with_memories(venue_id),
        "health": health,
        "in_use": in_use,
        "outcome": outcome_of(context, job, in_use),
        "came_by": CAME_BY,
        "undone": undone_jobs(revisions),
        "sizes": sizes_of(stored),
        "adoptable": context.adoption.adoptable_numbers(job.id) if job else {},
        "restorable": context.venues.restorable(stored, [one.revision for one in revisions]),
        "kept_jobs": kept_jobs(context, revisions, health),
        "trends": [context.trends.of(stored, camera.id, a_year_ago) for camera in stored.cameras],
        "active": jobs.get(active or ""),
        "live_poses": live_card(context, venue_id),
        "live_statuses": STATUSES,
        "live_clocks": CLOCKS,
        "formats": get_args(FormatName),
        "usual_view": ViewChoice(),
        "previewed": context.past_calibrations.last_taken(venue_id) is not None,
        "tag": etags.quoted(venue_etag(stored)),
        "seen": context.events.newest([venue_id]).get(venue_id, 0),
    }


def undone_jobs(revisions: list[Revision]) -> Collection[str]:
    """Return the jobs whose poses were undone and not accepted again; `revisions`: newest first."""
    last = {one.job: one.cause for one in reversed(revisions) if one.job}
    return {job for job, cause in last.items() if cause == "restored"}


def kept_jobs(context: Repositories, revisions: list[Revision], health: VenueHealth | None) -> Collection[str]:
    """Return the jobs of revisions and schedule that still exist."""
    jobs = {one.job for one in revisions if one.job}
    if health and health.schedule and health.schedule.last_job:
        jobs.add(health.schedule.last_job)
    return context.jobs.states(jobs).keys()


@data.get("/ui/venues/{venue_id}/history.json", openapi_extra=needs_scope("read"))
def history(venue_id: VenueIdPath, context: InContext) -> dict[str, Any]:
    """Answer the data of the chart, oldest first: times in seconds, and a value or null for each."""
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
            # No shift at all: no pose was found.
            camera: [end.moved[camera].pixels or None if camera in end.moved else None for end in ends]
            for camera in cameras
        },
    }


def sizes_of(venue: Venue | None) -> dict[str, list[int]]:
    """Return width and height of each camera's frames."""
    return {camera.id: camera.image_size for camera in venue.cameras} if venue else {}
