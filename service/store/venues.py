"""Venues, their changes and their restoration: all SQL about them."""

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import timedelta
from itertools import count
from types import MappingProxyType
from typing import Any, Literal

import sqlalchemy as sa

from service.schemas.actor import Actor
from service.schemas.base import Unreadable
from service.schemas.field import FieldOfPlay
from service.schemas.health import Alarm, CameraHealth, VenueHealth
from service.schemas.history import Cause, Revision
from service.schemas.names import OPEN_STATUSES
from service.schemas.source_urls import SourceSecrets
from service.schemas.venue import Venue
from service.store import live_alarms, tables
from service.store.alarms import with_alarms
from service.store.credentials import merge_credentials, read_credentials, write_credentials
from service.store.database import Repository, clock, lock_venue, reading, writing
from service.store.documents import stored_venue
from service.store.events.event_log import add_event, venue_event
from service.store.memories import memories_at, newest_memories, revisions_with_memories
from service.store.preconditions import UNCONDITIONAL, Precondition
from service.store.refusals import no_such_venue, venue_busy
from service.store.revisions import (
    RevisionPage,
    documents_as_of_revisions,
    newest_revision,
    origin_of,
    revisions_of,
    revisions_that_fit,
    state_at,
)
from service.store.schedules import plan_schedule, schedule_of
from service.store.statistics.venue_quality import CalibrationSummary, QualityRow, read_quality, summary_in
from service.store.unreadable import UnreadableRow, read_each
from service.store.venue_fold import with_revision_restored, with_venue_put
from service.store.venue_state import StoredVenue, active_alarms, load, read_venue, write_changes

v = tables.venues.c
# Tables whose rows are deleted with their venue.
OF_VENUES = (
    tables.revisions,
    tables.memories,
    tables.alarms,
    tables.schedules,
    tables.credentials,
    tables.venue_quality,
    tables.camera_anchors,
    tables.camera_trend,
    tables.live_reports,
    tables.live_minutes,
)


# Interval in which a duty looks whether somebody has repaired an unreadable venue.
UNREADABLE_RETRY = timedelta(minutes=10)


@dataclass(frozen=True)
class VenuePage:
    """Page of venues by id, those that cannot be read, and the id after which the next page begins."""

    venues: list[Venue]
    unreadable: list[Unreadable]
    next_cursor: str | None


Find = Callable[[sa.Connection, str], StoredVenue | None]
NO_SECRETS: Mapping[str, SourceSecrets] = MappingProxyType({})


