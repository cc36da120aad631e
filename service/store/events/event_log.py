"""The event log of venues, written in the transactions that change them.

The numbers of a venue's events are in the order of their transactions, so that who has seen one has seen all before it:
whoever writes about a venue is serialised about it from the beginning (`venue_lock`).
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime

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
from service.store.events.outbox import add_delivery

e = tables.events.c


def add_event(
    connection: sa.Connection,
    venue_id: str,
    webhooks: Sequence[Webhook],
    what: str,
    data: Schema | None,
    at: datetime,
    by: Actor | None = None,
    job: str | None = None,
) -> int:
    """Add an event of a venue and its webhook deliveries; return the number of the event.

    `data`: None for the end of a `job`, which is read when it is delivered: it does not change any more. `by`: the
    actor; None: the service by itself.
    """
    document = None if data is None else data.model_dump(mode="json")
    values = {"venue": venue_id, "type": what, "at": at, "data": document, "job": job, **columns_of(by)}
    number: int = connection.execute(sa.insert(tables.events).values(**values).returning(e.id)).scalar_one()
    for webhook in webhooks:
        if matches_kinds(what, webhook.events):
            add_delivery(connection, webhook.url, at, event=number)
    return number


def add_queued_event(connection: sa.Connection, venue: Venue, job: Job, by: Actor | None) -> None:
    """Add the event of a submitted job with its data as of now: at the delivery it may run or have ended."""
    data = job.model_copy(update={"callback": None})
    add_event(connection, venue.id, venue.webhooks, "job.queued", data, job.created_at, by, job.id)


def add_venue_event(
    connection: sa.Connection, venue: Venue, what: str, changed: list[str], by: Actor | None = None
) -> None:
    """Add the event of a change that somebody made to a venue."""
    data = VenueChange(venue=venue.id, changed=changed)
    add_event(connection, venue.id, venue.webhooks, what, data, clock(connection), by)
