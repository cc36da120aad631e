"""Venues, and the way back to how they were: all SQL about them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, Literal

import sqlalchemy as sa
from pydantic import ValidationError

from service.schemas.actor import Actor
from service.schemas.base import TOLERANTLY, Unreadable
from service.schemas.field import FieldOfPlay
from service.schemas.findings import describe_errors
from service.schemas.health import VenueHealth
from service.schemas.history import Cause, Revision
from service.schemas.names import OPEN_STATUSES
from service.schemas.results import Result
from service.schemas.venue import Venue, VenueIn
from service.store import live_alarms, tables
from service.store.alarms import health_of, update_alarms
from service.store.database import Repository, advisory_lock, clock, reading, writing
from service.store.documents import Document, stored_venue, to_document, with_unknown_fields_of
from service.store.events.event_log import add_venue_event
from service.store.memories import (
    Memories,
    forget_memories,
    keep_memories,
    memories_at,
    newest_memories,
    revisions_with_memories,
    without_those_that_changed,
)
from service.store.revisions import (
    RevisionPage,
    add_revision,
    documents_as_of_revisions,
    newest_revision,
    origin_of,
    revisions_of,
    revisions_that_fit,
    state_at,
)
from service.store.schedules import plan_schedule
from service.store.statistics.venue_quality import VenueQuality, update_quality
from service.store.trends import forget_trends, note_night
from service.store.unreadable import MOST_FAULTS, UnreadableRow, read_each, reading_row

v = tables.venues.c
# What goes with a venue.
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


# An unreadable venue cannot be repaired by the service; this often a duty looks whether somebody has.
UNREADABLE_RETRY = timedelta(minutes=10)


@dataclass(frozen=True)
class StoredVenue:
    """A venue, and its document as it was read, with what other versions have written into it.

    `unreadable`: why the document cannot be read; then `venue` is what could be salvaged of it, see `find_replaceable`.
    """

    venue: Venue
    document: Document
    unreadable: str | None = None


@dataclass(frozen=True)
class VenuePage:
    """Venues of a page by id, those of it that cannot be read, and the id after which the next page begins."""

    venues: list[Venue]
    unreadable: list[Unreadable]
    next_cursor: str | None


Find = Callable[[sa.Connection, str], StoredVenue | None]


class VenueRefused(Exception):  # noqa: N818
    """A venue was not written because a client could not send it as it would be; the message says why."""


class VenueRepository(Repository):
    """The venues in the database."""

    def get(self, venue_id: str) -> Venue | None:
        """One venue."""
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
        """Return up to `limit` venues by id, those after `after`; of `only` these, None: of all.

        `q`: those whose id or name contains it; large letters are small ones (on SQLite those of ASCII). `state`: those
        of which an alarm rings, or none does.
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
        venues, unreadable = read_each(rows[:limit], _venue_in)
        return VenuePage(venues, unreadable, rows[limit - 1].id if len(rows) > limit else None)

    def put(
        self,
        venue: Venue,
        allow: Callable[[Venue | None], None],
        credentials: Callable[[Venue | None, dict[str, str]], dict[str, str]] = lambda _, __: {},
        by: Actor | None = None,
    ) -> bool:
        """Store a venue unless `allow` raises at the sight of what is there; says whether it is new.

        `credentials`: those of its sources, by what is there and those that are stored; it may raise too.
        """

        def put(before: Venue | None, known: dict[str, str]) -> tuple[Venue, dict[str, str]]:
            allow(before)
            return venue, credentials(before, known)

        return self.change(venue.id, put, by, find_replaceable)[1]

    def change(
        self,
        venue_id: str,
        change: Callable[[Venue | None, dict[str, str]], tuple[Venue, dict[str, str]]],
        by: Actor | None = None,
        find: Find | None = None,
    ) -> tuple[Venue, bool]:
        """Store what `change` makes of a venue and of the credentials of its sources, unless it raises at the sight.

        `find`: `find_replaceable` of a change that leaves nothing of what was; else what cannot be read stays as it is.
        Gives the venue, and says whether it is new.
        """
        with writing(self._engine) as connection:
            advisory_lock(connection, venue_lock(venue_id))
            stored = (find or find_stored)(connection, venue_id)
            before = None if stored is None else stored.venue
            venue, credentials = change(before, _credentials(connection, venue_id))
            _keep(connection, venue_id, credentials)
            store_venue(connection, stored, venue, "put", by)
            return venue, before is None

    def restore(
        self, venue_id: str, number: int, allow: Callable[[Venue | None], None], by: Actor | None = None
    ) -> tuple[Venue, list[str]]:
        """Let a revision hold again unless `allow` raises at the sight of the venue, which need not be readable.

        Gives the venue, and the cameras whose memories are dropped because none are kept with that revision. Raises
        `NoSuchRevision` and `RevisionUnfit`. Nothing is written if it holds anyway.
        """
        with changing_venue(self._engine, venue_id, allow, find_replaceable) as (connection, before):
            with update_quality(connection, venue_id) as quality:
                restored, forgetful = restore_state(connection, quality, before, number, by)
                update_alarms(connection, quality, restored)
            return restored, forgetful

    def with_memories(self, venue_id: str) -> set[int]:
        """Return the revisions of a venue that `restore` brings back with the nights that cameras remembered."""
        with reading(self._engine) as connection:
            return revisions_with_memories(connection, venue_id)

    def restorable(self, venue: Venue, numbers: Collection[int]) -> set[int]:
        """Return the revisions of a venue that `restore` would not refuse: of these cameras and this pitch."""
        with reading(self._engine) as connection:
            return revisions_that_fit(connection, venue, numbers)

    def repairing(self, venue_id: str, numbers: Collection[int]) -> set[int]:
        """Return the revisions of these by which `restore` makes a venue that cannot be read readable again."""
        with reading(self._engine) as connection:
            stored = find_replaceable(connection, venue_id)
            return set() if stored is None else revisions_that_fit(connection, stored.venue, numbers)

    def update_alarms(self, venue_id: str) -> None:
        """Begin and end the alarms of a venue that go by the time."""
        with writing(self._engine) as connection:
            advisory_lock(connection, venue_lock(venue_id))
            venue = find_venue(connection, venue_id)
            if venue is not None:
                with update_quality(connection, venue_id) as quality:
                    update_alarms(connection, quality, venue)
                    live_alarms.plan_next(connection, venue_id, quality.now)

    def postpone_alarms(self, venue_id: str) -> None:
        """Look at the alarms of a venue that cannot be read again after a while."""
        with writing(self._engine) as connection:
            later = {"alarm_due_at": clock(connection) + UNREADABLE_RETRY}
            for table in (tables.venue_quality, tables.live_reports):
                is_due = (table.c.venue == venue_id, table.c.alarm_due_at <= clock(connection))
                connection.execute(sa.update(table).where(*is_due).values(**later))

    def with_alarms_due(self, limit: int) -> list[str]:
        """Up to `limit` venues of which a time has passed that an alarm goes by."""
        due_at = tables.venue_quality.c.alarm_due_at
        with reading(self._engine) as connection:
            now = clock(connection)
            query = sa.select(tables.venue_quality.c.venue).where(due_at <= now).order_by(due_at).limit(limit)
            due = [*connection.scalars(query), *live_alarms.due(connection, now, limit)]
            return list(dict.fromkeys(due))[:limit]

    def health(self, venue_id: str) -> VenueHealth | None:
        """How a venue is doing."""
        with reading(self._engine) as connection:
            return health_of(connection, venue_id)

    def delete(self, venue_id: str, allow: Callable[[Venue | None, str | None], None], by: Actor | None = None) -> None:
        """Forget a venue and its poses unless `allow` raises at the sight of it or of its active job."""
        with writing(self._engine) as connection:
            advisory_lock(connection, venue_lock(venue_id))
            j = tables.jobs.c
            active = connection.scalar(sa.select(j.id).where(j.venue == venue_id, j.status.in_(OPEN_STATUSES)))
            stored = find_replaceable(connection, venue_id)
            allow(None if stored is None else stored.venue, active)
            if stored is not None:
                add_venue_event(connection, stored.venue, "venue.deleted", [], by)
            for table in OF_VENUES:
                connection.execute(sa.delete(table).where(table.c.venue == venue_id))
            connection.execute(sa.delete(tables.venues).where(tables.venues.c.id == venue_id))

    def with_credentials(self, venue_id: str) -> tuple[Venue, dict[str, str]] | None:
        """A venue, and by camera user and password of the sources that have some: of one moment, or a password could
        go to the host that a source was on before.
        """
        with reading(self._engine) as connection:
            stored = find_stored(connection, venue_id)
            return None if stored is None else (stored.venue, _credentials(connection, venue_id))

    def readable(self, venue_id: str) -> Venue | None:
        """Return one venue; None: there is none, or it cannot be read."""
        with reading(self._engine) as connection:
            return find_readable(connection, venue_id)

    def exists(self, venue_id: str) -> bool:
        """Return whether there is a venue of this id, readable or not."""
        with reading(self._engine) as connection:
            return connection.scalar(sa.select(v.id).where(v.id == venue_id)) is not None

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
    """Return one venue, for a transaction that may change it. Raises `UnreadableRow`."""
    row = _row_of(connection, venue_id)
    return None if row is None else StoredVenue(_venue_in(row), row.document)


