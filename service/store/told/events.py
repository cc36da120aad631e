"""What happens to venues, written down where it happens: in the transaction that makes it true.

The numbers of a venue's events are in the order of their transactions, so that who has seen one has seen all before it:
whoever writes about a venue is serialised about it from the beginning (`venue_lock`).
"""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from typing import Any

import sqlalchemy as sa

from service.store import tables
from service.store.engine import clock
from service.store.told.deliveries import add_event_delivery
from service.wire.base import Wire
from service.wire.told.events import VenueChange, is_of
from service.wire.told.webhooks import Webhook
from service.wire.venue import Venue

e = tables.events.c


def add_event(
    connection: sa.Connection, venue_id: str, webhooks: Sequence[Webhook], what: str, data: Wire, at: datetime
) -> int:
    """Write down what has happened to a venue, and have its webhooks told; gives the number of the event."""
    return _add(connection, venue_id, webhooks, what, at, data=data.model_dump(mode="json"))


def add_job_event(
    connection: sa.Connection, venue_id: str, webhooks: Sequence[Webhook], what: str, job_id: str, at: datetime
) -> None:
    """The same of a job, which is read when it is told."""
    _add(connection, venue_id, webhooks, what, at, job=job_id)


def add_venue_event(connection: sa.Connection, venue: Venue, what: str, changed: list[str]) -> None:
    """The same of what somebody did to a venue."""
    data = VenueChange(venue=venue.id, changed=changed)
    add_event(connection, venue.id, venue.webhooks, what, data, clock(connection))


def _add(
    connection: sa.Connection, venue_id: str, webhooks: Sequence[Webhook], what: str, at: datetime, **values: Any
) -> int:
    row = sa.insert(tables.events).values(venue=venue_id, type=what, at=at, **values).returning(e.id)
    number: int = connection.execute(row).scalar_one()
    for webhook in webhooks:
        if is_of(what, webhook.events):
            add_event_delivery(connection, number, webhook.url, at)
    return number
