"""The event log of venues, written in the transactions that change them.

The numbers of a venue's events are in the order of their transactions, so that who has seen one has seen all before it:
whoever writes about a venue is serialised about it from the beginning (`lock_venue`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
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
from service.store.events.outbox import add_delivery

e = tables.events.c


@dataclass(frozen=True)
class NewEvent:
    """An event of a venue that is to be added, and the URLs that it is delivered to.

    `data`: None for the end of a `job`, which is read when it is delivered: it does not change any more. `by`: the
    actor; None: the service by itself.
    """

    what: str
    data: Schema | None
    at: datetime
    by: Actor | None = None
    job: str | None = None
    urls: Sequence[str] = ()

    def to(self, webhooks: Sequence[Webhook]) -> "NewEvent":
        """Return the event with the URLs of those webhooks of its venue that get such events."""
        return replace(self, urls=[hook.url for hook in webhooks if matches_kinds(self.what, hook.events)])


def add_event(connection: sa.Connection, venue_id: str, event: NewEvent) -> None:
    """Add an event of a venue and its deliveries, inside the caller's transaction."""
    document = None if event.data is None else event.data.model_dump(mode="json")
    values = {"type": event.what, "at": event.at, "data": document, "job": event.job, **columns_of(event.by)}
    inserted = sa.insert(tables.events).values(venue=venue_id, **values).returning(e.id)
    number: int = connection.execute(inserted).scalar_one()
    for url in event.urls:
        add_delivery(connection, url, event.at, event=number)


def add_queued_event(connection: sa.Connection, venue: Venue, job: Job, by: Actor | None) -> None:
    """Add the event of a submitted job with its data as of now: at the delivery it may run or have ended."""
    data = job.model_copy(update={"callback": None})
    event = NewEvent("job.queued", data, job.created_at, by, job.id)
    add_event(connection, venue.id, event.to(venue.webhooks))


def venue_event(venue: Venue, what: str, changed: list[str], at: datetime, by: Actor | None) -> NewEvent:
    """Return the event of a change that somebody made to a venue."""
    return NewEvent(what, VenueChange(venue=venue.id, changed=changed), at, by).to(venue.webhooks)