def find_replaceable(connection: sa.Connection, venue_id: str) -> StoredVenue | None:
    """Return one venue, for a transaction that replaces or deletes it: one that cannot be read as well.

    Of such a venue what can be read with the poses, lenses and ridge of a revision is salvaged, of the newest possible.
    It says who is told of changes, and where the passwords of its sources belong. Else it is a venue of its id alone.
    """
    row = _row_of(connection, venue_id)
    if row is None:
        return None
    try:
        return StoredVenue(_venue_in(row), row.document)
    except UnreadableRow as error:
        for document in documents_as_of_revisions(connection, venue_id, row.document):
            with suppress(ValueError):
                return StoredVenue(stored_venue(document), document, error.why)
        bare = Venue(id=venue_id, field=FieldOfPlay.model_validate({}), cameras=[])
        return StoredVenue(bare, {"cameras": []}, error.why)


def find_readable(connection: sa.Connection, venue_id: str) -> Venue | None:
    """Return one venue; None: there is none, or it cannot be read, which must not stop what can do without it."""
    try:
        return find_venue(connection, venue_id)
    except UnreadableRow:
        return None


def _row_of(connection: sa.Connection, venue_id: str) -> Any:
    return connection.execute(sa.select(v.id, v.document).where(v.id == venue_id)).one_or_none()


