"""The history of venues: every state that their cameras were in. All SQL about it.

A revision is written in the transaction that changes the venue, with how far each camera moved: reading a year of drift
computes nothing.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from datetime import datetime
from typing import Any, get_args

import sqlalchemy as sa

from service.schemas.actor import Actor
from service.schemas.base import TOLERANTLY, Unreadable
from service.schemas.events.venue_event import Poses
from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Movement, PosedCamera
from service.schemas.history import Cause, Revision
from service.schemas.names import FieldNumber
from service.schemas.venue import Camera, Venue
from service.store import tables
from service.store.actors import actor_in, columns_of
from service.store.documents import Document, to_document
from service.store.events.event_log import add_event
from service.store.statistics.venue_quality import VenueQuality
from service.store.trends import begin_anchors, go_back
from service.store.unreadable import MISSHAPEN, UnreadableRow, read_each, reading_row

r = tables.revisions.c
# Whose poses hold, or held.
CALIBRATION_CAUSES: tuple[Cause, ...] = ("calibrated", "recovered", "accepted")
JOB_CAUSES: tuple[Cause, ...] = (*CALIBRATION_CAUSES, "found")
# By which cameras stand anew, whatever they did before.
PLACED_CAUSES: tuple[Cause, ...] = ("put", "found")
FIELD_NUMBERS: tuple[FieldNumber, ...] = get_args(FieldNumber)
NUMBERS_BESIDE_RIDGE: tuple[FieldNumber, ...] = ("length_m", "width_m")
# Revisions that are tried, the newest: more are read only for a person who asks.
MOST_SALVAGED = 100
# Numbers of a field that revisions have changed: `NumberChange` by name, with the number of the revision.
Changes = Sequence[tuple[int, dict[str, dict[str, float]]]]


@dataclass(frozen=True)
class RevisionPage:
    """Revisions of a page, newest first, those that cannot be read, and the number that the next page is before."""

    revisions: list[Revision]
    unreadable: list[Unreadable]
    next_cursor: int | None


class NoSuchRevision(Exception):  # noqa: N818
    """The venue never had one of this number."""


class RevisionUnfit(Exception):  # noqa: N818
    """The venue is no longer one that the revision fits; the message says why."""


def add_revision(
    connection: sa.Connection,
    quality: VenueQuality,
    venue: Venue,
    cause: Cause,
    job: str | None = None,
    restored: Revision | None = None,
    stitch_error_px: float | None = None,
    by: Actor | None = None,
    field_before: FieldOfPlay | None = None,
) -> int:
    """Write down the state that a venue has now, inside the caller's serialised transaction.

    `field_before`: of a revision that changes numbers of the field, the field without that change; undoing the revision
    gives them back. Gives the number of the revision.
    """
    before, at = _newest_row_by(connection, quality), quality.now
    number = 1 if before is None else before.number + 1
    last = _cameras_or_none(before)
    movements = _movements(connection, venue, number, before, last, cause, restored)
    row = {
        "venue": venue.id,
        "number": number,
        "at": at,
        "cause": cause,
        "job": job,
        "restored_from": None if restored is None else restored.revision,
        "stitch_error_px": stitch_error_px,
        "cameras": [to_document(camera.posed) for camera in venue.cameras],
        "ridge": venue.field.ridge,
        "field_numbers": _number_changes(field_before or venue.field, venue.field) or None,
        "movements": {camera: movement.model_dump() for camera, movement in movements.items()},
        **columns_of(by),
    }
    inserted = sa.insert(tables.revisions).values(**row).returning(tables.revisions)
    quality.newest_revision = connection.execute(inserted).one()
    changed = _changed(venue, last)
    if restored is not None:
        go_back(connection, venue, restored.revision)
    elif cause in (*PLACED_CAUSES, "adopted"):
        begin_anchors(connection, venue, changed, number)
    poses = Poses(
        venue=venue.id,
        revision=number,
        cause=cause,
        job=job,
        stitch_error_px=stitch_error_px,
        ridge=venue.field.ridge,
        cameras=[camera.posed for camera in venue.cameras],
        changed=changed,
    )
    add_event(connection, venue.id, venue.webhooks, "poses.changed", poses, at, by)
    drifts = [movement.drift.pixels for movement in movements.values() if movement.drift]
    quality.row.drift_px = max((drift for drift in drifts if drift is not None), default=None)
    return number


def newest_revision(connection: sa.Connection, venue_id: str) -> Revision | None:
    """The one that holds, inside the caller's transaction."""
    row = _newest_row(connection, venue_id)
    return None if row is None else _revision(row)


