"""The outbox: deliveries of the ends of jobs and of events of venues to callbacks and webhooks. All SQL about it.

A delivery is written in the transaction that makes true what it tells. To attempt it is to put it off first: whoever
dies over an attempt leaves it to be attempted again, so it is made at least once, by one worker at a time.
"""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from types import MappingProxyType
from typing import Any
from urllib.parse import urlsplit

import sqlalchemy as sa

from service.schemas.job import CallbackState
from service.store import tables
from service.store.database import Repository, advisory_lock, reading, writing
from service.store.ids import new_id
from service.store.statistics import counters

CALLBACKS = "callbacks"
LONGEST_ERROR = 500
# Attempts of one receiver: one that takes its time holds up its own.
AT_ONCE_PER_RECEIVER = 2
NOBODY: Mapping[str, int] = MappingProxyType({})
d = tables.deliveries.c


@dataclass(frozen=True)
class Delivery:
    """An attempt (from 1) to deliver an event to `url`, or, where `event` is None, the end of job `id`."""

    id: str
    url: str
    attempt: int
    event: int | None
    receiver: str


class OutboxRepository(Repository):
    """The deliveries in the database."""

    def claim_due(
        self, now: datetime, again_at: datetime, limit: int, running: Mapping[str, int] = NOBODY
    ) -> list[Delivery]:
        """Claim up to `limit` due deliveries; unless they end before, they are due again at `again_at`.

        `running`: how many attempts there are already, by receiver.
        """
        with reading(self._engine) as connection:
            if limit == 0 or not _due(connection, now, 1, running):
                return []
        with writing(self._engine) as connection:
            advisory_lock(connection, "deliveries")
            rows = _due(connection, now, limit, running)
            begun = sa.update(tables.deliveries).where(d.id.in_([row.id for row in rows]))
            connection.execute(begun.values(attempts=d.attempts + 1, due_at=again_at))
            return [Delivery(row.id, row.url, row.attempts + 1, row.event, row.receiver) for row in rows]

    def repair_due_times(self, now: datetime, again_at: datetime, longest_waits: Sequence[timedelta]) -> int:
        """Let those be due that wait for longer than they can have to: a clock that was ahead has been put right.

        `longest_waits`: after the first attempt, the second, ... What was attempted before is due at `again_at`: it may
        be being attempted. Gives how many were wrong.
        """
        never = sa.and_(d.attempts == 0, d.due_at > now)
        too_long = [
            sa.and_(d.attempts == number, d.due_at > now + longest)
            for number, longest in enumerate(longest_waits, start=1)
        ]
        # The last attempt waits for no other.
        last = sa.and_(d.attempts > len(longest_waits), d.due_at > again_at)
        due_at = sa.case((d.attempts == 0, now), else_=again_at)
        wrong = sa.update(tables.deliveries).where(
            d.status == "waiting", d.due_at > now, sa.or_(never, *too_long, last)
        )
        with writing(self._engine) as connection:
            return connection.execute(wrong.values(due_at=due_at)).rowcount

    def retry_later(self, delivery: Delivery, at: datetime, why: str) -> None:
        """Write down a failed attempt, and when the next one is due."""
        with writing(self._engine) as connection:
            _write(connection, delivery, due_at=at, last_error=why[:LONGEST_ERROR])

    def mark_delivered(self, delivery: Delivery) -> None:
        """Mark a delivery as delivered."""
        self._end(delivery, "delivered")

    def give_up(self, delivery: Delivery, why: str) -> None:
        """Mark a delivery as given up."""
        self._end(delivery, "given-up", last_error=why[:LONGEST_ERROR])

    def _end(self, delivery: Delivery, outcome: str, **values: str) -> None:
        with writing(self._engine) as connection:
            if _write(connection, delivery, status=outcome, **values):
                counters.add(connection, {(CALLBACKS, (outcome,)): 1})
                if delivery.event is not None:
                    # The delivery of a job is deleted with its job; nobody asks for the state of an event's.
                    connection.execute(sa.delete(tables.deliveries).where(d.id == delivery.id))


def _due(connection: sa.Connection, now: datetime, limit: int, running: Mapping[str, int]) -> list[sa.Row[Any]]:
    """Return the due deliveries that have waited longest, at most `AT_ONCE_PER_RECEIVER` attempts for each receiver."""
    due, of = sa.select(tables.deliveries).where(d.status == "waiting", d.due_at <= now), Counter(running)
    taken: list[sa.Row[Any]] = []
    while len(taken) < limit:
        full = [receiver for receiver, attempts in of.items() if attempts >= AT_ONCE_PER_RECEIVER]
        others = due.where(d.receiver.not_in(full), d.id.not_in([row.id for row in taken]))
        rows = connection.execute(others.order_by(d.due_at).limit(limit - len(taken))).all()
        before = len(taken)
        for row in rows:
            if of[row.receiver] < AT_ONCE_PER_RECEIVER:
                of[row.receiver] += 1
                taken.append(row)
        if len(taken) - before == len(rows):
            break
    return taken


def _write(connection: sa.Connection, delivery: Delivery, **values: datetime | str) -> bool:
    # An attempt that took so long that another one was begun writes nothing.
    this_attempt = (d.id == delivery.id, d.attempts == delivery.attempt, d.status == "waiting")
    return connection.execute(sa.update(tables.deliveries).where(*this_attempt).values(**values)).rowcount == 1


def add_delivery(
    connection: sa.Connection, url: str, now: datetime, *, job: str | None = None, event: int | None = None
) -> None:
    """Add the delivery of an event, or of the end of a job, to `url`, inside the caller's transaction."""
    values = {"id": job or new_id(), "url": url, "receiver": urlsplit(url).hostname or "", "event": event}
    connection.execute(sa.insert(tables.deliveries).values(status="waiting", due_at=now, **values))


def deliveries_of(connection: sa.Connection, job_ids: Collection[str]) -> dict[str, CallbackState]:
    """Return the state of the callbacks of jobs, for those that have a callback."""
    if not job_ids:
        return {}
    rows = connection.execute(sa.select(tables.deliveries).where(d.id.in_(job_ids)))
    return {
        row.id: CallbackState(
            state=row.status,
            attempts=row.attempts,
            last_error=row.last_error,
            next_attempt_at=row.due_at if row.status == "waiting" else None,
        )
        for row in rows
    }