def _venue_in(row: Any) -> Venue:
    with reading_row("venue", row.id):
        return stored_venue(row.document)


@contextmanager
def changing_venue(
    engine: sa.Engine, venue_id: str, allow: Callable[[Venue | None], None], find: Find = find_stored
) -> Iterator[tuple[sa.Connection, StoredVenue]]:
    """A transaction that alone may change a venue, and what is stored of it, unless `allow` raises at the sight.

    `allow` raises where it is given None: there is no such venue.
    """
    with writing(engine) as connection:
        advisory_lock(connection, venue_lock(venue_id))
        stored = find(connection, venue_id)
        allow(None if stored is None else stored.venue)
        assert stored is not None
        yield connection, stored


def venue_lock(venue_id: str) -> str:
    """What to be serialised about by whoever changes a venue, or relies on it to stay."""
    return f"venue {venue_id}"


def find_venue(connection: sa.Connection, venue_id: str) -> Venue | None:
    """One venue, inside the caller's transaction."""
    stored = find_stored(connection, venue_id)
    return None if stored is None else stored.venue


def faults_of(venue: Venue) -> list[str]:
    """Return in words what of a venue a client could not send: what is stored can be sent back as it is."""
    document = venue.model_dump(mode="json")
    try:
        # Words of newer versions are none.
        VenueIn.model_validate(document, **TOLERANTLY)
    except ValidationError as error:
        return describe_errors(error.errors(), None, document)
    return []


def save_venue(connection: sa.Connection, venue: Venue, now: datetime, before: StoredVenue | None) -> None:
    """Create or replace a venue, inside the caller's serialised transaction; `before`: what is stored of it so far.

    Raises `VenueRefused` for one that a client could not send: whoever reads it, or sends it back, would be refused.
    """
    faults = faults_of(venue)
    if faults and before is not None:
        # What another release has let pass does not keep this one from changing the rest.
        known = faults_of(before.venue)
        faults = [fault for fault in faults if fault not in known]
    if faults:
        raise VenueRefused("; ".join(faults[:MOST_FAULTS]))
    document = to_document(venue)
    if before is None:
        connection.execute(sa.insert(tables.venues).values(id=venue.id, document=document, updated_at=now))
    else:
        whole = with_unknown_fields_of(before.document, document)
        connection.execute(sa.update(tables.venues).where(v.id == venue.id).values(document=whole, updated_at=now))


def store_venue(
    connection: sa.Connection,
    stored: StoredVenue | None,
    venue: Venue,
    cause: Cause,
    by: Actor | None,
    job_id: str | None = None,
) -> None:
    """Create or replace a venue as somebody wants it, inside the caller's serialised transaction.

    `stored`: what is there; `cause` and `job_id`: of the revision, where that changes a pose or a lens.
    """
    before = None if stored is None else stored.venue
    save_venue(connection, venue, clock(connection), stored)
    if before is None:
        add_venue_event(connection, venue, "venue.created", [], by)
    elif changed := venue.changed_parts(before):
        add_venue_event(connection, venue, "venue.changed", changed, by)
    with update_quality(connection, venue.id) as quality:
        _note_placed(connection, quality, stored, venue, cause, job_id, by)
        update_alarms(connection, quality, venue)
    plan_schedule(connection, venue)


