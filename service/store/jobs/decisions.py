"""What people decide about jobs: that they end, that their poses hold after all, or that they do not."""

from __future__ import annotations

from collections.abc import Collection

import sqlalchemy as sa

from service.store import tables
from service.store.alarms import settle_alarms
from service.store.counts.figures import note_quality
from service.store.engine import Repository, clock, serialise, writing
from service.store.jobs.ending import changed, end, still_open
from service.store.jobs.reading import found_poses
from service.store.memories import Memories, newest_memories
from service.store.revisions import TAKEN, newest_revision, revision_before, revision_of_job
from service.store.trends import note_night
from service.store.venues import find_venue, let_hold, put_back, venue_lock, with_result
from service.wire.history import Revision
from service.wire.results import Result
from service.wire.venue import Venue

j = tables.jobs.c


class NoPoses(Exception):  # noqa: N818
    """The job is no calibration that found poses (yet)."""


class MovedOn(Exception):  # noqa: N818
    """The venue is not as the job left or found it: to decide about the job would undo other changes."""

    def __init__(self, newest: Revision | None) -> None:
        self.newest = newest


class Decisions(Repository):
    """The decisions about the jobs in the database."""

    def cancel(self, job_id: str) -> None:
        """End a job that is still open; its worker notices."""
        with writing(self._engine) as connection:
            venue_id = connection.scalar(sa.select(j.venue).where(j.id == job_id))
            if venue_id is not None:
                serialise(connection, venue_lock(venue_id))
            end(connection, job_id, still_open(job_id), "cancelled")

    def accept(self, job_id: str, cameras: Collection[str] | None = None) -> None:
        """Let the poses that a calibration found hold, whatever the gate said.

        If they hold by themselves, a person now says so too: the trends of the cameras begin anew with them.
        `cameras`: only theirs, None: those of all. Raises `MovedOn` if the venue is neither as the calibration began
        with it nor as it left it, `NoPoses` if it found none.
        """
        with writing(self._engine) as connection:
            began_with, result, newest = _found(connection, job_id)
            chosen = list(began_with.poses) if cameras is None else cameras
            now_stored = find_venue(connection, began_with.id)
            left_by_it = newest is not None and newest.job == job_id and newest.cause in TAKEN
            if now_stored and newest and left_by_it and with_result(now_stored, result, chosen).stands_like(now_stored):
                found = [camera for camera in result.cameras if camera.id in chosen]
                note_night(connection, now_stored, found, job_id, newest.revision, by_hand=True)
                settle_alarms(connection, now_stored)
                return
            untouched = _lies_between if left_by_it else _is_as_it_was
            if now_stored is None or not untouched(now_stored, began_with, result):
                raise MovedOn(newest)
            note_quality(connection, began_with.id, result, moved=True)
            memories = newest_memories(connection, began_with.id)
            let_hold(
                connection, now_stored, result, chosen, "accepted", job_id, _without_refused(memories, result, chosen)
            )
            _touch(connection, job_id)

    def reject(self, job_id: str) -> None:
        """Put back what was before a calibration's poses held; nothing to do if they never did or were put back.

        Raises `MovedOn` if something else has come since, `NoPoses` if it found none.
        """
        with writing(self._engine) as connection:
            began_with, _, newest = _found(connection, job_id)
            if newest is None or revision_of_job(connection, job_id) is None:
                return
            if newest.job != job_id or newest.cause == "adopted":
                raise MovedOn(newest)
            if newest.cause in TAKEN:
                now_stored = find_venue(connection, began_with.id)
                assert now_stored is not None
                before = revision_before(connection, now_stored.id, job_id)
                settle_alarms(connection, put_back(connection, now_stored, before, rejected_job=job_id))
                _touch(connection, job_id)


def _found(connection: sa.Connection, job_id: str) -> tuple[Venue, Result, Revision | None]:
    """What a calibration began with and what it found, and the revision that its venue is at, which stays."""
    found = found_poses(connection, job_id)
    if found is None:
        raise NoPoses
    began_with, result = found
    serialise(connection, venue_lock(began_with.id))
    return began_with, result, newest_revision(connection, began_with.id)


def _is_as_it_was(now_stored: Venue, began_with: Venue, _: Result) -> bool:
    """Whether a calibration would begin with the same again."""
    return now_stored.calibrates_like(began_with)


def _lies_between(now_stored: Venue, began_with: Venue, result: Result) -> bool:
    """Whether each camera stands where a calibration began with it or where it found it, and all else is the same."""
    found = with_result(began_with, result)
    return (
        now_stored.field in (began_with.field, found.field)
        and now_stored.poses.keys() == began_with.poses.keys()
        and all(
            now in ways for now, *ways in zip(now_stored.standing, began_with.standing, found.standing, strict=True)
        )
    )


def _without_refused(memories: Memories, result: Result, chosen: Collection[str]) -> Memories:
    """The memories but for those of chosen cameras whose poses the gate refused.

    Somebody says that these stand otherwise than their nights have it: the next job begins their memories anew.
    """
    anew = set(chosen) - set(result.accepted_cameras)
    return {camera: memory for camera, memory in memories.items() if camera not in anew}


def _touch(connection: sa.Connection, job_id: str) -> None:
    connection.execute(sa.update(tables.jobs).where(j.id == job_id).values(**changed(clock(connection))))
