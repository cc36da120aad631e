"""Deliveries: who is to be told of the end of a job. All SQL about them.

A delivery is written in the transaction that ends its job. To attempt it is to put it off first: whoever dies over an
attempt leaves it to be attempted again, so it is made at least once, by one worker at a time.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime

import sqlalchemy as sa

from service.schemas import CallbackState
from service.store import tables, tallies
from service.store.engine import clock, reading, serialise, writing

CALLBACKS = "callbacks"
LONGEST_ERROR = 500
d = tables.deliveries.c


@dataclass(frozen=True)
class Delivery:
    """An attempt, the first is number 1, to tell `url` of the end of a job."""

    job_id: str
    url: str
    attempt: int


class Deliveries:
    """The deliveries in the database."""

    def __init__(self, engine: sa.Engine) -> None:
        self._engine = engine

    def now(self) -> datetime:
        """The time that deliveries are due by."""
        with reading(self._engine) as connection:
            return clock(connection)

    def attempt(self, now: datetime, again_at: datetime, limit: int) -> list[Delivery]:
        """Up to `limit` that are due; due again at `again_at` unless their end is written down before."""
        due = sa.select(tables.deliveries).where(d.status == "waiting", d.due_at <= now).order_by(d.due_at).limit(limit)
        with reading(self._engine) as connection:
            if connection.execute(due).first() is None:
                return []
        with writing(self._engine) as connection:
            serialise(connection, "deliveries")
            rows = connection.execute(due).all()
            begun = sa.update(tables.deliveries).where(d.job.in_([row.job for row in rows]))
            connection.execute(begun.values(attempts=d.attempts + 1, due_at=again_at))
            return [Delivery(row.job, row.url, row.attempts + 1) for row in rows]

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


def _write(connection: sa.Connection, delivery: Delivery, **values: datetime | str) -> bool:
    # Of an attempt that took so long that another one was begun, nothing is written down.
    this_attempt = (d.job == delivery.job_id, d.attempts == delivery.attempt, d.status == "waiting")
    return connection.execute(sa.update(tables.deliveries).where(*this_attempt).values(**values)).rowcount == 1


def add_delivery(connection: sa.Connection, job_id: str, url: str, now: datetime) -> None:
    """Have `url` told that the job has ended, when and if the caller's transaction commits."""
    connection.execute(sa.insert(tables.deliveries).values(job=job_id, url=url, status="waiting", due_at=now))


def delivery_of(connection: sa.Connection, job_id: str) -> CallbackState | None:
    """How far the telling of a job's end has come; None: nobody is to be told (yet)."""
    row = connection.execute(sa.select(tables.deliveries).where(d.job == job_id)).one_or_none()
    if row is None:
        return None
    return CallbackState(
        state=row.status,
        attempts=row.attempts,
        last_error=row.last_error,
        next_attempt_at=row.due_at if row.status == "waiting" else None,
    )
