"""What the database knows that whoever watches the service wants to know: one look, at rows that are few or indexed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import sqlalchemy as sa

from service.store import tables
from service.store.counts import tallies
from service.store.counts.tallies import Key
from service.store.engine import clock, reading
from service.store.trends import CameraTrend, most_moved
from service.store.workers import SeenWorker, seen
from service.wire.names import OPEN
from service.wire.results import Result

j = tables.jobs.c
q = tables.venue_quality.c
a = tables.alarms.c


@dataclass(frozen=True)
class Waiting:
    """The queued jobs of a priority, and for how long the oldest has been waiting."""

    jobs: int
    oldest_s: float


@dataclass(frozen=True)
class VenueQuality:
    """What the last result of a venue said.

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
class Ringing:
    """An alarm of a venue, of one of its cameras or of several."""

    venue: str
    rule: str


@dataclass(frozen=True)
class Figures:
    """One look."""

    queue: Mapping[int, Waiting]
    running: int
    callbacks_waiting: int
    workers: list[SeenWorker]
    venues: list[VenueQuality]
    alarms: Mapping[str, int]
    ringing: list[Ringing]
    trends: list[CameraTrend]
    tallies: Mapping[Key, float]


def look(engine: sa.Engine, most_venues: int) -> Figures:
    """Read it all in one state of the database; of the venues those with the worst stitch errors.

    And of their cameras as many, those that have moved farthest.
    """
    with reading(engine) as connection:
        now = clock(connection)
        queue, running = _queue(connection, now)
        return Figures(
            queue=queue,
            running=running,
            callbacks_waiting=_callbacks_waiting(connection),
            workers=seen(connection, now),
            venues=_venues(connection, most_venues),
            alarms=_alarms(connection),
            ringing=_ringing(connection, most_venues),
            trends=most_moved(connection, most_venues),
            tallies=tallies.read(connection),
        )


def note_quality(connection: sa.Connection, venue_id: str, result: Result, *, moved: bool) -> None:
    """Write down what a result says about its venue, inside the caller's serialised transaction.

    `moved`: poses of it hold from now on.
    """
    shifts = [camera.moved.pixels for camera in result.cameras if camera.moved.pixels is not None]
    note(
        connection,
        venue_id,
        stitch_error_px=result.stitch_error_px if moved else result.stitch_error_before_px,
        moved_px=max(shifts, default=None),
    )


def note(connection: sa.Connection, venue_id: str, **values: Any) -> None:
    """Write down what is known of a venue now, inside the caller's serialised transaction."""
    known = sa.update(tables.venue_quality).where(q.venue == venue_id).values(venue=venue_id, **values)
    if connection.execute(known).rowcount == 0:
        connection.execute(sa.insert(tables.venue_quality).values(venue=venue_id, **values))


def _queue(connection: sa.Connection, now: datetime) -> tuple[dict[int, Waiting], int]:
    count, oldest = sa.func.count().label("jobs"), sa.func.min(j.created_at, type_=j.created_at.type).label("oldest")
    query = sa.select(j.status, j.priority, count, oldest).where(j.status.in_(OPEN)).group_by(j.status, j.priority)
    rows = connection.execute(query).all()
    queue = {
        row.priority: Waiting(row.jobs, max(0.0, (now - row.oldest).total_seconds()))
        for row in rows
        if row.status == "queued"
    }
    return queue, sum(row.jobs for row in rows if row.status == "running")


def _callbacks_waiting(connection: sa.Connection) -> int:
    waiting = sa.select(sa.func.count()).where(tables.deliveries.c.status == "waiting")
    return connection.execute(waiting).scalar_one()


def _venues(connection: sa.Connection, most: int) -> list[VenueQuality]:
    quality, error = sa.select(tables.venue_quality), q.stitch_error_px
    # Two looks at an index, not one at every venue: one camera has no stitch error.
    rows = list(connection.execute(quality.where(error.is_not(None)).order_by(error.desc()).limit(most)))
    rows += connection.execute(quality.where(error.is_(None)).limit(most - len(rows)))
    return [VenueQuality(row.venue, row.stitch_error_px, row.moved_px, row.accepted_at, row.drift_px) for row in rows]


def _alarms(connection: sa.Connection) -> dict[str, int]:
    """How many ring, by rule."""
    query = sa.select(a.rule, sa.func.count().label("alarms")).group_by(a.rule)
    return {row.rule: row.alarms for row in connection.execute(query)}


def _ringing(connection: sa.Connection, most: int) -> list[Ringing]:
    """Those that have rung for longest, whichever the camera."""
    since = sa.func.min(a.since)
    query = sa.select(a.venue, a.rule).group_by(a.venue, a.rule).order_by(since).limit(most)
    return [Ringing(row.venue, row.rule) for row in connection.execute(query)]