def newest_known(connection: sa.Connection, quality: VenueQuality) -> Revision | None:
    """The one that holds, read once in a transaction."""
    row = _newest_row_by(connection, quality)
    return None if row is None else _revision(row)


def revision_at(connection: sa.Connection, venue_id: str, number: int) -> datetime:
    """When a revision came, or the oldest after it that is kept; the first one came with the venue."""
    query = sa.select(r.at).where(r.venue == venue_id, r.number >= number).order_by(r.number).limit(1)
    at: datetime = connection.execute(query).scalar_one()
    return at


def revisions_of(connection: sa.Connection, venue_id: str, before: int | None, limit: int) -> RevisionPage:
    """Return up to `limit` revisions, newest first, those before number `before`."""
    query = sa.select(tables.revisions).where(r.venue == venue_id).order_by(r.number.desc()).limit(limit + 1)
    if before is not None:
        query = query.where(r.number < before)
    rows = connection.execute(query).all()
    revisions, unreadable = read_each(rows[:limit], _revision)
    return RevisionPage(revisions, unreadable, rows[limit - 1].number if len(rows) > limit else None)


def documents_as_of_revisions(connection: sa.Connection, venue_id: str, document: Any) -> Iterator[Document]:
    """Yield the document of a venue with the poses, lenses and ridge of its revisions, the newest first.

    Revisions that do not go with it are passed over.
    """
    query = sa.select(r.cameras, r.ridge).where(r.venue == venue_id).order_by(r.number.desc()).limit(MOST_SALVAGED)
    for row in connection.execute(query):
        with suppress(*MISSHAPEN):
            then = {
                camera["id"]: {"pose": camera["pose"], "intrinsics": camera["intrinsics"]} for camera in row.cameras
            }
            cameras = [camera | then[camera["id"]] for camera in document["cameras"]]
            yield document | {"cameras": cameras, "field": document["field"] | {"ridge": row.ridge}}


def origin_of(connection: sa.Connection, venue_id: str, revision: Revision) -> Revision:
    """Return the revision that was put back, through any number of restorations; any other revision is its own origin.

    Of one that has expired its last restoration stands for it.
    """
    while revision.restored_from is not None:
        restored = revisions_of(connection, venue_id, revision.restored_from + 1, 1).revisions
        if not restored or restored[0].revision != revision.restored_from:
            break
        revision = restored[0]
    return revision


def revision_of_job(connection: sa.Connection, job_id: str) -> int | None:
    """The number of the revision that a job's poses became last."""
    query = sa.select(sa.func.max(r.number)).where(r.job == job_id, r.cause.in_(CALIBRATION_CAUSES))
    number: int | None = connection.scalar(query)
    return number


def revisions_of_jobs(connection: sa.Connection, job_ids: Collection[str]) -> dict[str, int]:
    """The numbers of the revisions that the poses of jobs became last, of those whose poses did."""
    if not job_ids:
        return {}
    newest = sa.func.max(r.number).label("newest")
    query = sa.select(r.job, newest).where(r.job.in_(job_ids), r.cause.in_(JOB_CAUSES)).group_by(r.job)
    return {row.job: row.newest for row in connection.execute(query)}


