"""History of venues as revisions, one for every state of their cameras. All SQL about it.

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
from service.schemas.problems import Problem
from service.schemas.venue import Camera, Venue
from service.store import tables
from service.store.actors import actor_in, columns_of
from service.store.documents import Document, to_document
from service.store.events.event_log import add_event
from service.store.statistics.venue_quality import VenueQuality
from service.store.trends import begin_anchors, go_back
from service.store.unreadable import MISSHAPEN, UnreadableRow, read_each, reading_row

r = tables.revisions.c
# Causes of revisions whose poses a calibration found.
CALIBRATION_CAUSES: tuple[Cause, ...] = ("calibrated", "recovered", "accepted")
JOB_CAUSES: tuple[Cause, ...] = (*CALIBRATION_CAUSES, "found")
# Causes of revisions that begin the drift of moved cameras anew.
PLACED_CAUSES: tuple[Cause, ...] = ("put", "found")
FIELD_NUMBERS: tuple[FieldNumber, ...] = get_args(FieldNumber)
NUMBERS_BESIDE_RIDGE: tuple[FieldNumber, ...] = ("length_m", "width_m")
# Newest revisions by which an unreadable venue is tried to be salvaged.
MOST_SALVAGED = 100
# Changes of the field's numbers: the number of a revision, with `NumberChange` by name.
Changes = Sequence[tuple[int, dict[str, dict[str, float]]]]


@dataclass(frozen=True)
class RevisionPage:
    """Page of revisions, newest first, those that cannot be read, and the number before which the next page begins."""

    revisions: list[Revision]
    unreadable: list[Unreadable]
    next_cursor: int | None


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
    """Add the present state of a venue as a revision, inside the caller's serialised transaction; return its number.

    `field_before`: the field before a revision that changes its numbers, so that undoing the revision restores them.
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
    """Return the revision in use, inside the caller's transaction."""
    row = _newest_row(connection, venue_id)
    return None if row is None else _revision(row)


def newest_known(connection: sa.Connection, quality: VenueQuality) -> Revision | None:
    """Return the revision in use, read once in a transaction."""
    row = _newest_row_by(connection, quality)
    return None if row is None else _revision(row)


def revision_at(connection: sa.Connection, venue_id: str, number: int) -> datetime:
    """Return the time of a revision, or of the oldest after it that is kept."""
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
    """Yield the document of a venue with poses, lenses and ridge of each revision that fits it, newest first."""
    query = sa.select(r.cameras, r.ridge).where(r.venue == venue_id).order_by(r.number.desc()).limit(MOST_SALVAGED)
    for row in connection.execute(query):
        with suppress(*MISSHAPEN):
            then = {
                camera["id"]: {"pose": camera["pose"], "intrinsics": camera["intrinsics"]} for camera in row.cameras
            }
            cameras = [camera | then[camera["id"]] for camera in document["cameras"]]
            yield document | {"cameras": cameras, "field": document["field"] | {"ridge": row.ridge}}


def origin_of(connection: sa.Connection, venue_id: str, revision: Revision) -> Revision:
    """Return the revision that a restored one goes back to, through any number of restorations.

    Any other revision is its own origin. The oldest restoration that is kept stands for an origin that has expired.
    """
    while revision.restored_from is not None:
        restored = revisions_of(connection, venue_id, revision.restored_from + 1, 1).revisions
        if not restored or restored[0].revision != revision.restored_from:
            break
        revision = restored[0]
    return revision


def revision_of_job(connection: sa.Connection, job_id: str) -> int | None:
    """Return the number of the last revision with the poses of a job, None if there is none."""
    query = sa.select(sa.func.max(r.number)).where(r.job == job_id, r.cause.in_(CALIBRATION_CAUSES))
    number: int | None = connection.scalar(query)
    return number


def revisions_of_jobs(connection: sa.Connection, job_ids: Collection[str]) -> dict[str, int]:
    """Return by job the number of the last revision with its poses, without jobs that have none."""
    if not job_ids:
        return {}
    newest = sa.func.max(r.number).label("newest")
    query = sa.select(r.job, newest).where(r.job.in_(job_ids), r.cause.in_(JOB_CAUSES)).group_by(r.job)
    return {row.job: row.newest for row in connection.execute(query)}


