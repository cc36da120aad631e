"""Deliveries: who is to be told of the end of a job. All SQL about them.

A delivery is written in the transaction that ends its job. To attempt it is to put it off first: whoever dies over an
attempt leaves it to be attempted again, so it is made at least once, by one worker at a time.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from typing import Literal

import sqlalchemy as sa

from service.store import tables, tallies
from service.store.engine import reading, serialise, writing

Outcome = Literal["delivered", "given-up"]
CALLBACKS = "callbacks"
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

    def again(self, delivery: Delivery, at: datetime) -> None:
        """An attempt failed; there will be another."""
        with writing(self._engine) as connection:
            _write(connection, delivery, due_at=at)

    def end(self, delivery: Delivery, outcome: Outcome) -> None:
        """No attempt will follow."""
        with writing(self._engine) as connection:
            if _write(connection, delivery, status=outcome):
                tallies.add(connection, {(CALLBACKS, (outcome,)): 1})


def _write(connection: sa.Connection, delivery: Delivery, **values: datetime | str) -> bool:
    # Of an attempt that took so long that another one was begun, nothing is written down.
    this_attempt = (d.job == delivery.job_id, d.attempts == delivery.attempt, d.status == "waiting")
    return connection.execute(sa.update(tables.deliveries).where(*this_attempt).values(**values)).rowcount == 1


def add_delivery(connection: sa.Connection, job_id: str, url: str, now: datetime) -> None:
    """Have `url` told that the job has ended, when and if the caller's transaction commits."""
    connection.execute(sa.insert(tables.deliveries).values(job=job_id, url=url, status="waiting", due_at=now))