def revision_before(connection: sa.Connection, venue_id: str, job_id: str) -> int:
    """The number of the last revision that is not a job's, or that gave its poses back."""
    of_job = sa.and_(sa.func.coalesce(r.job, "") == job_id, r.cause.in_(CALIBRATION_CAUSES))
    number: int = connection.execute(
        sa.select(sa.func.max(r.number)).where(r.venue == venue_id, sa.not_(of_job))
    ).scalar_one()
    return number


def state_at(connection: sa.Connection, venue: Venue, number: int) -> tuple[Venue, Revision]:
    """A venue as it was at a revision, and that revision. Raises where there is none or it does not fit any more."""
    row = connection.execute(sa.select(tables.revisions).where(r.venue == venue.id, r.number == number)).one_or_none()
    if row is None:
        raise NoSuchRevision
    return _state_of(venue, row, _changes_of_numbers(connection, venue.id)), _revision(row)


def revisions_that_fit(connection: sa.Connection, venue: Venue, numbers: Collection[int]) -> set[int]:
    """Those of a venue's revisions that it can be put back to."""
    rows = connection.execute(sa.select(tables.revisions).where(r.venue == venue.id, r.number.in_(numbers)))
    changes = _changes_of_numbers(connection, venue.id)
    return {row.number for row in rows if _fits(venue, row, changes)}


def _fits(venue: Venue, row: Any, changes: Changes) -> bool:
    try:
        _state_of(venue, row, changes)
    except (RevisionUnfit, UnreadableRow):
        return False
    return True


def _state_of(venue: Venue, row: Any, changes: Changes) -> Venue:
    cameras = list(_cameras(row).values())
    then, now = ({camera.id: camera.image_size for camera in some} for some in (cameras, venue.cameras))
    if then != now:
        raise RevisionUnfit(f"It has the cameras {_in_words(then)}, and the venue now has {_in_words(now)}.")
    try:
        return _with_state(venue, cameras, row.ridge, _numbers_at(venue.field, row.number, changes))
    except ValueError:
        raise RevisionUnfit("Its ridge is none of the pitch that the venue now has.") from None


def _number_changes(before: FieldOfPlay, after: FieldOfPlay) -> dict[str, dict[str, float]]:
    """The numbers of a field that differ from those before, as `schemas.history.NumberChange` by name."""
    numbers = {name: {"before": before.number(name), "after": after.number(name)} for name in FIELD_NUMBERS}
    return {name: number for name, number in numbers.items() if number["before"] != number["after"]}


def _changes_of_numbers(connection: sa.Connection, venue_id: str) -> Changes:
    """The changes of numbers of the field that came with revisions, each with its revision, oldest first."""
    query = sa.select(r.number, r.field_numbers).where(r.venue == venue_id, r.field_numbers.is_not(None))
    return [(row.number, row.field_numbers) for row in connection.execute(query.order_by(r.number))]


def _numbers_at(field: FieldOfPlay, revision: int, changes: Changes) -> dict[str, float]:
    """What length and width were at a revision, of those that revisions have changed since.

    One that somebody has put since is as that person says, at any time. The ridge is kept with every revision.
    """
    numbers: dict[str, float] = {}
    for name in NUMBERS_BESIDE_RIDGE:
        since = [change[name] for number, change in changes if number > revision and name in change]
        if since and field.number(name) == since[-1]["after"]:
            numbers[name] = since[0]["before"]
    return numbers


def _with_state(
    venue: Venue, cameras: list[PosedCamera], ridge: list[list[float]] | None, numbers: dict[str, float]
) -> Venue:
    """The same venue with the poses and lenses of another time, and the ridge and numbers that they belong to."""
    then = {camera.id: camera for camera in cameras}
    back = [
        camera.model_copy(
            update={
                "pose": then[camera.id].pose,
                "intrinsics": then[camera.id].intrinsics.with_sigma_of(camera.intrinsics),
            }
        )
        for camera in venue.cameras
    ]
    field = FieldOfPlay.model_validate(venue.field.model_dump() | numbers | {"ridge": ridge})
    return venue.model_copy(update={"cameras": back, "field": field})


