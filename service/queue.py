"""The queue: the one module that knows DBOS.

What can be relied on: a job that was enqueued in a transaction is begun by some worker once that transaction is
committed, `live` before `routine`, in order of submission; it is begun again when its worker died, three times in all;
then it is given up. Kinds with a queue of their own neither wait for the others nor hold them up. The queue does not
know how a job ended; the job's row does.
"""

import sqlite3
import threading
import uuid
from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import cached_property

import sqlalchemy as sa
import structlog
from dbos import DBOS, DBOSClient, DBOSConfig
from dbos import Queue as EngineQueue
from dbos import WorkflowStatusString as QueueStatus
from dbos._core import execute_dequeued_workflow

from service.schemas.names import OWN_QUEUES, JobKind
from service.store.database import LIMITS, postgresql, share_sqlite, sqlite_file

APPLICATION = "esc"
QUEUE = "calibration"
WORKFLOW = "calibrate"
# The schema of the queue's own tables on PostgreSQL.
SCHEMA = "dbos"
# The engine's default is a hash of the source; after a deployment the jobs of the old version would never be begun.
VERSION = "1"
BEGINS_AGAIN = 2
# A job waits for half of it before an idle worker begins it. Each look at a server is a transaction that others share;
# one at a file beside the worker takes a third of a millisecond.
POLL_S, POLL_FILE_S = 0.5, 0.1
log = structlog.get_logger()


def migrate(url: str) -> None:
    """Bring the queue's own tables up to date; they live in the same database as ours."""
    DBOS.migrate(url)


def remove(url: str) -> None:
    """Take the queue's own tables out of a PostgreSQL database again, with all that is in them."""
    engine = postgresql(url)
    with engine.begin() as connection:
        connection.execute(sa.schema.DropSchema(SCHEMA, cascade=True, if_exists=True))
    engine.dispose()


def _engine(url: str, limits: str = LIMITS) -> sa.Engine:
    """The queue's own engine: its SQL expects the driver to begin transactions, ours does not."""
    if sqlite_file(url) is None:
        return postgresql(url, limits)
    engine = sa.create_engine(url)

    @sa.event.listens_for(engine, "connect")
    def _(connection: sqlite3.Connection, _: object) -> None:
        connection.isolation_level = "IMMEDIATE"
        share_sqlite(connection)

    return engine


@dataclass(frozen=True)
class GivenUp:
    """Why the queue does not begin a job again, in words.

    `can_wait`: whether that says nothing against beginning it, if it never was begun.
    """

    why: str
    can_wait: bool


ENDED = {
    QueueStatus.MAX_RECOVERY_ATTEMPTS_EXCEEDED.value: GivenUp(
        f"It was begun {1 + BEGINS_AGAIN} times, and each time its worker ended before it did", can_wait=False
    ),
    QueueStatus.ERROR.value: GivenUp(
        "Its last attempt broke off with an error before it could write down how it ended", can_wait=True
    ),
    QueueStatus.SUCCESS.value: GivenUp("Its last attempt ended without having written down how", can_wait=True),
    QueueStatus.CANCELLED.value: GivenUp("It was taken out of the queue", can_wait=False),
}
UNKNOWN = GivenUp("The queue does not know it", can_wait=True)


def _queue_of(kind: JobKind) -> str:
    return OWN_QUEUES.get(kind, QUEUE)


class Queue:
    """The half of the HTTP service: puts jobs in."""

    def __init__(self, url: str) -> None:
        self._engine = _engine(url)
        self._client = DBOSClient(system_database_engine=self._engine, application_name=APPLICATION)

    def enqueue(self, connection: sa.Connection, job_id: str, priority: int, kind: JobKind) -> None:
        """Put a job in, when and if the caller's transaction commits. A smaller `priority` goes first."""
        self._client.enqueue_in_transaction(
            connection,
            {"workflow_name": WORKFLOW, "queue_name": _queue_of(kind), "workflow_id": job_id, "priority": priority},
            job_id,
        )

    def forget(self, job_ids: Collection[str]) -> None:
        """Delete what the queue keeps about jobs; those it does not know are no error."""
        self._client.delete_workflows(list(job_ids))

    def hand_back(self, job_id: str, kind: JobKind) -> None:
        """Put a job that a worker has begun back in, at its place; what was begun so far is not counted against it."""
        self._client.resume_workflow(job_id, queue_name=_queue_of(kind))

    def close(self) -> None:
        """Let the database go."""
        self._client.destroy()
        self._engine.dispose()


