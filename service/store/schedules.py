"""Schedules of venues: all SQL about them.

To fire is to put off first, as deliveries are attempted: one worker fires at a time, and whoever dies over it leaves it
to be fired again. The next time is reckoned from when the last one was done with, so times that were missed fire once.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa

from service.store import tables
from service.store.engine import Repository, clock, reading, serialise, writing
from service.wire.schedule import Schedule, ScheduleState, next_time, place_of
from service.wire.venue import Venue

LONGEST_ERROR = 500
FIRES_BY = ("cron", "time_zone", "exact")
s = tables.schedules.c


@dataclass(frozen=True)
class Firing:
    """The calibration of a venue that was due at a time."""

    venue_id: str
    due_at: datetime
    cron: str
    time_zone: str
    exact: bool


class Schedules(Repository):
    """The schedules in the database."""

    def fire(self, now: datetime, again_at: datetime, limit: int) -> list[Firing]:
        """Up to `limit` that are due; fired again at `again_at` unless they are done with before."""
        # Those that were put off go before those that have become due since.
        due = sa.select(tables.schedules).where(s.look_at <= now).order_by(s.due_at, s.look_at).limit(limit)
        with reading(self._engine) as connection:
            if connection.execute(due).first() is None:
                return []
        with writing(self._engine) as connection:
            serialise(connection, "schedules")
            rows = connection.execute(due).all()
            put_off = sa.update(tables.schedules).where(s.venue.in_([row.venue for row in rows]))
            connection.execute(put_off.values(look_at=again_at))
            return [Firing(row.venue, row.due_at, row.cron, row.time_zone, row.exact) for row in rows]

    def done(self, firing: Firing, now: datetime, job_id: str | None, error: str | None) -> None:
        """Wait for the next time. `error`: why there is no job."""
        next_at = _next(firing.venue_id, firing, now)
        brought = {} if job_id is None else {"last_job": job_id}
        self._write(firing, error, due_at=next_at, look_at=next_at, last_at=firing.due_at, **brought)

    def put_off(self, firing: Firing, until: datetime, why: str) -> None:
        """Fire it again at a moment, for the time that it was due at."""
        self._write(firing, why, look_at=until)

    def _write(self, firing: Firing, error: str | None, **values: datetime | str) -> None:
        # A venue that was put meanwhile with another schedule has other times.
        same = (
            s.venue == firing.venue_id,
            s.due_at == firing.due_at,
            s.cron == firing.cron,
            s.time_zone == firing.time_zone,
            s.exact == firing.exact,
        )
        last_error = None if error is None else error[:LONGEST_ERROR]
        with writing(self._engine) as connection:
            fired = sa.update(tables.schedules).where(*same)
            connection.execute(fired.values(last_error=last_error, **values))


def plan(connection: sa.Connection, venue: Venue) -> None:
    """Let a venue be calibrated by the schedule it has now, inside the caller's serialised transaction."""
    wanted = venue.schedule
    known = connection.execute(sa.select(tables.schedules).where(s.venue == venue.id)).one_or_none()
    if wanted and known and all(getattr(known, name) == getattr(wanted, name) for name in FIRES_BY):
        return
    connection.execute(sa.delete(tables.schedules).where(s.venue == venue.id))
    if wanted is not None:
        next_at = _next(venue.id, wanted, clock(connection))
        values = {name: getattr(wanted, name) for name in FIRES_BY} | {"due_at": next_at, "look_at": next_at}
        connection.execute(sa.insert(tables.schedules).values(venue=venue.id, **values))


def schedule_of(connection: sa.Connection, venue_id: str) -> ScheduleState | None:
    """When a venue is calibrated next, and what came of the last time."""
    row = connection.execute(sa.select(tables.schedules).where(s.venue == venue_id)).one_or_none()
    if row is None:
        return None
    return ScheduleState(next_at=row.due_at, last_at=row.last_at, last_job=row.last_job, last_error=row.last_error)


def _next(venue_id: str, schedule: Schedule | Firing, after: datetime) -> datetime:
    place = 0.0 if schedule.exact else place_of(venue_id)
    return next_time(schedule.cron, schedule.time_zone, after, place)
