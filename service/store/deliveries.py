"""Deliveries: who is to be told of the end of a job, or of an alarm. All SQL about them.

A delivery is written in the transaction that makes true what it tells. To attempt it is to put it off first: whoever
dies over an attempt leaves it to be attempted again, so it is made at least once, by one worker at a time.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Any

import sqlalchemy as sa

from service.store import tables
from service.store.counts import tallies
from service.store.engine import Repository, reading, serialise, writing
from service.store.ids import new_id
from service.wire.health import AlarmEvent
from service.wire.job import CallbackState

CALLBACKS = "callbacks"
LONGEST_ERROR = 500
d = tables.deliveries.c


@dataclass(frozen=True)
class Delivery:
    """An attempt, the first is number 1, to tell `url` of an alarm's event, or (None) that the job `id` has ended."""

    id: str
    url: str
    attempt: int
    event: AlarmEvent | None


class Deliveries(Repository):
    """The deliveries in the database."""

    def attempt(self, now: datetime, again_at: datetime, limit: int) -> list[Delivery]:
        """Up to `limit` that are due; due again at `again_at` unless their end is written down before."""
        due = sa.select(tables.deliveries).where(d.status == "waiting", d.due_at <= now).order_by(d.due_at).limit(limit)
        with reading(self._engine) as connection:
            if connection.execute(due).first() is None:
                return []
        with writing(self._engine) as connection:
            serialise(connection, "deliveries")
            rows = connection.execute(due).all()
            begun = sa.update(tables.deliveries).where(d.id.in_([row.id for row in rows]))
            connection.execute(begun.values(attempts=d.attempts + 1, due_at=again_at))
            return [_delivery(row) for row in rows]

    def again(self, delivery: Delivery, at: datetime, why: str) -> None:
        """An attempt failed; there will be another."""
        with writing(self._engine) as connection:
            _write(connection, delivery, due_at=at, last_error=why[:LONGEST_ERROR])

    def succeed(self, delivery: Delivery) -> None:
        """The receiver knows."""
        self._end(delivery, "delivered")

    def give_up(self, delivery: Delivery, why: str) -> None:
        """No attempt will follow."""
        self._end(delivery, "given-up", last_error=why[:LONGEST_ERROR])

    def _end(self, delivery: Delivery, outcome: str, **values: str) -> None:
        with writing(self._engine) as connection:
            if _write(connection, delivery, status=outcome, **values):
                tallies.add(connection, {(CALLBACKS, (outcome,)): 1})
                if delivery.event is not None:
                    # That of a job goes with its job; nobody asks how far the telling of an alarm has come.
                    connection.execute(sa.delete(tables.deliveries).where(d.id == delivery.id))


def _write(connection: sa.Connection, delivery: Delivery, **values: datetime | str) -> bool:
    # Of an attempt that took so long that another one was begun, nothing is written down.
    this_attempt = (d.id == delivery.id, d.attempts == delivery.attempt, d.status == "waiting")
    return connection.execute(sa.update(tables.deliveries).where(*this_attempt).values(**values)).rowcount == 1


def add_delivery(connection: sa.Connection, job_id: str, url: str, now: datetime) -> None:
    """Have `url` told that the job has ended, when and if the caller's transaction commits."""
    connection.execute(sa.insert(tables.deliveries).values(id=job_id, url=url, status="waiting", due_at=now))


def add_alarm_delivery(connection: sa.Connection, event: AlarmEvent, url: str, now: datetime) -> None:
    """Have `url` told of an alarm, when and if the caller's transaction commits."""
    told = {"id": new_id(), "url": url, "status": "waiting", "due_at": now, "event": event.model_dump(mode="json")}
    connection.execute(sa.insert(tables.deliveries).values(**told))


def delivery_of(connection: sa.Connection, job_id: str) -> CallbackState | None:
    """How far the telling of a job's end has come; None: nobody is to be told (yet)."""
    row = connection.execute(sa.select(tables.deliveries).where(d.id == job_id)).one_or_none()
    if row is None:
        return None
    return CallbackState(
        state=row.status,
        attempts=row.attempts,
        last_error=row.last_error,
        next_attempt_at=row.due_at if row.status == "waiting" else None,
    )


def _delivery(row: sa.Row[Any]) -> Delivery:
    event = None if row.event is None else AlarmEvent.model_validate(row.event)
    return Delivery(row.id, row.url, row.attempts + 1, event)