def revision_before(connection: sa.Connection, venue_id: str, job_id: str) -> int:
    """Return the number of the last revision that does not have the poses of a job."""
    of_job = sa.and_(sa.func.coalesce(r.job, "") == job_id, r.cause.in_(CALIBRATION_CAUSES))
    number: int = connection.execute(
        sa.select(sa.func.max(r.number)).where(r.venue == venue_id, sa.not_(of_job))
    ).scalar_one()
    return number


def state_at(connection: sa.Connection, venue: Venue, number: int) -> tuple[Venue, Revision]:
    """Return a venue as it was at a revision, and that revision.

    Raises the problems `revision-not-found` and `revision-unfit`.
    """
    row = connection.execute(sa.select(tables.revisions).where(r.venue == venue.id, r.number == number)).one_or_none()
    if row is None:
        raise Problem("revision-not-found", f"GET /venues/{venue.id}/history lists those there are.")
    return _state_of(venue, row, _changes_of_numbers(connection, venue.id)), _revision(row)


def revisions_that_fit(connection: sa.Connection, venue: Venue, numbers: Collection[int]) -> set[int]:
    """Return those of some revisions of a venue that it can be restored to."""
    rows = connection.execute(sa.select(tables.revisions).where(r.venue == venue.id, r.number.in_(numbers)))
    changes = _changes_of_numbers(connection, venue.id)
    return {row.number for row in rows if _fits(venue, row, changes)}


def _fits(venue: Venue, row: Any, changes: Changes) -> bool:
    try:
        _state_of(venue, row, changes)
    except (Problem, UnreadableRow):
        return False
    return True


def _state_of(venue: Venue, row: Any, changes: Changes) -> Venue:
    cameras = list(_cameras(row).values())
    then, now = ({camera.id: camera.image_size for camera in some} for some in (cameras, venue.cameras))
    if then != now:
        raise _unfit(f"It has the cameras {_in_words(then)}, and the venue now has {_in_words(now)}.")
    try:
        return _with_state(venue, cameras, row.ridge, _numbers_at(venue.field, row.number, changes))
    except ValueError:
        raise _unfit("Its ridge is none of the pitch that the venue now has.") from None


def _unfit(why: str) -> Problem:
    return Problem("revision-unfit", f"{why} PUT the venue with the poses that you want.")


def _number_changes(before: FieldOfPlay, after: FieldOfPlay) -> dict[str, dict[str, float]]:
    """Return the numbers of a field that differ from those before, as `schemas.history.NumberChange` by name."""
    numbers = {name: {"before": before.number(name), "after": after.number(name)} for name in FIELD_NUMBERS}
    return {name: number for name, number in numbers.items() if number["before"] != number["after"]}


def _changes_of_numbers(connection: sa.Connection, venue_id: str) -> Changes:
    """Return the changes of the field's numbers by revisions of a venue, oldest first."""
    query = sa.select(r.number, r.field_numbers).where(r.venue == venue_id, r.field_numbers.is_not(None))
    return [(row.number, row.field_numbers) for row in connection.execute(query.order_by(r.number))]


def _numbers_at(field: FieldOfPlay, revision: int, changes: Changes) -> dict[str, float]:
    """Return length and width of the field at a revision, if later revisions have changed them.

    A number that a person has put since stays as it was put. The ridge is kept with every revision.
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
    """Return a venue with the poses and lenses of another time, and with the ridge and numbers that belong to them."""
    then = {camera.id: camera for camera in cameras}
    restored = [
        camera.model_copy(
            update={
                "pose": then[camera.id].pose,
                "intrinsics": then[camera.id].intrinsics.with_sigma_of(camera.intrinsics),
            }
        )
        for camera in venue.cameras
    ]
    field = FieldOfPlay.model_validate(venue.field.model_dump() | numbers | {"ridge": ridge})
    return venue.model_copy(update={"cameras": restored, "field": field})


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
    """Return the cameras whose pose or lens has changed."""
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
    """Return the cameras of a revision; empty without one, or if it cannot be read, so that changes go on."""
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