class VenueRepository(Repository):
    """The venues in the database."""

    def get(self, venue_id: str) -> Venue | None:
        """Return a venue, None if there is none. Raises `UnreadableRow`."""
        with reading(self._engine) as connection:
            return find_venue(connection, venue_id)

    def page(
        self,
        after: str | None,
        limit: int,
        only: Collection[str] | None = None,
        q: str | None = None,
        state: Literal["ok", "alarm"] | None = None,
    ) -> VenuePage:
        """Return up to `limit` venues by id, those after the id `after`, and among `only` these, None: among all.

        `q`: only those whose id or name contains it, ignoring case (on SQLite that of ASCII). `state`: only those with
        an active alarm, or without.
        """
        query = sa.select(v.id, v.document).order_by(v.id).limit(limit + 1)
        if after is not None:
            query = query.where(v.id > after)
        if only is not None:
            query = query.where(v.id.in_(only))
        if q is not None:
            name = v.document["name"].as_string()
            query = query.where(sa.or_(v.id.icontains(q, autoescape=True), name.icontains(q, autoescape=True)))
        if state is not None:
            rings = sa.exists().where(tables.alarms.c.venue == v.id)
            query = query.where(rings if state == "alarm" else sa.not_(rings))
        with reading(self._engine) as connection:
            rows = connection.execute(query).all()
        venues, unreadable = read_each(rows[:limit], lambda row: read_venue(row.id, row.document).venue)
        return VenuePage(venues, unreadable, rows[limit - 1].id if len(rows) > limit else None)

    def calibration_summaries(self, venues: Collection[str]) -> dict[str, CalibrationSummary]:
        """Return the summaries of venues that were ever calibrated, by venue."""
        q = tables.venue_quality.c
        query = sa.select(q.venue, q.glance).where(q.venue.in_(venues), q.glance.is_not(None))
        with reading(self._engine) as connection:
            found = {row.venue: summary_in(row) for row in connection.execute(query)}
        return {venue: summary for venue, summary in found.items() if summary is not None}

    def alarms(self, venues: Collection[str]) -> dict[str, list[Alarm]]:
        """Return the active alarms of venues, the oldest first, by venue."""
        with reading(self._engine) as connection:
            return active_alarms(connection, venues)

    def put(
        self,
        venue: Venue,
        secrets: Mapping[str, SourceSecrets] = NO_SECRETS,
        precondition: Precondition = UNCONDITIONAL,
        by: Actor | None = None,
    ) -> tuple[Venue, bool]:
        """Create or replace a venue, readable or not; return it as stored, and True if it is new.

        `secrets`: those of its sources as they were sent, by camera. What came hidden stays as it was stored.
        """
        with writing(self._engine) as connection:
            lock_venue(connection, venue.id)
            stored = find_replaceable(connection, venue.id)
            precondition.check(None if stored is None else stored.venue)
            return _put(connection, stored, venue, secrets, by), stored is None

    def patch(
        self,
        venue_id: str,
        patch: Callable[[Venue], tuple[Venue, Mapping[str, SourceSecrets]]],
        precondition: Precondition = UNCONDITIONAL,
        by: Actor | None = None,
    ) -> Venue:
        """Replace a venue by what `patch` makes of it, and of the secrets of its sources; return it as stored."""
        with changing_venue(self._engine, venue_id, precondition) as (connection, stored):
            return _put(connection, stored, *patch(stored.venue), by)

    def restore(
        self, venue_id: str, number: int, precondition: Precondition = UNCONDITIONAL, by: Actor | None = None
    ) -> tuple[Venue, list[str]]:
        """Restore the poses of a revision of a venue, which need not be readable.

        Returns the venue, and the cameras whose memories are dropped because none are kept with that revision. Raises
        the problems `revision-not-found` and `revision-unfit`. Writes nothing if the venue has these poses already.
        """
        with changing_venue(self._engine, venue_id, precondition, find_replaceable) as (connection, before):
            return restore_state(connection, before, number, by)

    def with_memories(self, venue_id: str) -> set[int]:
        """Return the revisions of a venue whose memories are kept, so that `restore` brings them back."""
        with reading(self._engine) as connection:
            return revisions_with_memories(connection, venue_id)

    def restorable(self, venue: Venue, numbers: Collection[int]) -> set[int]:
        """Return those revisions of a venue that `restore` would not refuse: with the same cameras and pitch."""
        with reading(self._engine) as connection:
            return revisions_that_fit(connection, venue, numbers)

    def repairing(self, venue_id: str, numbers: Collection[int]) -> set[int]:
        """Return those revisions of an unreadable venue by which `restore` makes it readable again."""
        with reading(self._engine) as connection:
            stored = find_replaceable(connection, venue_id)
            return set() if stored is None else revisions_that_fit(connection, stored.venue, numbers)

    def update_alarms(self, venue_id: str) -> None:
        """Begin and end the alarms of a venue that depend on the time."""
        with writing(self._engine) as connection:
            lock_venue(connection, venue_id)
            venue = find_venue(connection, venue_id)
            if venue is not None:
                changes = with_alarms(load(connection, venue_id), venue)
                live_alarms.plan_next(connection, venue_id, changes.after.now)
                write_changes(connection, changes)

    def postpone_alarms(self, venue_id: str) -> None:
        """Postpone the alarms of a venue that cannot be read by `UNREADABLE_RETRY`."""
        with writing(self._engine) as connection:
            later = {"alarm_due_at": clock(connection) + UNREADABLE_RETRY}
            for table in (tables.venue_quality, tables.live_reports):
                is_due = (table.c.venue == venue_id, table.c.alarm_due_at <= clock(connection))
                connection.execute(sa.update(table).where(*is_due).values(**later))

    def with_alarms_due(self, limit: int) -> list[str]:
        """Return up to `limit` venues whose alarms are due to be updated."""
        due_at = tables.venue_quality.c.alarm_due_at
        with reading(self._engine) as connection:
            now = clock(connection)
            query = sa.select(tables.venue_quality.c.venue).where(due_at <= now).order_by(due_at).limit(limit)
            due = [*connection.scalars(query), *live_alarms.due(connection, now, limit)]
            return list(dict.fromkeys(due))[:limit]

    def health(self, venue_id: str) -> VenueHealth | None:
        """Return the health of a venue, None if there is none."""
        with reading(self._engine) as connection:
            newest = newest_revision(connection, venue_id)
            if newest is None:
                return None
            quality = read_quality(connection, venue_id) or QualityRow()
            alarms = active_alarms(connection, [venue_id]).get(venue_id, [])
            schedule = schedule_of(connection, venue_id)
        histories = [(camera, quality.history(camera.id)) for camera in newest.cameras]
        return VenueHealth(
            state="alarm" if alarms else "ok",
            alarms=alarms,
            revision=newest.revision,
            cameras=[
                CameraHealth(**dict(camera), accepted_at=one.accepted_at, rejected_in_a_row=one.rejected_in_a_row)
                for camera, one in histories
            ],
            stitch_error_px=quality.stitch_error_px,
            accepted_at=quality.accepted_at,
            rejected_in_a_row=quality.rejected_in_a_row,
            schedule=schedule,
        )

    def delete(self, venue_id: str, precondition: Precondition = UNCONDITIONAL, by: Actor | None = None) -> None:
        """Delete a venue, readable or not, with its history; raises the problem `venue-busy` if a job of it is open."""
        with changing_venue(self._engine, venue_id, find=find_replaceable) as (connection, stored):
            j = tables.jobs.c
            active = connection.scalar(sa.select(j.id).where(j.venue == venue_id, j.status.in_(OPEN_STATUSES)))
            if active is not None:
                raise venue_busy(active)
            precondition.check(stored.venue)
            add_event(connection, venue_id, venue_event(stored.venue, "venue.deleted", [], clock(connection), by))
            for table in OF_VENUES:
                connection.execute(sa.delete(table).where(table.c.venue == venue_id))
            connection.execute(sa.delete(tables.venues).where(v.id == venue_id))

    def with_credentials(self, venue_id: str) -> tuple[Venue, dict[str, str]]:
        """Return a venue with the encoded secrets of its sources by camera; raises the problem `venue-not-found`.

        Both are read in one transaction, or a password could go to the host that a source was on before.
        """
        with reading(self._engine) as connection:
            return existing_venue(connection, venue_id), read_credentials(connection, venue_id)

    def states_since(self, venue_id: str, number: int) -> tuple[Venue, Venue, int]:
        """Return a venue as it was at a revision and as it is, and the number of its newest revision.

        Raises the problems `venue-not-found`, `revision-not-found` and `revision-unfit`.
        """
        with reading(self._engine) as connection:
            venue = existing_venue(connection, venue_id)
            then, revision = state_at(connection, venue, number)
            newest = newest_revision(connection, venue_id) or revision
            return then, venue, newest.revision

    def readable(self, venue_id: str) -> Venue | None:
        """Return a venue, None if there is none or it cannot be read."""
        with reading(self._engine) as connection:
            return find_readable(connection, venue_id)

    def exists(self, venue_id: str) -> bool:
        """Return True if there is a venue of this id, readable or not."""
        with reading(self._engine) as connection:
            return connection.scalar(sa.select(v.id).where(v.id == venue_id)) is not None

    def free_id(self) -> str:
        """Return an id `venue-N` that no venue has and no job is about."""
        prefix, j = "venue-", tables.jobs.c
        venues = sa.select(v.id).where(v.id.startswith(prefix))
        jobs = sa.select(j.venue).where(j.venue.startswith(prefix))
        with reading(self._engine) as connection:
            taken = set(connection.scalars(sa.union(venues, jobs)))
        return next(name for name in (f"{prefix}{number}" for number in count(1)) if name not in taken)

    def history(self, venue_id: str, before: int | None, limit: int) -> list[Revision]:
        """Return up to `limit` revisions of a venue that can be read, newest first, those before number `before`."""
        return self.history_page(venue_id, before, limit).revisions

    def history_page(self, venue_id: str, before: int | None, limit: int) -> RevisionPage:
        """Return up to `limit` revisions of a venue, newest first, those before number `before`."""
        with reading(self._engine) as connection:
            return revisions_of(connection, venue_id, before, limit)

    def newest_with_origin(self, venue_id: str) -> tuple[Revision, Revision] | None:
        """Return the revision in use and the one that its poses first came with; None without such a venue."""
        with reading(self._engine) as connection:
            newest = newest_revision(connection, venue_id)
            return None if newest is None else (newest, origin_of(connection, venue_id, newest))


