"""Heartbeats of the workers, and the jobs that nothing was heard of since: all SQL about them.

A worker has a row by its name, and each of its starts a token in it: two workers of one name are told apart by that.
"""

from collections.abc import Collection
from dataclasses import dataclass
from datetime import datetime, timedelta

import sqlalchemy as sa

from service.schemas.names import OPEN_STATUSES
from service.store.database import Repository, clock, reading, writing
from service.store.tables import jobs, workers

j, w = jobs.c, workers.c
# A sign of life that lies further ahead was given by a clock that has been put right since.
CLOCK_TOLERANCE = timedelta(seconds=5)
# Silent jobs that a round looks after.
BATCH = 100


@dataclass(frozen=True)
class WorkerHeartbeat:
    """A worker, the seconds since its last sign of life, and the hash of its model file (None: missing).

    `silent_s` is None while nobody knows: the clock was put back behind its last sign of life. `unreadable_jobs` wait
    for a worker of a newer version.
    """

    name: str
    silent_s: float | None
    model_sha256: str | None
    version: str | None
    unreadable_jobs: int

    def is_alive(self, silence_s: float) -> bool:
        """True if the worker was seen within `silence_s`."""
        return self.silent_s is not None and self.silent_s <= silence_s

    def is_silent(self, silence_s: float) -> bool:
        """True if the worker surely was not seen within `silence_s`."""
        return self.silent_s is not None and self.silent_s > silence_s


@dataclass(frozen=True)
class WorkerStart:
    """The start of a worker that its row is of, and its last sign of life.

    `place` is where no other worker of its name can run beside it; None: it has ended.
    """

    token: str | None
    place: str | None
    seen_at: datetime


@dataclass(frozen=True)
class Round:
    """Answer to a heartbeat: silent workers, and open jobs without a sign of life.

    `is_of_this_start`: True if the row of the worker was still of the start that sent the heartbeat.
    """

    is_of_this_start: bool
    silent_workers: list[str]
    silent_jobs: list[str]


class WorkerRepository(Repository):
    """The workers in the database. Their times are the database's: the clocks of several machines differ."""

    def register(
        self,
        name: str,
        model_sha256: str | None,
        token: str | None = None,
        place: str | None = None,
        version: str | None = None,
    ) -> None:
        """Register the start of a worker."""
        with writing(self._engine) as connection:
            now = clock(connection)
            connection.execute(sa.delete(workers).where(w.name == name))
            row = {"name": name, "model_sha256": model_sha256, "token": token, "place": place, "version": version}
            connection.execute(sa.insert(workers).values(started_at=now, seen_at=now, **row))

    def beat(self, name: str, token: str | None = None, unreadable_jobs: int = 0) -> bool:
        """Send the heartbeat of a worker; False if the row is no longer of this start: `start_of` says whose it is.

        A sign of life of another one that lies in the future is put to now, so that its silence counts from here on.
        """
        with writing(self._engine) as connection:
            return _beat(connection, clock(connection), name, token, unreadable_jobs)

    def beat_and_listen(
        self, name: str, token: str | None, silence_s: float, unreadable_jobs: Collection[str] = ()
    ) -> Round:
        """Send a heartbeat and return what was silent for `silence_s`, without `unreadable_jobs`; one transaction."""
        with writing(self._engine) as connection:
            now = clock(connection)
            return Round(
                _beat(connection, now, name, token, len(unreadable_jobs)),
                [worker.name for worker in heartbeats(connection, now) if worker.is_silent(silence_s)],
                silent_jobs(connection, now, silence_s, but=unreadable_jobs),
            )

    def start_of(self, name: str) -> WorkerStart | None:
        """Return the start that the row of a worker belongs to; None without a row."""
        with reading(self._engine) as connection:
            row = connection.execute(sa.select(workers).where(w.name == name)).one_or_none()
        return None if row is None else WorkerStart(row.token, row.place, row.seen_at)

    def end(self, name: str, token: str) -> None:
        """Mark a worker as ended; its row is deleted once it has been silent, after its jobs were taken over."""
        with writing(self._engine) as connection:
            connection.execute(sa.update(workers).where(w.name == name, w.token == token).values(place=None))

    def alive(self, silence_s: float) -> list[WorkerHeartbeat]:
        """Return the workers that were seen within `silence_s`."""
        with reading(self._engine) as connection:
            return [worker for worker in heartbeats(connection, clock(connection)) if worker.is_alive(silence_s)]

    def forget(self, name: str, silence_s: float) -> None:
        """Forget a worker, unless it has come back meanwhile."""
        with writing(self._engine) as connection:
            old = w.seen_at < clock(connection) - timedelta(seconds=silence_s)
            connection.execute(sa.delete(workers).where(w.name == name, old))


def _beat(connection: sa.Connection, now: datetime, name: str, token: str | None, unreadable_jobs: int) -> bool:
    ahead = sa.update(workers).where(w.seen_at > now + CLOCK_TOLERANCE).values(seen_at=now)
    connection.execute(ahead)
    of_this_start = [w.name == name, w.token.is_not_distinct_from(token)]
    beat = sa.update(workers).where(*of_this_start).values(seen_at=now, unreadable_jobs=unreadable_jobs)
    return connection.execute(beat).rowcount == 1


def heartbeats(connection: sa.Connection, now: datetime) -> list[WorkerHeartbeat]:
    """Return the heartbeats of all workers that were not given up, by name."""
    rows = connection.execute(sa.select(workers).order_by(w.name))
    return [
        WorkerHeartbeat(row.name, _silent_s(row.seen_at, now), row.model_sha256, row.version, row.unreadable_jobs or 0)
        for row in rows
    ]


def _silent_s(seen_at: datetime, now: datetime) -> float | None:
    return None if seen_at > now + CLOCK_TOLERANCE else max(0.0, (now - seen_at).total_seconds())


def silent_jobs(connection: sa.Connection, now: datetime, seconds: float, but: Collection[str] = ()) -> list[str]:
    """Return open jobs that nothing was heard of for a while, or only by a clock that has been put back since.

    `but`: without these.
    """
    query = sa.select(j.id).where(j.status.in_(OPEN_STATUSES), unheard_for(seconds, now), j.id.not_in(but))
    return list(connection.scalars(query.order_by(j.updated_at).limit(BATCH)))


def unheard_for(seconds: float, now: datetime) -> sa.ColumnElement[bool]:
    """Return the condition under which nothing was heard of a job for so long."""
    return sa.or_(j.updated_at < now - timedelta(seconds=seconds), j.updated_at > now + CLOCK_TOLERANCE)
