"""State of a venue that follows from what happens to it: read once in a transaction, and written once.

Whatever happens to a venue goes this way: a job ends, somebody puts poses or restores a revision, time passes.
`venue_fold` and `alarms` decide in between, without a database. The caller's transaction is serialised about the venue
from the beginning (`lock_venue`).
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import Any

import sqlalchemy as sa

from service.schemas.base import TOLERANTLY
from service.schemas.geometry import Movement, PosedCamera
from service.schemas.health import Alarm
from service.schemas.history import Cause, Revision
from service.schemas.trend import TrendState
from service.schemas.venue import Venue
from service.store import live_alarms, tables
from service.store.actors import actor_in
from service.store.database import clock
from service.store.documents import Document, stored_alarm, stored_venue, to_document, with_unknown_fields_of
from service.store.events.event_log import NewEvent, add_event
from service.store.live_alarms import AlarmKey, LiveWatch
from service.store.memories import Memories, forget_memories, keep_memories
from service.store.statistics import counters
from service.store.statistics.counters import Increments
from service.store.statistics.venue_quality import QualityRow, read_quality
from service.store.trend_charts import state_of
from service.store.unreadable import UnreadableRow, reading_row

a = tables.alarms.c
c = tables.camera_anchors.c
q = tables.venue_quality.c
r = tables.revisions.c
t = tables.camera_trend.c
v = tables.venues.c
# Camera, and the number of the revision that its anchor began with.
AnchorKey = tuple[str, int]
Rows = Mapping[Any, Mapping[str, Any]]


@dataclass(frozen=True)
class StoredVenue:
    """A venue and its stored document, with fields that other versions have written into it.

    `unreadable`: why the document cannot be read; then `venue` is what could be salvaged of it, see `find_replaceable`.
    """

    venue: Venue
    document: Document
    unreadable: str | None = None


@dataclass(frozen=True)
class RevisionRow:
    """A row of `revisions`; its columns are explained in `service.store.tables`."""

    venue: str
    number: int
    at: datetime
    cause: Cause
    job: str | None
    restored_from: int | None
    stitch_error_px: float | None
    cameras: list[Document]
    ridge: list[list[float]] | None
    field_numbers: dict[str, dict[str, float]] | None
    movements: dict[str, Document]
    asked_by: str | None
    address: str | None
    request_id: str | None

    def revision(self) -> Revision:
        """Return the row as the history shows it. Raises `UnreadableRow`."""
        names = ("at", "cause", "job", "restored_from", "stitch_error_px", "ridge")
        with reading_row("revision", f"{self.venue}/{self.number}"):
            cameras = [
                {"id": camera["id"], "pose": camera["pose"], **self.movements[camera["id"]]} for camera in self.cameras
            ]
            values = {
                "revision": self.number,
                "cameras": cameras,
                "by": actor_in(self),
                "field_numbers": self.field_numbers or {},
            }
            return Revision.model_validate(values | {name: getattr(self, name) for name in names}, **TOLERANTLY)

    def posed(self) -> dict[str, PosedCamera]:
        """Return its cameras, by id. Raises `UnreadableRow`."""
        with reading_row("revision", f"{self.venue}/{self.number}"):
            cameras = [PosedCamera.model_validate(camera, **TOLERANTLY) for camera in self.cameras]
            for camera in cameras:
                Movement.model_validate(self.movements[camera.id], **TOLERANTLY)
            return {camera.id: camera for camera in cameras}

    def posed_or_none(self) -> dict[str, PosedCamera]:
        """Return its cameras, by id; none if it cannot be read, so that changes go on."""
        try:
            return self.posed()
        except UnreadableRow:
            return {}

    def drift_since(self) -> dict[str, int]:
        """Return the number of the revision that the drift of each camera is counted from; {} if it is unreadable."""
        return {camera: self.movements[camera]["drift_since"] for camera in self.posed_or_none()}


@dataclass(frozen=True)
class AnchorRow:
    """A row of `camera_anchors`; its columns are explained in `service.store.tables`."""

    venue: str
    camera: str
    revision: int
    at: datetime | None
    posed: Document | None
    baselines: dict[str, Document]
    beyond: bool
    moved_m: float | None
    cusum: float | None
    words: str

    def state(self, alarm_m: float) -> TrendState:
        """Return the state of the camera, where so many metres at the far touchline are an alarm."""
        return state_of(beyond=self.beyond, moved_m=self.moved_m or 0.0, alarm_m=alarm_m)


@dataclass(frozen=True)
class NightRow:
    """A new row of `camera_trend`; those that are stored already have an `id`."""

    venue: str
    camera: str
    anchor: int
    revision: int
    job: str
    at: datetime
    across_m: float
    away_m: float
    sigma_across_m: float
    sigma_away_m: float
    repeatability_across_m: float
    repeatability_away_m: float
    rotation_deg: float
    sigma_rotation_deg: float | None
    position_m: float
    sigma_position_m: float | None
    focal_length: float | None
    sigma_focal_length: float | None
    focal_length_m: float


@dataclass(frozen=True)
class VenueState:
    """State of a venue at one moment, `now`; `venue_id`: None for that of a job without a venue, which has none.

    `earlier`: the revisions that a drift or a time is counted from. `nights`: of the cameras that were asked for, the
    rows of their trends, oldest first.
    """

    venue_id: str | None
    now: datetime
    quality: QualityRow = field(default_factory=QualityRow)
    newest: RevisionRow | None = None
    earlier: Sequence[RevisionRow] = ()
    anchors: Mapping[AnchorKey, AnchorRow] = field(default_factory=dict)
    nights: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    alarms: Mapping[AlarmKey, Alarm] = field(default_factory=dict)
    live: LiveWatch | None = None

    def newest_anchors(self) -> dict[str, AnchorRow]:
        """Return the anchors that count, by camera."""
        return newest_anchors(self.anchors.values())

    def anchor_rows(self) -> Rows:
        """Return the rows of `camera_anchors`."""
        return {key: vars(anchor) for key, anchor in self.anchors.items()}

    def alarm_rows(self) -> Rows:
        """Return the rows of `alarms`."""
        return {
            (rule, camera): {"venue": self.venue_id, "rule": rule, "camera": camera, "since": one.since, "why": one.why}
            for (rule, camera), one in self.alarms.items()
        }

    def revision_at(self, number: int) -> datetime:
        """Return the time of a revision, or of the oldest after it that is kept."""
        rows = [*self.earlier, *([] if self.newest is None else [self.newest])]
        return min((row for row in rows if row.number >= number), key=lambda row: row.number).at

    def posed_at(self, number: int) -> dict[str, PosedCamera]:
        """Return the cameras of a revision, by id; none if it has expired or cannot be read."""
        row = next((row for row in self.earlier if row.number == number), None)
        return {} if row is None else row.posed_or_none()


@dataclass(frozen=True)
class Changes:
    """Changes of a venue: its state before and after, and what is written beside it.

    `venue`: the venue that replaces `stored`, None: it stays. `memories`: those that come with the newest revision;
    None: no revision came. `last_night`: the revision after which nights are deleted; `dropped`: the ids of other
    nights that are. `knocked`: by camera why the calibration that has just ended proposes its pose; None: none has.
    """

    before: VenueState
    after: VenueState
    stored: StoredVenue | None = None
    venue: Venue | None = None
    forgets_memories: bool = False
    memories: Memories | None = None
    last_night: int | None = None
    dropped: Collection[int] = ()
    events: tuple[NewEvent, ...] = ()
    counted: Increments = field(default_factory=dict)
    knocked: Mapping[str, str] | None = None

    def with_state(self, **parts: Any) -> "Changes":
        """Return the changes with these parts of the state after them."""
        return replace(self, after=replace(self.after, **parts))

    def with_quality(self, **columns: Any) -> "Changes":
        """Return the changes with these columns of the quality after them."""
        return self.with_state(quality=replace(self.after.quality, **columns))

    def with_events(self, *events: NewEvent) -> "Changes":
        """Return the changes with more events of the venue."""
        return replace(self, events=(*self.events, *events))


def newest_anchors(anchors: Collection[AnchorRow]) -> dict[str, AnchorRow]:
    """Return the newest of some anchors of each camera, by camera."""
    return {anchor.camera: anchor for anchor in sorted(anchors, key=lambda one: (one.revision, one.camera))}


# Reading


def read_venue(venue_id: str, document: Document) -> StoredVenue:
    """Return the venue of a stored document. Raises `UnreadableRow`."""
    with reading_row("venue", venue_id):
        return StoredVenue(stored_venue(document), document)


def load(
    connection: sa.Connection, venue_id: str | None, charted: Collection[str] = (), numbers: Collection[int] = ()
) -> Changes:
    """Return the state of a venue now, unchanged, with the nights of the `charted` cameras.

    `numbers`: those of other revisions that a drift or a time may be counted from.
    """
    now = clock(connection)
    if venue_id is None:
        state = VenueState(None, now)
        return Changes(state, state)
    newest = newest_revision_row(connection, venue_id)
    counted_from = {1, *numbers, *({} if newest is None else newest.drift_since()).values()}
    state = VenueState(
        venue_id,
        now,
        read_quality(connection, venue_id) or QualityRow(),
        newest,
        _revisions_from(connection, venue_id, counted_from),
        {(anchor.camera, anchor.revision): anchor for anchor in read_anchors(connection, venue_id)},
        read_nights(connection, venue_id, charted),
        {(alarm.rule, alarm.camera or ""): alarm for alarm in active_alarms(connection, [venue_id]).get(venue_id, [])},
        live_alarms.watch_of(connection, venue_id),
    )
    return Changes(state, state)


def newest_revision_row(connection: sa.Connection, venue_id: str) -> RevisionRow | None:
    """Return the row of the revision in use, None without such a venue."""
    return next(iter(revision_rows(connection, r.venue == venue_id, limit=1)), None)


def revision_rows(
    connection: sa.Connection, *conditions: sa.ColumnElement[bool], limit: int | None = None
) -> list[RevisionRow]:
    """Return the revisions that meet conditions, newest first."""
    columns = [column for column in r if column is not r.id]
    query = sa.select(*columns).where(*conditions).order_by(r.number.desc()).limit(limit)
    return [RevisionRow(**row) for row in connection.execute(query).mappings()]


def _revisions_from(connection: sa.Connection, venue_id: str, numbers: Collection[int]) -> list[RevisionRow]:
    """Return the revisions with these numbers; for one that has expired, the oldest after it that is kept."""
    later = sa.alias(tables.revisions, "later").c
    kept = [
        sa.select(sa.func.min(later.number)).where(later.venue == venue_id, later.number >= number).scalar_subquery()
        for number in sorted(numbers)
    ]
    return revision_rows(connection, r.venue == venue_id, r.number.in_(kept))


def read_anchors(connection: sa.Connection, venue_id: str) -> list[AnchorRow]:
    """Return all anchors of the cameras of a venue, also those that count no more."""
    query = sa.select(tables.camera_anchors).where(c.venue == venue_id)
    return [AnchorRow(**row) for row in connection.execute(query).mappings()]


def read_nights(connection: sa.Connection, venue_id: str, cameras: Collection[str]) -> dict[str, list[Any]]:
    """Return the rows of the trends of cameras, oldest first, by camera."""
    rows: dict[str, list[Any]] = {camera: [] for camera in cameras}
    if rows:
        query = sa.select(tables.camera_trend).where(t.venue == venue_id, t.camera.in_(cameras)).order_by(t.id)
        for row in connection.execute(query):
            rows[row.camera].append(row)
    return rows


def active_alarms(connection: sa.Connection, venues: Collection[str]) -> dict[str, list[Alarm]]:
    """Return the active alarms of venues, the oldest first, by venue, inside the caller's transaction."""
    query = sa.select(tables.alarms).where(a.venue.in_(venues)).order_by(a.since, a.rule, a.camera)
    alarms: dict[str, list[Alarm]] = {}
    for row in connection.execute(query):
        alarms.setdefault(row.venue, []).append(stored_alarm(row))
    return alarms