def find_stored(connection: sa.Connection, venue_id: str) -> StoredVenue | None:
    """Return a stored venue for a transaction that may change it. Raises `UnreadableRow`."""
    row = _row_of(connection, venue_id)
    return None if row is None else read_venue(row.id, row.document)


def find_replaceable(connection: sa.Connection, venue_id: str) -> StoredVenue | None:
    """Return a stored venue for a transaction that replaces or deletes it, even if it cannot be read.

    An unreadable venue is salvaged with the poses, lenses and ridge of the newest revision that makes it readable: its
    webhooks are told of the change, and the hosts of its sources keep their passwords. Otherwise it has only its id.
    """
    row = _row_of(connection, venue_id)
    if row is None:
        return None
    try:
        return read_venue(row.id, row.document)
    except UnreadableRow as error:
        for document in documents_as_of_revisions(connection, venue_id, row.document):
            with suppress(ValueError):
                return StoredVenue(stored_venue(document), document, error.why)
        bare = Venue(id=venue_id, field=FieldOfPlay.model_validate({}), cameras=[])
        return StoredVenue(bare, {"cameras": []}, error.why)


def find_readable(connection: sa.Connection, venue_id: str) -> Venue | None:
    """Return a venue for a transaction that can do without it; None if there is none or it cannot be read."""
    try:
        return find_venue(connection, venue_id)
    except UnreadableRow:
        return None


