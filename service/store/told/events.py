"""What happens to venues, written down where it happens: in the transaction that makes it true.

The numbers of a venue's events are in the order of their transactions, so that who has seen one has seen all before it:
whoever writes about a venue is serialised about it from the beginning (`venue_lock`).
"""

from __future__ import annotations

from datetime import datetime
from typing import Any

import sqlalchemy as sa

from service.store import tables
from service.store.engine import clock
from service.store.told.deliveries import add_event_delivery
from service.wire.base import Wire
from service.wire.told.events import VenueChange, Webhook, is_of

e = tables.events.c
v = tables.venues.c


def add_event(connection: sa.Connection, venue_id: str, what: str, data: Wire, at: datetime) -> int:
    """Write down what has happened and have the webhooks of the venue told; gives the number of the event."""
    return _add(connection, venue_id, what, at, data=data.model_dump(mode="json"))


def add_job_event(connection: sa.Connection, venue_id: str, what: str, job_id: str, at: datetime) -> None:
    """The same of a job, which is read when it is told."""
    _add(connection, venue_id, what, at, job=job_id)


def add_venue_event(connection: sa.Connection, venue_id: str, what: str, changed: list[str]) -> None:
    """The same of what somebody did to a venue."""
    add_event(connection, venue_id, what, VenueChange(venue=venue_id, changed=changed), clock(connection))


def _add(connection: sa.Connection, venue_id: str, what: str, at: datetime, **values: Any) -> int:
    row = sa.insert(tables.events).values(venue=venue_id, type=what, at=at, **values).returning(e.id)
    number: int = connection.execute(row).scalar_one()
    # Of the document only what is needed: this is done several times for each job.
    webhooks = connection.scalar(sa.select(v.document["webhooks"]).where(v.id == venue_id))
    for webhook in map(Webhook.model_validate, webhooks or ()):
        if is_of(what, webhook.events):
            add_event_delivery(connection, number, webhook.url, at)
    return number
