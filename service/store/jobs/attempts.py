"""What workers do with jobs: begin an attempt, keep it, end it.

Every write of a worker carries the token of its attempt (`run_token`) and changes nothing when the job was cancelled or
given to another attempt meanwhile.
"""

from __future__ import annotations

import uuid
from collections.abc import Sequence
from datetime import timedelta
from types import MappingProxyType

import sqlalchemy as sa

from service.store import tables
from service.store.alarms import settle_alarms
from service.store.counts.courses import note_missed, note_none_held, views_of
from service.store.counts.figures import note_quality
from service.store.engine import Repository, clock, reading, serialise, writing
from service.store.jobs.ending import Still, changed, end, still_open
from service.store.jobs.reading import ONE, asked
from service.store.jobs.task import Task
from service.store.memories import Memories, newest_memories
from service.store.trends import anchors_of
from service.store.venues import find_venue, let_hold, venue_lock
from service.wire.job import JobError, Progress
from service.wire.names import OPEN
from service.wire.options import Options
from service.wire.results import AnyResult, Result
from service.wire.venue import Venue

NO_MEMORIES: Memories = MappingProxyType({})
DONE = Progress(stage="preview", fraction=1.0)
j = tables.jobs.c


class Attempts(Repository):
    """The attempts of the jobs in the database."""

    def begin(self, job_id: str) -> Task | None:
        """Start an attempt; None if there is nothing to do any more."""
        with writing(self._engine) as connection:
            now = clock(connection)
            begin = (
                sa.update(tables.jobs)
                .where(*still_open(job_id))
                .values(
                    status="running",
                    run_token=uuid.uuid4().hex,
                    attempt=j.attempt + 1,
                    started_at=sa.func.coalesce(j.started_at, now, type_=j.started_at.type),
                    progress=None,
                    **changed(now),
                )
            )
            if connection.execute(begin).rowcount == 0:
                return None
            row = connection.execute(ONE, {"job_id": job_id}).one()
            job = asked(row)
            last_views = views_of(connection, row.venue) if row.venue else {}
            memories = newest_memories(connection, row.venue) if row.kind == "calibration" else {}
            anchors = anchors_of(connection, row.venue) if row.venue else {}
            return Task(
                **job,
                run_token=row.run_token,
                attempt=row.attempt,
                last_views=last_views,
                memories=dict(memories),
                anchors=anchors,
                taken_at=row.created_at,
            )

    def holds(self, task: Task) -> bool:
        """Whether the job is still this attempt's; False if it has lost it, to a cancellation or to another attempt."""
        with reading(self._engine) as connection:
            return connection.scalar(sa.select(j.id).where(*_fence(task))) is not None

    def keep(self, task: Task) -> bool:
        """A sign of life of an attempt; False if it has lost the job."""
        with writing(self._engine) as connection:
            alive = sa.update(tables.jobs).where(*_fence(task)).values(updated_at=clock(connection))
            return connection.execute(alive).rowcount == 1

    def report(self, task: Task, progress: Progress) -> None:
        """Show how far the job is."""
        with writing(self._engine) as connection:
            shown = {"progress": progress.model_dump(), **changed(clock(connection))}
            connection.execute(sa.update(tables.jobs).where(*_fence(task)).values(**shown))

    def finish(self, task: Task, result: AnyResult, pictures: Sequence[str], memories: Memories = NO_MEMORIES) -> None:
        """End a job with a result and the names of its pictures.

        If it is that of a calibration, the poses that are accepted become the stored ones in the same transaction, and
        `memories` those of their cameras.
        """
        with writing(self._engine) as connection:
            if task.venue is not None:
                serialise(connection, venue_lock(task.venue.id))
            if not _locked(connection, _fence(task)):
                return
            if isinstance(result, Result):
                result = _move_poses(connection, task, result, memories)
            end(
                connection,
                task.job_id,
                _fence(task),
                "succeeded",
                result=result,
                pictures=list(pictures),
                progress=DONE.model_dump(),
            )

    def fail(self, task: Task, error: JobError) -> None:
        """End a job without a result."""
        with writing(self._engine) as connection:
            end_without_result(connection, task.job_id, _fence(task), error)

    def unchanged_for(self, seconds: float) -> list[str]:
        """Open jobs that nothing was heard of for a while."""
        with reading(self._engine) as connection:
            before = clock(connection) - timedelta(seconds=seconds)
            query = sa.select(j.id).where(j.status.in_(OPEN), j.updated_at < before)
            return list(connection.scalars(query.order_by(j.updated_at).limit(100)))

    def abandon(self, job_id: str, error: JobError) -> bool:
        """End an open job that the queue has given up; False if it has ended meanwhile."""
        with writing(self._engine) as connection:
            return end_without_result(connection, job_id, still_open(job_id), error)


def _fence(task: Task) -> Still:
    return [j.id == task.job_id, j.run_token == task.run_token, j.status == "running"]


def _locked(connection: sa.Connection, still: Still) -> bool:
    """Whether the job still is so, and stays so: a cancellation must come before an end or after it, not within."""
    return connection.scalar(sa.select(j.id).where(*still).with_for_update()) is not None


def _move_poses(connection: sa.Connection, task: Task, result: Result, memories: Memories) -> Result:
    """Let the poses hold that are accepted with the memories of their cameras, and note what the result says about the
    venue.

    Gives the result with what the venue has to say about that.
    """
    assert task.venue is not None
    assert isinstance(task.options, Options)
    now_stored = find_venue(connection, task.venue.id)
    if now_stored is None or not now_stored.calibrates_like(task.venue):
        if not result.accepted_cameras:
            return result
        return result.refused("the venue was changed while the job ran", "venue-changed")
    held = [] if task.options.dry_run else result.accepted_cameras
    note_quality(connection, task.venue.id, result, moved=bool(held))
    if held:
        note_missed(connection, task.venue.id, now_stored.poses.keys() - held)
        with_this_job = {camera: memory for camera, memory in memories.items() if camera in held}
        known = {**newest_memories(connection, task.venue.id), **with_this_job}
        let_hold(connection, now_stored, result, held, "calibrated", task.job_id, known)
    elif not task.options.dry_run:
        _miss(connection, now_stored)
    return result


def end_without_result(connection: sa.Connection, job_id: str, still: Still, error: JobError) -> bool:
    """Fail a job inside the caller's transaction; False, and nothing is done, if the row is not `still` so."""
    row = connection.execute(sa.select(j.kind, j.venue, j.options).where(j.id == job_id)).one()
    brought_none = row.kind == "calibration" and not row.options["dry_run"]
    if row.venue is not None:
        serialise(connection, venue_lock(row.venue))
    if not _locked(connection, still):
        return False
    venue = find_venue(connection, row.venue) if brought_none else None
    if venue is not None:
        # Alarms are counted before ends wherever both are, so that no two transactions wait for each other.
        _miss(connection, venue)
    return end(connection, job_id, still, "failed", error=error)


def _miss(connection: sa.Connection, venue: Venue) -> None:
    """A calibration that was to bring poses brought none."""
    note_none_held(connection, venue.id, venue.poses.keys())
    settle_alarms(connection, venue)
