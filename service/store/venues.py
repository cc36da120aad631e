"""Venues, and the way back to how they were: all SQL about them."""

from __future__ import annotations

from collections.abc import Callable, Collection

import sqlalchemy as sa

from service.store import tables
from service.store.alarms import health_of, settle_alarms
from service.store.counts.courses import note_held
from service.store.counts.figures import note
from service.store.engine import Repository, clock, reading, serialise, writing
from service.store.memories import (
    Memories,
    forget_memories,
    keep_memories,
    memories_at,
    newest_memories,
    without_those_that_changed,
)
from service.store.revisions import add_revision, revisions_of, state_at
from service.store.schedules import plan
from service.store.told.events import add_venue_event
from service.store.trends import forget_trends, note_night
from service.wire.health import VenueHealth
from service.wire.history import Cause, Revision
from service.wire.names import OPEN
from service.wire.results import Result
from service.wire.venue import Venue

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
)


class Venues(Repository):
    """The venues in the database."""

    def get(self, venue_id: str) -> Venue | None:
        """One venue."""
        with reading(self._engine) as connection:
            return find_venue(connection, venue_id)

    def page(self, after: str | None, limit: int) -> list[Venue]:
        """Up to `limit` venues by id, those after `after`."""
        query = sa.select(tables.venues.c.document).order_by(tables.venues.c.id).limit(limit)
        if after is not None:
            query = query.where(tables.venues.c.id > after)
        with reading(self._engine) as connection:
            return [Venue.model_validate(document) for document in connection.scalars(query)]

    def put(
        self,
        venue: Venue,
        allow: Callable[[Venue | None], None],
        credentials: Callable[[Venue | None, dict[str, str]], dict[str, str]] = lambda _, __: {},
    ) -> bool:
        """Store a venue unless `allow` raises at the sight of what is there; says whether it is new.

        `credentials`: those of its sources, by what is there and those that are stored; it may raise too.
        """

        def put(before: Venue | None, known: dict[str, str]) -> tuple[Venue, dict[str, str]]:
            allow(before)
            return venue, credentials(before, known)

        return self.change(venue.id, put)[1]

    def change(
        self, venue_id: str, change: Callable[[Venue | None, dict[str, str]], tuple[Venue, dict[str, str]]]
    ) -> tuple[Venue, bool]:
        """Store what `change` makes of a venue and of the credentials of its sources, unless it raises at the sight.

        Gives the venue, and says whether it is new.
        """
        with writing(self._engine) as connection:
            serialise(connection, venue_lock(venue_id))
            before = find_venue(connection, venue_id)
            venue, credentials = change(before, _credentials(connection, venue_id))
            _keep(connection, venue_id, credentials)
            save_venue(connection, venue)
            if before is None:
                add_venue_event(connection, venue, "venue.created", [])
            elif changed := venue.differs_in(before):
                add_venue_event(connection, venue, "venue.changed", changed)
            _note_put(connection, before, venue)
            settle_alarms(connection, venue)
            plan(connection, venue)
            return venue, before is None

    def restore(self, venue_id: str, number: int, allow: Callable[[Venue | None], None]) -> Venue:
        """Let a revision hold again unless `allow` raises at the sight of the venue.

        Raises `NoSuchRevision` and `RevisionUnfit`. Nothing is written if it holds anyway.
        """
        with writing(self._engine) as connection:
            serialise(connection, venue_lock(venue_id))
            before = find_venue(connection, venue_id)
            allow(before)
            assert before is not None
            restored = put_back(connection, before, number)
            settle_alarms(connection, restored)
            return restored

    def settle_alarms(self, venue_id: str) -> None:
        """Let the alarms of a venue begin and end that go by the time."""
        with writing(self._engine) as connection:
            serialise(connection, venue_lock(venue_id))
            venue = find_venue(connection, venue_id)
            if venue is not None:
                settle_alarms(connection, venue)

    def with_alarms_due(self, limit: int) -> list[str]:
        """Up to `limit` venues of which a time has passed that an alarm goes by."""
        due_at = tables.venue_quality.c.alarm_due_at
        with reading(self._engine) as connection:
            query = sa.select(tables.venue_quality.c.venue).where(due_at <= clock(connection))
            return list(connection.scalars(query.order_by(due_at).limit(limit)))

    def health(self, venue_id: str) -> VenueHealth | None:
        """How a venue is doing."""
        with reading(self._engine) as connection:
            return health_of(connection, venue_id)

    def delete(self, venue_id: str, allow: Callable[[Venue | None, str | None], None]) -> None:
        """Forget a venue and its poses unless `allow` raises at the sight of it or of its active job."""
        with writing(self._engine) as connection:
            serialise(connection, venue_lock(venue_id))
            j = tables.jobs.c
            active = connection.scalar(sa.select(j.id).where(j.venue == venue_id, j.status.in_(OPEN)))
            venue = find_venue(connection, venue_id)
            allow(venue, active)
            if venue is not None:
                add_venue_event(connection, venue, "venue.deleted", [])
            for table in OF_VENUES:
                connection.execute(sa.delete(table).where(table.c.venue == venue_id))
            connection.execute(sa.delete(tables.venues).where(tables.venues.c.id == venue_id))

    def with_credentials(self, venue_id: str) -> tuple[Venue, dict[str, str]] | None:
        """A venue, and by camera user and password of the sources that have some: of one moment, or a password could
        go to the host that a source was on before.
        """
        with reading(self._engine) as connection:
            venue = find_venue(connection, venue_id)
            return None if venue is None else (venue, _credentials(connection, venue_id))

    def history(self, venue_id: str, before: int | None, limit: int) -> list[Revision]:
        """Up to `limit` revisions of a venue, newest first, those before number `before`."""
        with reading(self._engine) as connection:
            return revisions_of(connection, venue_id, before, limit)