# Writing


def write_changes(connection: sa.Connection, changes: Changes) -> None:
    """Write the changes of a venue, inside the caller's transaction that has read its state."""
    before, after = changes.before, changes.after
    if after.venue_id is not None:
        _write_venue(connection, changes)
        _write_revision(connection, after.venue_id, changes)
        _write_difference(connection, tables.camera_anchors, before.anchor_rows(), after.anchor_rows())
        _write_nights(connection, after.venue_id, changes)
        _write_difference(connection, tables.alarms, before.alarm_rows(), after.alarm_rows())
        _write_quality(connection, after.venue_id, before.quality, after.quality)
        for event in changes.events:
            add_event(connection, after.venue_id, event)
    # Last: all venues share the counters, and who holds them waits for nothing else.
    counters.add(connection, changes.counted)


def _write_venue(connection: sa.Connection, changes: Changes) -> None:
    if changes.venue is None:
        return
    document, now = to_document(changes.venue), changes.after.now
    if changes.stored is None:
        connection.execute(sa.insert(tables.venues).values(id=changes.venue.id, document=document, updated_at=now))
    else:
        whole = with_unknown_fields_of(changes.stored.document, document)
        is_venue = v.id == changes.venue.id
        connection.execute(sa.update(tables.venues).where(is_venue).values(document=whole, updated_at=now))