class WorkerQueue:
    """The half of the worker: takes jobs out and calls `run(job_id)` for each, in a thread of its own.

    The engine's own threads ask the database a dozen times a second, whatever their options: for the settings and the
    jobs of each queue, and for queues, schedules, delays and timeouts, of which there are none. So they are stopped
    once they run, and one thread of ours asks about all queues in one statement. Jobs are claimed and begun by the
    engine all the same; its private calls are those of the version that is pinned exactly.
    """

    def __init__(self, url: str, worker: str, jobs_at_once: int, run: Callable[[str], None]) -> None:
        self._worker = worker
        self._poll_s = POLL_FILE_S if sqlite_file(url) else POLL_S
        self._at_once = {QUEUE: jobs_at_once, **dict.fromkeys(OWN_QUEUES.values(), 1)}
        config: DBOSConfig = {
            "name": APPLICATION,
            "system_database_url": url,
            # DBOS takes a statement that is given up for a failure of the workflow; it may wait as long as it wants.
            "system_database_engine": _engine(url, limits=""),
            "executor_id": worker,
            "application_version": VERSION,
            # It would listen for events of workflows, which nobody here sends.
            "use_listen_notify": False,
            "log_level": "WARNING",
        }
        self._engine = DBOS(config=config)
        self._queues: list[EngineQueue] = []
        self._stopped = threading.Event()

        @DBOS.workflow(name=WORKFLOW, max_recovery_attempts=BEGINS_AGAIN)
        def attempt(job_id: str) -> None:
            run(job_id)

    def start(self) -> None:
        """Begin with what this worker left behind, then take from the queue."""
        DBOS.listen_queues([])
        DBOS.launch()
        self._engine._background_jobs_stop_event.set()
        for event in list(self._engine.background_thread_stop_events):
            event.set()
        self._queues = [
            DBOS.register_queue(name, worker_concurrency=at_once, on_conflict="always_update")
            for name, at_once in self._at_once.items()
        ]
        self.take_over([self._worker])
        threading.Thread(target=self._take_until_stopped, name="queue", daemon=True).start()

    def stop_taking(self) -> None:
        """Take no more jobs; those that were begun go on."""
        self._stopped.set()

    def _take_until_stopped(self) -> None:
        while not self._stopped.wait(self._poll_s):
            try:
                for queue in self._queues_with_work():
                    self._take(queue)
            except Exception:  # the database is away: the next look tries again
                log.warning("cannot take jobs out of the queue", exc_info=True)

    def _queues_with_work(self) -> list[EngineQueue]:
        """Return the queues in which jobs wait, of those from which this worker may take more."""
        free = [queue for queue in self._queues if self._running(queue) < self._at_once[queue.name]]
        if not free:
            return []
        with self._engine._sys_db.engine.begin() as connection:
            answers = connection.execute(self._any_waits).one()
        return [queue for queue, any_wait in zip(self._queues, answers, strict=True) if any_wait and queue in free]

    @cached_property
    def _any_waits(self) -> sa.Executable:
        """The question whether jobs wait in each queue. To put it together anew takes as long as to ask it."""
        row = self._engine._sys_db.tables.workflow_status.c
        # Not a parameter: the index holds these alone, which the database must see when it plans.
        waits = row.status == sa.literal_column(f"'{QueueStatus.ENQUEUED.value}'")
        of_queues = (sa.select(row.queue_name).where(row.queue_name == queue.name, waits) for queue in self._queues)
        return sa.select(*map(sa.exists, of_queues))

    def _take(self, queue: EngineQueue) -> None:
        owner, engine = uuid.uuid4().hex, self._engine._sys_db
        claimed, _ = engine.start_queued_workflows(
            queue, self._worker, VERSION, None, self._running(queue), owner_xid=owner
        )
        for status in engine.get_workflow_statuses(claimed):
            try:
                execute_dequeued_workflow(self._engine, status, owner)
            except Exception:  # most likely one that was begun too often, which `given_up` then says
                log.warning("not begun", job=status["workflow_uuid"], exc_info=True)

    def _running(self, queue: EngineQueue) -> int:
        return self._engine._active_workflows_set.count_for_queue(queue.name)

    def is_idle(self) -> bool:
        """True if every claimed job has ended, and the queue knows. Private to the engine as well."""
        return not self._engine._active_workflows_set.activeList()

    def take_over(self, dead_workers: Collection[str]) -> None:
        """Put the jobs of dead workers back into the queue. Private to the engine: its version is pinned exactly."""
        DBOS._recover_pending_workflows(list(dead_workers))

    def given_up(self, job_ids: Collection[str]) -> dict[str, GivenUp]:
        """Return those of the jobs that the queue will not begin again, with the reason."""
        found = DBOS.list_workflows(workflow_ids=list(job_ids), load_input=False, load_output=False)
        status = {workflow.workflow_id: workflow.status for workflow in found}
        unknown = dict.fromkeys(set(job_ids) - status.keys(), UNKNOWN)
        return unknown | {job_id: ENDED[ended] for job_id, ended in status.items() if ended in ENDED}

    def forget(self, job_ids: Collection[str]) -> None:
        """Delete what the queue keeps about jobs that have ended; those it does not know are no error."""
        DBOS.delete_workflows(list(job_ids))
