"""The event log of venues, written in the transactions that change them.

The numbers of a venue's events are in the order of their transactions, so that who has seen one has seen all before it:
whoever writes about a venue is serialised about it from the beginning (`venue_lock`).
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from typing import Any

import sqlalchemy as sa

from service.schemas.actor import Actor
from service.schemas.base import Schema
from service.schemas.events.venue_event import VenueChange, matches_kinds
from service.schemas.events.webhooks import Webhook
from service.schemas.job import Job
from service.schemas.venue import Venue
from service.store import tables
from service.store.actors import columns_of
from service.store.database import clock
from service.store.events.outbox import add_event_delivery

e = tables.events.c


def add_event(
    connection: sa.Connection,
    venue_id: str,
    webhooks: Sequence[Webhook],
    what: str,
    data: Schema,
    at: datetime,
    by: Actor | None = None,
) -> int:
    """Add an event of a venue and its webhook deliveries; return the number of the event.

    `by`: who did it; None: the service by itself.
    """
    return _add(connection, venue_id, webhooks, what, at, data=data.model_dump(mode="json"), **columns_of(by))


def add_job_event(
    connection: sa.Connection,
    venue_id: str,
    webhooks: Sequence[Webhook],
    what: str,
    job_id: str,
    at: datetime,
    by: Actor | None = None,
) -> None:
    """Add the event of a job that has ended; its data is read from the job, which does not change any more."""
    _add(connection, venue_id, webhooks, what, at, job=job_id, **columns_of(by))


def add_queued_event(connection: sa.Connection, venue: Venue, job: Job, by: Actor | None) -> None:
    """Add the event of a submitted job with its data as of now: at the delivery it may run or have ended."""
    data = job.model_dump(mode="json", exclude={"callback"})
    _add(connection, venue.id, venue.webhooks, "job.queued", job.created_at, job=job.id, data=data, **columns_of(by))


def add_venue_event(
    connection: sa.Connection, venue: Venue, what: str, changed: list[str], by: Actor | None = None
) -> None:
    """Add the event of a change that somebody made to a venue."""
    data = VenueChange(venue=venue.id, changed=changed)
    add_event(connection, venue.id, venue.webhooks, what, data, clock(connection), by)


def _add(
    connection: sa.Connection, venue_id: str, webhooks: Sequence[Webhook], what: str, at: datetime, **values: Any
) -> int:
    row = sa.insert(tables.events).values(venue=venue_id, type=what, at=at, **values).returning(e.id)
    number: int = connection.execute(row).scalar_one()
    for webhook in webhooks:
        if matches_kinds(what, webhook.events):
            add_event_delivery(connection, number, webhook.url, at)
    return number