def _movements(
    connection: sa.Connection,
    venue: Venue,
    number: int,
    before: Any,
    last: dict[str, PosedCamera],
    cause: Cause,
    restored: Revision | None,
) -> dict[str, Movement]:
    since = {camera: before.movements[camera]["drift_since"] for camera in last}
    if restored is not None:
        since = {camera.id: camera.drift_since for camera in restored.cameras}
    for camera in venue.cameras:
        previous = last.get(camera.id)
        replaced = previous is None or previous.pose_and_lens != camera.posed.pose_and_lens
        if camera.id not in since or (cause in PLACED_CAUSES and replaced):
            since[camera.id] = number
    firsts = {first: _cameras_at(connection, venue.id, first) for first in set(since.values()) - {number}}
    return {
        camera.id: _movement(venue, camera, last.get(camera.id), firsts.get(since[camera.id], {}), since[camera.id])
        for camera in venue.cameras
    }


def _changed(venue: Venue, before: dict[str, PosedCamera]) -> list[str]:
    """The cameras that stand or image otherwise than they did."""
    return [
        camera.id
        for camera in venue.cameras
        if camera.id not in before or before[camera.id].pose_and_lens != camera.posed.pose_and_lens
    ]


def _movement(
    venue: Venue, camera: Camera, last: PosedCamera | None, firsts: dict[str, PosedCamera], since: int
) -> Movement:
    # Loads OpenCV, for which neither a command nor the start of a service waits.
    from service.store.movement import moved

    def from_there(then: PosedCamera | None) -> Any:
        return None if then is None else moved(venue.field, then, camera)

    return Movement(moved=from_there(last), drift=from_there(firsts.get(camera.id, camera)), drift_since=since)


def _newest_row_by(connection: sa.Connection, quality: VenueQuality) -> Any:
    if quality.newest_revision is None:
        quality.newest_revision = _newest_row(connection, quality.venue_id)
    return quality.newest_revision


def _newest_row(connection: sa.Connection, venue_id: str | None) -> Any:
    query = sa.select(tables.revisions).where(r.venue == venue_id).order_by(r.number.desc()).limit(1)
    return connection.execute(query).one_or_none()


def _cameras_at(connection: sa.Connection, venue_id: str, number: int) -> dict[str, PosedCamera]:
    query = sa.select(tables.revisions).where(r.venue == venue_id, r.number == number)
    return _cameras_or_none(connection.execute(query).one_or_none())


def _cameras_or_none(row: Any) -> dict[str, PosedCamera]:
    """Return how the cameras stood at a revision, {} where there is none or it cannot be read: what comes goes on."""
    try:
        return {} if row is None else _cameras(row)
    except UnreadableRow:
        return {}


def _cameras(row: Any) -> dict[str, PosedCamera]:
    with _reading(row):
        cameras = [PosedCamera.model_validate(camera, **TOLERANTLY) for camera in row.cameras]
        for camera in cameras:
            Movement.model_validate(row.movements[camera.id], **TOLERANTLY)
        return {camera.id: camera for camera in cameras}


def _reading(row: Any) -> AbstractContextManager[None]:
    return reading_row("revision", f"{row.venue}/{row.number}")


def _revision(row: Any) -> Revision:
    with _reading(row):
        return Revision.model_validate(_revision_values(row), **TOLERANTLY)


def _revision_values(row: Any) -> dict[str, Any]:
    names = ("at", "cause", "job", "restored_from", "stitch_error_px", "ridge")
    cameras = [{"id": camera["id"], "pose": camera["pose"], **row.movements[camera["id"]]} for camera in row.cameras]
    values = {
        "revision": row.number,
        "cameras": cameras,
        "by": actor_in(row),
        "field_numbers": row.field_numbers or {},
    }
    return values | {name: getattr(row, name) for name in names}


def _in_words(sizes: dict[str, list[int]]) -> str:
    return ", ".join(f"{camera} ({width}x{height})" for camera, (width, height) in sizes.items())
