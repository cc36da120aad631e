"""What people decide about jobs: that they end, that their poses hold after all, or that they do not."""

from __future__ import annotations

import sqlalchemy as sa

from service.store import tables
from service.store.alarms import settle_alarms
from service.store.counts.figures import note_quality
from service.store.engine import Repository, clock, serialise, writing
from service.store.jobs.ending import changed, end, still_open
from service.store.jobs.reading import found_poses
from service.store.revisions import TAKEN, newest_revision, revision_of_job
from service.store.venues import find_venue, let_hold, put_back, venue_lock
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
            end(connection, job_id, still_open(job_id), "cancelled")

    def accept(self, job_id: str) -> None:
        """Let the poses that a calibration found hold, whatever the gate said; nothing to do if they do.

        Raises `MovedOn` if the venue is not the one that the calibration began with, `NoPoses` if it found none.
        """
        with writing(self._engine) as connection:
            began_with, result, newest = _found(connection, job_id)
            if newest is not None and newest.job == job_id and newest.cause in TAKEN:
                return
            now_stored = find_venue(connection, began_with.id)
            if now_stored is None or not now_stored.calibrates_like(began_with):
                raise MovedOn(newest)
            note_quality(connection, began_with.id, result, clock(connection), moved=True)
            let_hold(connection, now_stored, result, "accepted", job_id)
            _touch(connection, job_id)

    def reject(self, job_id: str) -> None:
        """Put back what was before a calibration's poses held; nothing to do if they never did or were put back.

        Raises `MovedOn` if something else has come since, `NoPoses` if it found none.
        """
        with writing(self._engine) as connection:
            began_with, _, newest = _found(connection, job_id)
            if newest is None or revision_of_job(connection, job_id) is None:
                return
            if newest.job != job_id:
                raise MovedOn(newest)
            if newest.cause in TAKEN:
                now_stored = find_venue(connection, began_with.id)
                assert now_stored is not None
                settle_alarms(connection, put_back(connection, now_stored, newest.revision - 1, rejected_job=job_id))
                _touch(connection, job_id)


def _found(connection: sa.Connection, job_id: str) -> tuple[Venue, Result, Revision | None]:
    """What a calibration began with and what it found, and the revision that its venue is at, which stays."""
    found = found_poses(connection, job_id)
    if found is None:
        raise NoPoses
    began_with, result = found
    serialise(connection, venue_lock(began_with.id))
    return began_with, result, newest_revision(connection, began_with.id)


def _touch(connection: sa.Connection, job_id: str) -> None:
    connection.execute(sa.update(tables.jobs).where(j.id == job_id).values(**changed(clock(connection))))