def venue_lock(venue_id: str) -> str:
    """What to be serialised about by whoever changes a venue, or relies on it to stay."""
    return f"venue {venue_id}"


def find_venue(connection: sa.Connection, venue_id: str) -> Venue | None:
    """One venue, inside the caller's transaction."""
    document = connection.scalar(sa.select(tables.venues.c.document).where(tables.venues.c.id == venue_id))
    return None if document is None else Venue.model_validate(document)


def save_venue(connection: sa.Connection, venue: Venue) -> None:
    """Create or replace a venue, inside the caller's serialised transaction."""
    values = {"document": venue.model_dump(mode="json"), "updated_at": clock(connection)}
    table = tables.venues
    replaced = connection.execute(sa.update(table).where(table.c.id == venue.id).values(**values))
    if replaced.rowcount == 0:
        connection.execute(sa.insert(table).values(id=venue.id, **values))


def _note_put(connection: sa.Connection, before: Venue | None, venue: Venue) -> None:
    """Write down the revision that a PUT may be, with the memories that it leaves.

    A camera that was put elsewhere, or has another lens, begins anew, and on another field all of them do.
    """
    if before is not None and before.field != venue.field:
        forget_memories(connection, venue.id)
        forget_trends(connection, venue.id)
    if before is None or not venue.stands_like(before):
        memories = newest_memories(connection, venue.id)
        left = {} if before is None else without_those_that_changed(memories, before, venue)
        keep_memories(connection, venue.id, add_revision(connection, venue, "put"), left)


def let_hold(
    connection: sa.Connection,
    venue: Venue,
    result: Result,
    cameras: Collection[str],
    cause: Cause,
    job_id: str,
    memories: Memories,
) -> None:
    """Let some cameras of a venue be as a calibration found them, inside the caller's serialised transaction.

    `memories`: those that the venue then has.
    """
    found = with_result(venue, result, cameras)
    save_venue(connection, found)
    note_held(connection, venue.id, result, cameras, clock(connection))
    number = add_revision(connection, found, cause, job_id, stitch_error_px=result.stitch_error_px)
    keep_memories(connection, venue.id, number, memories)
    night = [camera for camera in result.cameras if camera.id in cameras]
    note_night(connection, found, night, job_id, number, by_hand=cause == "accepted")
    settle_alarms(connection, found)


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


def put_back(connection: sa.Connection, venue: Venue, number: int, rejected_job: str | None = None) -> Venue:
    """Let a revision of a venue hold again with its memories, inside the caller's serialised transaction."""
    then, revision = state_at(connection, venue, number)
    if not then.stands_like(venue):
        save_venue(connection, then)
        memories = memories_at(connection, venue.id, number)
        restored = add_revision(connection, then, "restored", rejected_job, revision, revision.stitch_error_px)
        keep_memories(connection, venue.id, restored, memories)
        note(connection, venue.id, stitch_error_px=revision.stitch_error_px)
    return then


def _credentials(connection: sa.Connection, venue_id: str) -> dict[str, str]:
    rows = connection.execute(sa.select(tables.credentials).where(tables.credentials.c.venue == venue_id))
    return {row.camera: row.userinfo for row in rows}


def _keep(connection: sa.Connection, venue_id: str, credentials: dict[str, str]) -> None:
    connection.execute(sa.delete(tables.credentials).where(tables.credentials.c.venue == venue_id))
    rows = [{"venue": venue_id, "camera": camera, "userinfo": userinfo} for camera, userinfo in credentials.items()]
    if rows:
        connection.execute(sa.insert(tables.credentials), rows)
