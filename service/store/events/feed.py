"""Reading the event log: the events of a venue since a number."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import sqlalchemy as sa
from pydantic import TypeAdapter

from service.schemas.base import TOLERANTLY
from service.schemas.events.venue_event import EVENT_TYPES, FINAL_EVENT, Event, Poses, PosesEvent, matches_kinds
from service.schemas.job import Job
from service.schemas.names import EventKind
from service.store import tables
from service.store.actors import actor_in
from service.store.database import Repository, reading
from service.store.jobs.queries import jobs_of
from service.store.revisions import newest_revision
from service.store.unreadable import read_each, reading_row
from service.store.venues import find_venue

e = tables.events.c
EVENT: TypeAdapter[Event] = TypeAdapter(Event)


@dataclass(frozen=True)
class NumberedEvent:
    """An event and its number, from which a follower continues."""

    number: int
    event: Event


@dataclass(frozen=True)
class EventPage:
    """Events in order, the last number that was searched, and True if there may be more."""

    events: list[NumberedEvent]
    up_to: int
    more: bool


class EventRepository(Repository):
    """The events in the database."""

    def newest(self, venue_ids: Collection[str]) -> Mapping[str, int]:
        """Return the number of the last event of each of these venues that has one."""
        query = sa.select(e.venue, sa.func.max(e.id).label("newest")).where(e.venue.in_(venue_ids)).group_by(e.venue)
        with reading(self._engine) as connection:
            return {row.venue: row.newest for row in connection.execute(query)}

    def beginning(self, venue_id: str, seen: int | None) -> NumberedEvent | None:
        """Return the poses in use for a follower that is new or has missed expired events, or None if `seen` suffices.

        The venue must exist.
        """
        with reading(self._engine) as connection:
            oldest, newest = connection.execute(sa.select(sa.func.min(e.id), sa.func.max(e.id))).one()
            # The oldest go first, whatever venue they are of, and never all: before the oldest that is kept are those
            # that may be missed. A number that was never given is one of another database.
            if seen is not None and oldest is not None and oldest - 1 <= seen <= newest:
                return None
            number = connection.scalar(sa.select(sa.func.max(e.id)).where(e.venue == venue_id)) or 0
            venue, revision = find_venue(connection, venue_id), newest_revision(connection, venue_id)
        assert venue is not None
        assert revision is not None
        same = {name: getattr(revision, name) for name in ("revision", "cause", "job", "stitch_error_px", "ridge")}
        values = {"venue": venue_id, "cameras": [camera.posed for camera in venue.cameras], "changed": []} | same
        poses = Poses.model_validate(values, **TOLERANTLY)
        return NumberedEvent(
            number, PosesEvent(type="poses.current", timestamp=revision.at, data=poses, by=revision.by)
        )

    def ends_after(self, venue_id: str, seen: int) -> bool:
        """True if a venue was deleted after event `seen` and no event in between has expired."""
        deleted = sa.exists().where(e.venue == venue_id, e.type == FINAL_EVENT, e.id > seen)
        with reading(self._engine) as connection:
            oldest, is_deleted = connection.execute(sa.select(sa.func.min(e.id), deleted)).one()
            return bool(is_deleted and oldest - 1 <= seen)

    def since(self, venue_id: str, seen: int, kinds: Collection[EventKind], limit: int) -> EventPage:
        """Return the events of these kinds (none given: all) among the next `limit` events after `seen`.

        The deletion of the venue is of every kind: nothing comes after it.
        """
        query = sa.select(tables.events).where(e.venue == venue_id, e.id > seen).order_by(e.id).limit(limit)
        with reading(self._engine) as connection:
            rows = connection.execute(query).all()
            known = [row for row in rows if row.type in EVENT_TYPES]
            wanted = [row for row in known if not kinds or row.type == FINAL_EVENT or matches_kinds(row.type, kinds)]
            return EventPage(_numbered_events(connection, wanted), rows[-1].id if rows else seen, len(rows) == limit)

    def get(self, number: int) -> Event | None:
        """Return an event as a webhook gets it, without addresses; None if it or its job has expired."""
        with reading(self._engine) as connection:
            row = connection.execute(sa.select(tables.events).where(e.id == number)).one_or_none()
            told = [] if row is None or row.type not in EVENT_TYPES else _numbered_events(connection, [row])
        return told[0].event.without_address() if told else None


def _numbered_events(connection: sa.Connection, rows: Sequence[Any]) -> list[NumberedEvent]:
    """Return the events of rows; those that cannot be read, or whose jobs were deleted meanwhile, are left out."""
    jobs = jobs_of(connection, {row.job for row in rows if row.job})
    kept = [row for row in rows if row.job is None or row.job in jobs]
    return read_each(kept, lambda row: NumberedEvent(row.id, _event(row, jobs)))[0]


def _event(row: Any, jobs: Mapping[str, Job]) -> Event:
    # A job that ended is read now; one that was queued is told as it was then, unless an earlier release wrote the row.
    data = jobs[row.job].model_copy(update={"callback": None}) if row.data is None else row.data
    values = {"type": row.type, "timestamp": row.at, "data": data, "by": actor_in(row)}
    with reading_row("event", str(row.id)):
        return EVENT.validate_python(values, **TOLERANTLY)
