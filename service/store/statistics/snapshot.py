"""The statistics that /metrics shows, read in one transaction from rows that are few or indexed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

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
ALARMS = sa.select(a.rule, sa.func.count().label("alarms")).group_by(a.rule)
RINGING = sa.select(a.venue, a.rule).group_by(a.venue, a.rule).order_by(sa.func.min(a.since))


@dataclass(frozen=True)
class QueuedJobs:
    """The queued jobs of a priority, and for how long the oldest has been waiting."""

    jobs: int
    oldest_s: float


@dataclass(frozen=True)
class StatisticsSnapshot:
    """Statistics of the database for /metrics, at one moment.

    `venues`: rows of `venue_quality`; `alarms`: the number of active ones by rule; `ringing`: venue and rule of those
    that have been active longest, whichever the camera.
    """

    queue: Mapping[int, QueuedJobs]
    running: int
    callbacks_waiting: int
    workers: list[WorkerHeartbeat]
    venues: Sequence[Any]
    alarms: Mapping[str, int]
    ringing: Sequence[Any]
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
            callbacks_waiting=connection.execute(
                sa.select(sa.func.count()).where(tables.deliveries.c.status == "waiting")
            ).scalar_one(),
            workers=heartbeats(connection, now),
            venues=_venues(connection, most_venues),
            alarms={row.rule: row.alarms for row in connection.execute(ALARMS)},
            ringing=connection.execute(RINGING.limit(most_venues)).all(),
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


def _venues(connection: sa.Connection, most: int) -> list[Any]:
    quality, error = sa.select(tables.venue_quality), q.stitch_error_px
    # Two looks at an index, not one at every venue: one camera has no stitch error.
    rows = list(connection.execute(quality.where(error.is_not(None)).order_by(error.desc()).limit(most)))
    return rows + list(connection.execute(quality.where(error.is_(None)).limit(most - len(rows))))
