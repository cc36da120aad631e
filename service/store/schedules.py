"""Schedules of venues: all SQL about them.

To fire is to put off first, as deliveries are attempted: one worker fires at a time, and whoever dies over it leaves it
to be fired again. The next time is reckoned from when the last one was done with, so times that were missed fire once.

There are two lanes. In the slow one are the venues whose cameras gave no frame the last time, or took long: they wait
for each other, and those whose cameras answer never wait for them.
"""

from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

import sqlalchemy as sa

from service.schemas.schedule import Schedule, ScheduleState, next_time, phase_of
from service.schemas.venue import Venue
from service.store import tables
from service.store.database import Repository, advisory_lock, clock, reading, writing

LONGEST_ERROR = 500
FIRES_BY = ("cron", "time_zone", "exact")
s = tables.schedules.c
IN_SLOW_LANE = sa.or_(s.slow, s.failures > 0)


@dataclass(frozen=True)
class Firing:
    """The calibration of a venue that was due at a time."""

    venue: str
    due_at: datetime
    cron: str
    time_zone: str
    exact: bool


@dataclass(frozen=True)
class Due:
    """The time, and the number of due schedules in each lane that no worker has claimed."""

    now: datetime
    quick: int
    slow: int


class ScheduleRepository(Repository):
    """The schedules in the database."""

    def due(self) -> Due:
        """Count what is due."""
        slow = sa.case((IN_SLOW_LANE, 1), else_=0)
        with reading(self._engine) as connection:
            now = clock(connection)
            query = sa.select(sa.func.count().label("all"), sa.func.sum(slow).label("slow")).where(s.look_at <= now)
            row: Any = connection.execute(query).one()
        in_slow_lane = row.slow or 0
        return Due(now, row.all - in_slow_lane, in_slow_lane)

    def claim_due(self, now: datetime, again_at: datetime, limit: int, *, slow: bool = False) -> list[Firing]:
        """Claim up to `limit` of a lane that are due; fired again at `again_at` unless they are done with before.

        Those that were put off go before those that have become due since. In the slow lane, cameras that answer go
        before those that gave no frame.
        """
        order = (s.failures > 0, s.due_at, s.look_at) if slow else (s.due_at, s.look_at)
        lane = IN_SLOW_LANE if slow else sa.not_(IN_SLOW_LANE)
        due = sa.select(tables.schedules).where(s.look_at <= now, lane).order_by(*order).limit(limit)
        with writing(self._engine) as connection:
            advisory_lock(connection, "schedules")
            rows = connection.execute(due).all()
            claimed = sa.update(tables.schedules).where(s.venue.in_([row.venue for row in rows]))
            connection.execute(claimed.values(look_at=again_at, claimed_until=again_at))
            return [_firing(row) for row in rows]

    def done(self, firing: Firing, now: datetime, job_id: str | None, error: str | None) -> None:
        """End a firing and wait for the next time. `error`: why there is no job."""
        next_at = _next(firing.venue, firing, now)
        brought = {} if job_id is None else {"last_job": job_id}
        self._write(firing, error, due_at=next_at, look_at=next_at, last_at=firing.due_at, **brought)

    def postpone(self, firing: Firing, until: datetime, why: str) -> None:
        """Repeat a firing later, for the time that it was due at."""
        self._write(firing, why, look_at=until)

    def fetched(self, firing: Firing, *, slowly: bool) -> None:
        """Note that the cameras of a venue gave their frames, and so which lane it fires in from now on."""
        self._update(firing, failures=0, slow=slowly)

    def not_fetched(self, firing: Firing) -> None:
        """Note that a camera of a venue gave no frame: from now on it fires in the slow lane."""
        self._update(firing, failures=s.failures + 1)

    def repair_due_times(self, now: datetime, longest_claim: timedelta) -> int:
        """Reckon times anew that lie beyond the next possible one: a clock that was ahead has been put right.

        Gives how many were wrong.
        """
        with reading(self._engine) as connection:
            rows = connection.execute(sa.select(tables.schedules).where(s.look_at > now)).all()
        wrong = 0
        for row in rows:
            firing = _firing(row)
            if row.due_at > now:
                next_at = _next(row.venue, firing, now)
                if next_at < row.due_at:
                    wrong += self._update(firing, due_at=next_at, look_at=next_at, claimed_until=None)
            elif row.look_at > now + longest_claim:
                wrong += self._update(firing, look_at=now, claimed_until=None)
        return wrong

    def _write(self, firing: Firing, error: str | None, **values: Any) -> None:
        last_error = None if error is None else error[:LONGEST_ERROR]
        self._update(firing, last_error=last_error, claimed_until=None, **values)

    def _update(self, firing: Firing, **values: Any) -> int:
        # A venue that was put meanwhile with another schedule has other times.
        same = [s[name] == getattr(firing, name) for name in ("venue", "due_at", *FIRES_BY)]
        with writing(self._engine) as connection:
            return connection.execute(sa.update(tables.schedules).where(*same).values(**values)).rowcount


def reserved_places(connection: sa.Connection, now: datetime, at_most: int) -> int:
    """Return the number of places in the queue that are kept for schedules that are due or fetching their frames.

    None is kept for those whose cameras gave no frame the last time, which most likely will give none again, nor for
    those that were put off, until they are looked at again.
    """
    waits = sa.or_(s.look_at <= now, s.claimed_until > now)
    wanted = sa.select(s.venue).where(s.due_at <= now, waits, s.failures == 0).limit(at_most).subquery()
    return connection.execute(sa.select(sa.func.count()).select_from(wanted)).scalar_one()


def lateness_s(connection: sa.Connection, now: datetime) -> tuple[float, float]:
    """Return the longest time that a schedule has been due, in the quick and in the slow lane."""
    first, slow = sa.func.min(s.due_at, type_=s.due_at.type), sa.case((IN_SLOW_LANE, 1), else_=0)
    query = sa.select(slow.label("slow"), first.label("first")).where(s.due_at <= now).group_by(slow)
    late = {row.slow: (now - row.first).total_seconds() for row in connection.execute(query)}
    return late.get(0, 0.0), late.get(1, 0.0)


def plan_schedule(connection: sa.Connection, venue: Venue) -> None:
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
    """Return the next time of a venue's schedule and the outcome of the last one; None without a schedule."""
    row = connection.execute(sa.select(tables.schedules).where(s.venue == venue_id)).one_or_none()
    if row is None:
        return None
    return ScheduleState(next_at=row.due_at, last_at=row.last_at, last_job=row.last_job, last_error=row.last_error)


def _firing(row: Any) -> Firing:
    return Firing(row.venue, row.due_at, row.cron, row.time_zone, row.exact)


def _next(venue_id: str, schedule: Schedule | Firing, after: datetime) -> datetime:
    place = 0.0 if schedule.exact else phase_of(venue_id)
    return next_time(schedule.cron, schedule.time_zone, after, place)
