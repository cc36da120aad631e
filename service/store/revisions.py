"""History of venues as revisions, one for every state of their cameras: its pages, and how a venue was at one."""

from collections.abc import Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, get_args

import sqlalchemy as sa

from service.schemas.base import Unreadable
from service.schemas.field import FieldOfPlay
from service.schemas.geometry import PosedCamera
from service.schemas.history import Cause, Revision
from service.schemas.names import FieldNumber
from service.schemas.problems import Problem
from service.schemas.venue import Venue
from service.store import tables
from service.store.documents import Document
from service.store.unreadable import MISSHAPEN, UnreadableRow, read_each
from service.store.venue_state import RevisionRow, newest_revision_row, revision_rows

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
NumberChanges = Sequence[tuple[int, dict[str, dict[str, float]]]]


@dataclass(frozen=True)
class RevisionPage:
    """Page of revisions, newest first, those that cannot be read, and the number before which the next page begins."""

    revisions: list[Revision]
    unreadable: list[Unreadable]
    next_cursor: int | None


def newest_revision(connection: sa.Connection, venue_id: str) -> Revision | None:
    """Return the revision in use, inside the caller's transaction."""
    row = newest_revision_row(connection, venue_id)
    return None if row is None else row.revision()


def revisions_of(connection: sa.Connection, venue_id: str, before: int | None, limit: int) -> RevisionPage:
    """Return up to `limit` revisions, newest first, those before number `before`."""
    earlier = [] if before is None else [r.number < before]
    rows = revision_rows(connection, r.venue == venue_id, *earlier, limit=limit + 1)
    revisions, unreadable = read_each(rows[:limit], RevisionRow.revision)
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
    rows = revision_rows(connection, r.venue == venue.id, r.number == number)
    if not rows:
        raise Problem("revision-not-found", f"GET /venues/{venue.id}/history lists those there are.")
    return _state_of(venue, rows[0], _changes_of_numbers(connection, venue.id)), rows[0].revision()


def revisions_that_fit(connection: sa.Connection, venue: Venue, numbers: Collection[int]) -> set[int]:
    """Return those of some revisions of a venue that it can be restored to."""
    rows = revision_rows(connection, r.venue == venue.id, r.number.in_(numbers))
    changes = _changes_of_numbers(connection, venue.id)
    return {row.number for row in rows if _fits(venue, row, changes)}


def _fits(venue: Venue, row: RevisionRow, changes: NumberChanges) -> bool:
    try:
        _state_of(venue, row, changes)
    except (Problem, UnreadableRow):
        return False
    return True


def _state_of(venue: Venue, row: RevisionRow, changes: NumberChanges) -> Venue:
    cameras = list(row.posed().values())
    then, now = ({camera.id: camera.image_size for camera in some} for some in (cameras, venue.cameras))
    if then != now:
        raise _unfit(f"It has the cameras {_in_words(then)}, and the venue now has {_in_words(now)}.")
    try:
        return _with_state(venue, cameras, row.ridge, _numbers_at(venue.field, row.number, changes))
    except ValueError:
        raise _unfit("Its ridge is none of the pitch that the venue now has.") from None


def _unfit(why: str) -> Problem:
    return Problem("revision-unfit", f"{why} PUT the venue with the poses that you want.")


def _changes_of_numbers(connection: sa.Connection, venue_id: str) -> NumberChanges:
    """Return the changes of the field's numbers by revisions of a venue, oldest first."""
    query = sa.select(r.number, r.field_numbers).where(r.venue == venue_id, r.field_numbers.is_not(None))
    return [(row.number, row.field_numbers) for row in connection.execute(query.order_by(r.number))]


def _numbers_at(field: FieldOfPlay, revision: int, changes: NumberChanges) -> dict[str, float]:
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
    now = {camera.id: camera.intrinsics for camera in venue.cameras}
    then = {
        camera.id: {"pose": camera.pose, "intrinsics": camera.intrinsics.with_sigma_of(now[camera.id])}
        for camera in cameras
    }
    return venue.with_cameras(then, field=venue.field.changed({**numbers, "ridge": ridge}))


def _in_words(sizes: dict[str, list[int]]) -> str:
    return ", ".join(f"{camera} ({width}x{height})" for camera, (width, height) in sizes.items())