def _write_revision(connection: sa.Connection, venue_id: str, changes: Changes) -> None:
    newest = changes.after.newest
    if changes.forgets_memories:
        forget_memories(connection, venue_id)
    if newest is not None and newest is not changes.before.newest:
        connection.execute(sa.insert(tables.revisions).values(vars(newest)))
        keep_memories(connection, venue_id, newest.number, changes.memories or {})


def _write_nights(connection: sa.Connection, venue_id: str, changes: Changes) -> None:
    of_venue = sa.delete(tables.camera_trend).where(t.venue == venue_id)
    if changes.last_night is not None:
        connection.execute(of_venue.where(t.revision > changes.last_night))
    if changes.dropped:
        connection.execute(of_venue.where(t.id.in_(changes.dropped)))
    # Nights go with their anchor.
    ended = [
        {"of_camera": camera, "of_anchor": anchor}
        for camera, anchor in changes.before.anchors.keys() - changes.after.anchors
    ]
    if ended:
        is_night = (t.camera == sa.bindparam("of_camera"), t.anchor == sa.bindparam("of_anchor"))
        connection.execute(of_venue.where(*is_night), ended)
    new = [vars(night) for nights in changes.after.nights.values() for night in nights if isinstance(night, NightRow)]
    if new:
        connection.execute(sa.insert(tables.camera_trend), new)


