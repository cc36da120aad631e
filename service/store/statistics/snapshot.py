"""The statistics that /metrics shows, read in one transaction from rows that are few or indexed."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa

from service.schemas.names import OPEN_STATUSES
from service.store import tables
from service.store.database import clock, reading
from service.store.live import LiveGauges, live_gauges
from service.store.schedules import lateness_s
from service.store.statistics import counters
from service.store.statistics.counters import CounterKey
from service.store.trends import most_moved
from service.store.venue_state import AnchorRow
from service.store.workers import WorkerHeartbeat, heartbeats

j = tables.jobs.c
q = tables.venue_quality.c
a = tables.alarms.c


@dataclass(frozen=True)
class QueuedJobs:
    """The queued jobs of a priority, and for how long the oldest has been waiting."""

    jobs: int
    oldest_s: float


@dataclass(frozen=True)
class VenueGauges:
    """Figures of a venue from its last result.

    `stitch_error_px` is that of the poses that hold since then: of the new ones if they were accepted, or else of those
    before. `moved_px`: how far the picture of the pitch was found to have moved, at the camera that moved most.
    `drift_px`: the same since a camera was put where it is, by the poses that hold.
    """

    venue: str
    stitch_error_px: float | None
    moved_px: float | None
    accepted_at: datetime | None
    drift_px: float | None = None


@dataclass(frozen=True)
class ActiveAlarm:
    """An alarm of a venue, of one of its cameras or of several."""

    venue: str
    rule: str


@dataclass(frozen=True)
class StatisticsSnapshot:
    """Statistics of the database for /metrics, at one moment."""

    queue: Mapping[int, QueuedJobs]
    running: int
    callbacks_waiting: int
    workers: list[WorkerHeartbeat]
    venues: list[VenueGauges]
    alarms: Mapping[str, int]
    ringing: list[ActiveAlarm]
    trends: list[AnchorRow]
    live: list[LiveGauges]
    # Seconds that a schedule has been due at most: where its cameras answer, and where they are slow or gave no frame.
    schedules_late_s: tuple[float, float]
    counters: Mapping[CounterKey, float]


def read_statistics(engine: sa.Engine, most_venues: int) -> StatisticsSnapshot:
    """Read all statistics in one transaction; of the venues those with the worst stitch errors.

    And of their cameras as many, those that have moved farthest; of live poses those that reported last.
    """
    with reading(engine) as connection:
        now = clock(connection)
        queue, running = _queue(connection, now)
        return StatisticsSnapshot(
            queue=queue,
            running=running,
            callbacks_waiting=_callbacks_waiting(connection),
            workers=heartbeats(connection, now),
            venues=_venues(connection, most_venues),
            alarms=_alarms(connection),
            ringing=_ringing(connection, most_venues),
            trends=most_moved(connection, most_venues),
            live=live_gauges(connection, most_venues, now),
            schedules_late_s=lateness_s(connection, now),
            counters=counters.read(connection),
        )


def _queue(connection: sa.Connection, now: datetime) -> tuple[dict[int, QueuedJobs], int]:
    count, oldest = sa.func.count().label("jobs"), sa.func.min(j.created_at, type_=j.created_at.type).label("oldest")
    query = (
        sa.select(j.status, j.priority, count, oldest).where(j.status.in_(OPEN_STATUSES)).group_by(j.status, j.priority)
    )
    rows = connection.execute(query).all()
    queue = {
        row.priority: QueuedJobs(row.jobs, max(0.0, (now - row.oldest).total_seconds()))
        for row in rows
        if row.status == "queued"
    }
    return queue, sum(row.jobs for row in rows if row.status == "running")


def _callbacks_waiting(connection: sa.Connection) -> int:
    waiting = sa.select(sa.func.count()).where(tables.deliveries.c.status == "waiting")
    return connection.execute(waiting).scalar_one()


def _venues(connection: sa.Connection, most: int) -> list[VenueGauges]:
    quality, error = sa.select(tables.venue_quality), q.stitch_error_px
    # Two looks at an index, not one at every venue: one camera has no stitch error.
    rows = list(connection.execute(quality.where(error.is_not(None)).order_by(error.desc()).limit(most)))
    rows += connection.execute(quality.where(error.is_(None)).limit(most - len(rows)))
    return [VenueGauges(row.venue, row.stitch_error_px, row.moved_px, row.accepted_at, row.drift_px) for row in rows]


def _alarms(connection: sa.Connection) -> dict[str, int]:
    """Return the number of active alarms by rule."""
    query = sa.select(a.rule, sa.func.count().label("alarms")).group_by(a.rule)
    return {row.rule: row.alarms for row in connection.execute(query)}


def _ringing(connection: sa.Connection, most: int) -> list[ActiveAlarm]:
    """Return the alarms that have been active longest, whichever the camera."""
    since = sa.func.min(a.since)
    query = sa.select(a.venue, a.rule).group_by(a.venue, a.rule).order_by(since).limit(most)
    return [ActiveAlarm(row.venue, row.rule) for row in connection.execute(query)]
