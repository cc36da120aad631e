"""Attempts of workers at jobs: begin one, renew its lease, end it.

Every write of a worker carries the fencing token of its attempt (`run_token`) and changes nothing when the job was
cancelled or given to another attempt meanwhile.
"""

import uuid
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import sqlalchemy as sa

from service.schemas.job import JobError, Progress
from service.schemas.names import JobKind
from service.schemas.results import AnyResult
from service.store import tables
from service.store.database import Repository, clock, reading, writing
from service.store.jobs.ending import End, RowConditions, changed, end_job, still_open
from service.store.jobs.queries import ONE, job_input_values
from service.store.jobs.task import Task, UnreadableJob, parse_job_input
from service.store.memories import Memories, newest_memories
from service.store.statistics.venue_quality import last_accepted_views
from service.store.trends import anchors_of
from service.store.workers import unheard_for

NO_MEMORIES: Memories = MappingProxyType({})
# Job, priority and kind, into the queue in the caller's transaction.
Enqueue = Callable[[sa.Connection, str, int, JobKind], None]
j = tables.jobs.c


@dataclass(frozen=True)
class StrandedJob:
    """A queued job that the queue has already begun, with what is needed to enqueue it again."""

    priority: int
    kind: JobKind


class AttemptRepository(Repository):
    """The attempts of the jobs in the database."""

    def begin(self, job_id: str) -> Task | None:
        """Start an attempt; None if there is nothing to do any more. Raises `UnreadableJob`, and the job waits."""
        try:
            return self._begin(job_id)
        except UnreadableJob:
            self._requeue(job_id)
            raise

    def _begin(self, job_id: str) -> Task | None:
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
            job = job_input_values(row)
            last_views = last_accepted_views(connection, row.venue) if row.venue else {}
            memories = newest_memories(connection, row.venue) if row.kind == "calibration" else {}
            anchors = anchors_of(connection, row.venue) if row.venue else {}
            attempt = {
                "run_token": row.run_token,
                "attempt": row.attempt,
                "last_views": last_views,
                "memories": dict(memories),
                "anchors": anchors,
                "taken_at": row.created_at,
            }
            return parse_job_input(Task, job | attempt)

    def _requeue(self, job_id: str) -> None:
        """Put a job back into the queue after an attempt of a worker that could read it."""
        with writing(self._engine) as connection:
            queued = {"status": "queued", "run_token": None, "progress": None, **changed(clock(connection))}
            is_running = [j.id == job_id, j.status == "running"]
            connection.execute(sa.update(tables.jobs).where(*is_running).values(**queued))

    def reclaim(self, job_id: str, seconds: float) -> StrandedJob | None:
        """Reserve a job that has waited unchanged for so long, to put it into the queue again.

        None: it is no longer so, or another worker was faster. Raises `UnreadableJob`, and nothing is reserved.
        """
        with writing(self._engine) as connection:
            now = clock(connection)
            unchanged = [j.id == job_id, j.status == "queued", unheard_for(seconds, now)]
            reserve = sa.update(tables.jobs).where(*unchanged).values(updated_at=now)
            if connection.execute(reserve).rowcount == 0:
                return None
            row = connection.execute(ONE, {"job_id": job_id}).one()
            parse_job_input(Task, job_input_values(row) | {"run_token": ""})
            return StrandedJob(row.priority, row.kind)

    def enqueue(self, job_id: str, job: StrandedJob, enqueue: Enqueue) -> None:
        """Put a job that was taken back into the queue."""
        with writing(self._engine) as connection:
            enqueue(connection, job_id, job.priority, job.kind)

    def still_waiting(self, job_ids: Collection[str]) -> set[str]:
        """Return which of several jobs are waiting."""
        query = sa.select(j.id).where(j.id.in_(job_ids), j.status == "queued")
        with reading(self._engine) as connection:
            return set(connection.scalars(query)) if job_ids else set()

    def check_leases(self, tasks: Collection[Task], progress: Mapping[str, Progress], *, renew: bool) -> set[str]:
        """Return the fencing tokens of the attempts that hold the lease of their job.

        `progress`: how far some of them are, by fencing token, is written down where the lease is held. `renew`: the
        leases of all are renewed, else of these.
        """
        written = [task for task in tasks if renew or task.run_token in progress]
        rest = [task for task in tasks if not renew and task.run_token not in progress]
        if not written:
            with reading(self._engine) as connection:
                return _holders(connection, rest)
        with writing(self._engine) as connection:
            alive = sa.update(tables.jobs).where(*_fences(written)).values(updated_at=clock(connection))
            if progress:
                alive = alive.values(_progress_columns(progress))
            return set(connection.scalars(alive.returning(j.run_token))) | _holders(connection, rest)

    def finish(self, task: Task, result: AnyResult, pictures: Sequence[str], memories: Memories = NO_MEMORIES) -> None:
        """End a job with a result and the names of its pictures.

        If it is that of a calibration, the poses that are accepted become the stored ones in the same transaction, and
        `memories` those of their cameras.
        """
        end = End(
            "succeeded",
            result,
            pictures=pictures,
            began_with=task.venue,
            memories=memories,
            submitter=task.origin.actor,
        )
        with writing(self._engine) as connection:
            end_job(connection, task.job_id, _fences([task]), end)

    def fail(self, task: Task, error: JobError) -> None:
        """End a job without a result."""
        with writing(self._engine) as connection:
            end_job(connection, task.job_id, _fences([task]), End("failed", error=error))

    def hand_back(self, task: Task) -> bool:
        """Let a job wait again as if this attempt of it had not been; False if the attempt has ended or lost it."""
        as_before = {"status": "queued", "run_token": None, "attempt": j.attempt - 1, "progress": None}
        if task.attempt == 1:
            as_before["started_at"] = None
        with writing(self._engine) as connection:
            back = sa.update(tables.jobs).where(*_fences([task])).values(**as_before, **changed(clock(connection)))
            return connection.execute(back).rowcount == 1

    def abandon(self, job_id: str, error: JobError, seconds: float) -> bool:
        """End an open job that the queue has given up; False if it has ended or was heard of meanwhile."""
        with writing(self._engine) as connection:
            conditions = [*still_open(job_id), unheard_for(seconds, clock(connection))]
            return end_job(connection, job_id, conditions, End("failed", error=error))


def _fences(tasks: Collection[Task]) -> RowConditions:
    # Tokens are of one attempt each; the ids are what the index is by.
    tokens = [task.run_token for task in tasks]
    return [j.id.in_([task.job_id for task in tasks]), j.run_token.in_(tokens), j.status == "running"]


def _holders(connection: sa.Connection, tasks: Collection[Task]) -> set[str]:
    return set(connection.scalars(sa.select(j.run_token).where(*_fences(tasks)))) if tasks else set()


def _progress_columns(progress: Mapping[str, Progress]) -> dict[str, sa.ColumnElement[Any]]:
    """The columns of jobs in one statement, of which some are further than they were; the others stay as they are."""
    shown = {token: sa.literal(far.model_dump(mode="json"), j.progress.type) for token, far in progress.items()}
    return {
        "progress": sa.case(shown, value=j.run_token, else_=j.progress),
        "revision": j.revision + sa.case((j.run_token.in_(progress), 1), else_=0),
    }