def _write_difference(connection: sa.Connection, table: sa.Table, before: Rows, after: Rows) -> None:
    """Delete, insert and update the rows of a table that differ, by their keys."""
    is_row = [column == sa.bindparam(f"of_{column.name}") for column in table.primary_key]

    def key_of(row: Mapping[str, Any]) -> dict[str, Any]:
        return {f"of_{column.name}": row[column.name] for column in table.primary_key}

    statements: list[tuple[sa.Executable, list[dict[str, Any]]]] = [
        (sa.delete(table).where(*is_row), [key_of(before[key]) for key in before if key not in after]),
        (sa.insert(table), [dict(row) for key, row in after.items() if key not in before]),
        (
            sa.update(table).where(*is_row),
            [{**key_of(row), **row} for key, row in after.items() if key in before and row != before[key]],
        ),
    ]
    for statement, rows in statements:
        if rows:
            connection.execute(statement, rows)


def _write_quality(connection: sa.Connection, venue_id: str, before: QualityRow, after: QualityRow) -> None:
    if after == before:
        return
    of_venue, values = q.venue == venue_id, after.columns()
    is_stored = connection.execute(sa.update(tables.venue_quality).where(of_venue).values(**values)).rowcount > 0
    # Nothing is stored of a venue that was deleted meanwhile.
    if not is_stored and connection.scalar(sa.select(v.id).where(v.id == venue_id)) is not None:
        connection.execute(sa.insert(tables.venue_quality).values(venue=venue_id, **values))