def _row_of(connection: sa.Connection, venue_id: str) -> Any:
    return connection.execute(sa.select(v.id, v.document).where(v.id == venue_id)).one_or_none()


@contextmanager
def changing_venue(
    engine: sa.Engine, venue_id: str, precondition: Precondition = UNCONDITIONAL, find: Find = find_stored
) -> Iterator[tuple[sa.Connection, StoredVenue]]:
    """Yield a transaction that alone may change a venue, and the stored venue.

    Raises the problem `venue-not-found`, and `venue-changed` unless the venue meets the `precondition`.
    """
    with writing(engine) as connection:
        lock_venue(connection, venue_id)
        stored = find(connection, venue_id)
        if stored is None:
            raise no_such_venue(venue_id)
        precondition.check(stored.venue)
        yield connection, stored


def find_venue(connection: sa.Connection, venue_id: str) -> Venue | None:
    """Return a venue inside the caller's transaction, None if there is none. Raises `UnreadableRow`."""
    stored = find_stored(connection, venue_id)
    return None if stored is None else stored.venue


def existing_venue(connection: sa.Connection, venue_id: str) -> Venue:
    """Return a venue inside the caller's transaction; raises `UnreadableRow`, and the problem `venue-not-found`."""
    venue = find_venue(connection, venue_id)
    if venue is None:
        raise no_such_venue(venue_id)
    return venue


def _put(
    connection: sa.Connection,
    stored: StoredVenue | None,
    venue: Venue,
    secrets: Mapping[str, SourceSecrets],
    by: Actor | None,
) -> Venue:
    """Create or replace a venue as a client sent it; return it with the callbacks that came hidden."""
    before = None if stored is None else stored.venue
    known = read_credentials(connection, venue.id)
    venue = venue.with_callbacks_of(before)
    write_credentials(connection, venue.id, merge_credentials(venue, secrets, before, known))
    store_venue(connection, stored, venue, "put", by)
    return venue


def store_venue(
    connection: sa.Connection,
    stored: StoredVenue | None,
    venue: Venue,
    cause: Cause,
    by: Actor | None,
    job_id: str | None = None,
) -> None:
    """Create or replace a venue with its events, schedule and alarms, inside the caller's serialised transaction.

    `stored`: the venue so far; `cause` and `job_id`: those of the revision, if a pose or a lens changes.
    """
    memories = newest_memories(connection, venue.id)
    changes = with_venue_put(load(connection, venue.id), stored, venue, memories, cause, by, job_id)
    plan_schedule(connection, venue)
    write_changes(connection, changes)


def restore_state(
    connection: sa.Connection, stored: StoredVenue, number: int, by: Actor | None, rejected_job: str | None = None
) -> tuple[Venue, list[str]]:
    """Restore a revision of a venue with its memories and alarms, inside the caller's serialised transaction.

    Returns the venue, and the cameras that have a memory before and none after it.
    """
    then, revision = state_at(connection, stored.venue, number)
    counted_from = {camera.drift_since for camera in revision.cameras}
    changes = load(connection, then.id, [camera.id for camera in then.cameras], counted_from)
    memories = memories_at(connection, then.id, number)
    changes = with_revision_restored(changes, stored, then, revision, memories, by, rejected_job)
    forgetful = [camera for camera in newest_memories(connection, then.id) if camera not in memories]
    write_changes(connection, changes)
    return then, [] if changes.memories is None else forgetful
