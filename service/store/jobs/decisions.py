"""Decisions of people about jobs: cancel one, accept its poses after all, or reject them."""

from collections.abc import Collection
from dataclasses import dataclass

import sqlalchemy as sa

from service.schemas.actor import Actor
from service.schemas.history import Revision
from service.schemas.results import Result
from service.schemas.venue import Venue
from service.store import tables
from service.store.alarms import with_alarms
from service.store.database import Repository, clock, lock_venue, reading, writing
from service.store.jobs.ending import End, changed, end_job, still_open
from service.store.jobs.queries import found_poses, read_job
from service.store.memories import Memories, newest_memories
from service.store.refusals import nothing_to_decide, venue_moved_on
from service.store.revisions import CALIBRATION_CAUSES, newest_revision, revision_before, revision_of_job
from service.store.venue_fold import faults_of, with_calibration, with_night, with_result, with_result_in_use
from service.store.venue_state import load, write_changes
from service.store.venues import find_readable, find_replaceable, find_stored, restore_state

j = tables.jobs.c


@dataclass(frozen=True)
class OpenDecisions:
    """The decisions about a calibration that are still possible.

    `accept`: the cameras whose stored pose differs from the found one and can be replaced; `reject`: True if its poses
    are in use and can be undone; `is_outdated`: True if nothing is possible since the venue was changed.
    """

    accept: frozenset[str]
    reject: bool
    is_outdated: bool = False


class DecisionRepository(Repository):
    """The decisions about the jobs in the database."""

    def decidable(self, job_id: str) -> OpenDecisions:
        """Return what `accept` and `reject` would not refuse now."""
        with reading(self._engine) as connection:
            found = found_poses(connection, job_id)
            if found is None:
                return OpenDecisions(frozenset(), reject=False)
            began_with, result = found
            newest = newest_revision(connection, began_with.id)
            taken, venue = _was_taken(job_id, newest), find_readable(connection, began_with.id)
            if venue is None:
                return OpenDecisions(frozenset(), reject=taken)
            if not _is_untouched(venue, began_with, result, taken=taken):
                return OpenDecisions(frozenset(), taken, is_outdated=not taken)
            refused_for = faults_of(with_result(venue, result))
            return OpenDecisions(frozenset() if refused_for else _not_taken(venue, result), reject=taken)

    def cancel(self, job_id: str, by: Actor | None = None) -> None:
        """End a job that is still open; its worker notices."""
        with writing(self._engine) as connection:
            end_job(connection, job_id, still_open(job_id), End("cancelled", by=by))

    def accept(self, job_id: str, cameras: Collection[str] | None = None, by: Actor | None = None) -> None:
        """Let the poses that a calibration found hold, whatever the gate said.

        If they hold by themselves, a person now says so too: the trends of the cameras begin anew with them.
        `cameras`: only theirs, None: those of all. Raises the problems `venue-moved-on` if the venue is neither as the
        calibration began with it nor as it left it, `poses-not-found`, and `poses-refused` if no venue can have them.
        """
        with writing(self._engine) as connection:
            began_with, result, newest = _found(connection, job_id)
            chosen = list(began_with.poses) if cameras is None else cameras
            stored = find_stored(connection, began_with.id)
            now_stored = None if stored is None else stored.venue
            left_by_it = _was_taken(job_id, newest)
            changes = load(connection, began_with.id, chosen)
            if now_stored and left_by_it and with_result(now_stored, result, chosen).has_same_poses_as(now_stored):
                changes = with_night(changes, now_stored, result, chosen, job_id, by_hand=True)
                write_changes(connection, with_alarms(changes, now_stored))
                return
            if stored is None or not _is_untouched(stored.venue, began_with, result, taken=left_by_it):
                raise venue_moved_on(began_with.id, job_id, newest)
            memories = _without_refused(newest_memories(connection, began_with.id), result, chosen)
            changes = with_calibration(changes, result, moved=True)
            changes = with_result_in_use(changes, stored, result, chosen, "accepted", job_id, memories, by)
            _touch(connection, job_id)
            write_changes(connection, changes)

    def reject(self, job_id: str, by: Actor | None = None) -> None:
        """Put back what was before a calibration's poses held; nothing to do if they never did or were put back.

        Raises the problems `venue-moved-on` if something else has come since, and `poses-not-found`.
        """
        with writing(self._engine) as connection:
            began_with, _, newest = _found(connection, job_id)
            if newest is None or revision_of_job(connection, job_id) is None:
                return
            if newest.job != job_id or newest.cause == "adopted":
                raise venue_moved_on(began_with.id, job_id, newest)
            if newest.cause in CALIBRATION_CAUSES:
                stored = find_replaceable(connection, began_with.id)
                assert stored is not None
                before = revision_before(connection, began_with.id, job_id)
                _touch(connection, job_id)
                restore_state(connection, stored, before, by, job_id)


def _found(connection: sa.Connection, job_id: str) -> tuple[Venue, Result, Revision | None]:
    """Return the input and result of a calibration, and the newest revision of its venue, which is locked."""
    found = found_poses(connection, job_id)
    if found is None:
        raise nothing_to_decide(read_job(connection, job_id))
    began_with, result = found
    lock_venue(connection, began_with.id)
    return began_with, result, newest_revision(connection, began_with.id)


def _was_taken(job_id: str, newest: Revision | None) -> bool:
    """True if the poses in use are those of a job."""
    return newest is not None and newest.job == job_id and newest.cause in CALIBRATION_CAUSES


def _is_untouched(now_stored: Venue, began_with: Venue, result: Result, *, taken: bool) -> bool:
    """True if nothing but a calibration itself, if its poses were `taken`, has changed a venue since it began."""
    if not taken:
        return now_stored.has_same_calibration_input_as(began_with)
    found = with_result(began_with, result)
    if now_stored.field not in (began_with.field, found.field) or now_stored.poses.keys() != began_with.poses.keys():
        return False
    # Each camera has the pose that the calibration began with, or the one that it found.
    venues = (now_stored, began_with, found)
    cameras = zip(*(venue.poses_and_lenses for venue in venues), strict=True)
    return all(now in (before, after) for now, before, after in cameras)


def _not_taken(now_stored: Venue, result: Result) -> frozenset[str]:
    """Return the cameras whose stored pose or lens differs from the one that a calibration found."""
    found = with_result(now_stored, result)
    pairs = zip(now_stored.poses_and_lenses, found.poses_and_lenses, strict=True)
    return frozenset(now.id for now, then in pairs if now != then)


def _without_refused(memories: Memories, result: Result, chosen: Collection[str]) -> Memories:
    """The memories but for those of chosen cameras whose poses the gate refused.

    Somebody says that these stand otherwise than their nights have it: the next job begins their memories anew.
    """
    anew = set(chosen) - set(result.accepted_cameras)
    return {camera: memory for camera, memory in memories.items() if camera not in anew}


def _touch(connection: sa.Connection, job_id: str) -> None:
    connection.execute(sa.update(tables.jobs).where(j.id == job_id).values(**changed(clock(connection))))