def _note_placed(
    connection: sa.Connection,
    quality: VenueQuality,
    stored: StoredVenue | None,
    venue: Venue,
    cause: Cause,
    job_id: str | None,
    by: Actor | None,
) -> None:
    """Write down the revision that a venue may have become, with the memories that it leaves.

    A camera that was put elsewhere, or has another lens, begins anew, and on another field all of them do.
    """
    before = None if stored is None else stored.venue
    if before is not None and before.field != venue.field:
        forget_memories(connection, venue.id)
        forget_trends(connection, venue.id)
    if stored is None or before is None or stored.unreadable or not venue.has_same_poses_as(before):
        memories = newest_memories(connection, venue.id)
        left = {} if before is None else without_those_that_changed(memories, before, venue)
        keep_memories(connection, venue.id, add_revision(connection, quality, venue, cause, job_id, by=by), left)


def apply_result(
    connection: sa.Connection,
    quality: VenueQuality,
    stored: StoredVenue,
    result: Result,
    cameras: Collection[str],
    cause: Cause,
    job_id: str,
    memories: Memories,
    by: Actor | None,
) -> None:
    """Let some cameras of a venue be as a calibration found them, inside the caller's serialised transaction.

    `memories`: those that the venue then has.
    """
    found = with_result(stored.venue, result, cameras)
    save_venue(connection, found, quality.now, stored)
    quality.hold(result, cameras)
    number = add_revision(connection, quality, found, cause, job_id, stitch_error_px=result.stitch_error_px, by=by)
    keep_memories(connection, found.id, number, memories)
    night = [camera for camera in result.cameras if camera.id in cameras]
    note_night(connection, found, night, job_id, number, quality.now, by_hand=cause == "accepted")
    update_alarms(connection, quality, found)


def with_result(venue: Venue, result: Result, cameras: Collection[str] | None = None) -> Venue:
    """The same venue as a calibration found it: poses, the lenses and the ridge they belong to, and the cameras' light.

    `cameras`: only those are as it found them; None: all.
    """
    found = {camera.id: camera for camera in result.cameras if cameras is None or camera.id in cameras}
    standing = [
        camera.model_copy(
            update={
                "pose": found[camera.id].pose,
                "intrinsics": found[camera.id].intrinsics or camera.intrinsics,
                "light": found[camera.id].light or camera.light,
            }
        )
        if camera.id in found
        else camera
        for camera in venue.cameras
    ]
    field = venue.field if result.ridge is None else venue.field.model_copy(update={"ridge": result.ridge})
    return venue.model_copy(update={"cameras": standing, "field": field})


def restore_state(
    connection: sa.Connection,
    quality: VenueQuality,
    stored: StoredVenue,
    number: int,
    by: Actor | None,
    rejected_job: str | None = None,
) -> tuple[Venue, list[str]]:
    """Let a revision of a venue hold again with its memories, inside the caller's serialised transaction.

    Gives the venue, and the cameras that have a memory before and none after it.
    """
    before, forgetful = stored.venue, list[str]()
    then, revision = state_at(connection, before, number)
    if stored.unreadable or not then.has_same_calibration_input_as(before):
        save_venue(connection, then, quality.now, stored)
        if then.field.size != before.field.size:
            add_venue_event(connection, then, "venue.changed", ["field"], by)
        memories = memories_at(connection, then.id, number)
        forgetful = [camera for camera in newest_memories(connection, then.id) if camera not in memories]
        px = revision.stitch_error_px
        restored = add_revision(
            connection, quality, then, "restored", rejected_job, revision, px, by, field_before=before.field
        )
        keep_memories(connection, then.id, restored, memories)
        quality.row.stitch_error_px = revision.stitch_error_px
    return then, forgetful


def _credentials(connection: sa.Connection, venue_id: str) -> dict[str, str]:
    rows = connection.execute(sa.select(tables.credentials).where(tables.credentials.c.venue == venue_id))
    return {row.camera: row.userinfo for row in rows}


def _keep(connection: sa.Connection, venue_id: str, credentials: dict[str, str]) -> None:
    connection.execute(sa.delete(tables.credentials).where(tables.credentials.c.venue == venue_id))
    rows = [{"venue": venue_id, "camera": camera, "userinfo": userinfo} for camera, userinfo in credentials.items()]
    if rows:
        connection.execute(sa.insert(tables.credentials), rows)
