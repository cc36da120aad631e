"""The queue: the one module that knows DBOS.

What can be relied on: a job that was enqueued in a transaction is begun by some worker once that transaction is
committed, `live` before `routine`, in order of submission; it is begun again when its worker died, three times in all;
then it is given up. The queue does not know how a job ended; the job's row does.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Collection

import sqlalchemy as sa
from dbos import DBOS, DBOSClient, DBOSConfig
from dbos import WorkflowStatusString as QueueStatus

from service.store.engine import postgresql
from service.wire.names import Kind

APPLICATION = "esc"
QUEUE = "calibration"
# For what takes a second and somebody waits for: it does not stand behind a calibration.
LIGHT_QUEUE, LIGHT = "light", ("locate",)
WORKFLOW = "calibrate"
# The engine's default is a hash of the source; after a deployment the jobs of the old version would never be begun.
VERSION = "1"
BEGINS_AGAIN = 2
POLL_S = 0.5


def migrate(url: str) -> None:
    """Bring the queue's own tables up to date; they live in the same database as ours."""
    DBOS.migrate(url)


def _engine(url: str) -> sa.Engine:
    """The queue's own engine: its SQL expects the driver to begin transactions, ours does not."""
    if not url.startswith("sqlite"):
        return postgresql(url)
    engine = sa.create_engine(url)

    @sa.event.listens_for(engine, "connect")
    def _(connection: sqlite3.Connection, _: object) -> None:
        connection.isolation_level = "IMMEDIATE"
        for pragma in ("busy_timeout=30000", "journal_mode=WAL", "foreign_keys=ON"):
            connection.execute(f"PRAGMA {pragma}")

    return engine


# Why the queue does not begin a job again.
ENDED = {
    QueueStatus.MAX_RECOVERY_ATTEMPTS_EXCEEDED.value: f"It was begun {1 + BEGINS_AGAIN} times, and each time its "
    "worker ended before it did",
    QueueStatus.ERROR.value: "Its last attempt broke off with an error before it could write down how it ended",
    QueueStatus.SUCCESS.value: "Its last attempt ended without having written down how",
    QueueStatus.CANCELLED.value: "It was taken out of the queue",
}


class Queue:
    """The half of the HTTP service: puts jobs in."""

    def __init__(self, url: str) -> None:
        self._engine = _engine(url)
        self._client = DBOSClient(system_database_engine=self._engine, application_name=APPLICATION)

    def enqueue(self, connection: sa.Connection, job_id: str, priority: int, kind: Kind) -> None:
        """Put a job in, when and if the caller's transaction commits. A smaller `priority` goes first."""
        queue = LIGHT_QUEUE if kind in LIGHT else QUEUE
        self._client.enqueue_in_transaction(
            connection,
            {"workflow_name": WORKFLOW, "queue_name": queue, "workflow_id": job_id, "priority": priority},
            job_id,
        )

    def forget(self, job_ids: Collection[str]) -> None:
        """Delete what the queue keeps about jobs that have ended; those it does not know are no error."""
        self._client.delete_workflows(list(job_ids))

    def close(self) -> None:
        """Let the database go."""
        self._client.destroy()
        self._engine.dispose()


class WorkerQueue:
    """The half of the worker: takes jobs out and calls `run(job_id)` for each, in a thread of its own."""

    def __init__(self, url: str, worker: str, jobs_at_once: int, run: Callable[[str], None]) -> None:
        self._jobs_at_once = jobs_at_once
        config: DBOSConfig = {
            "name": APPLICATION,
            "system_database_url": url,
            "system_database_engine": _engine(url),
            "executor_id": worker,
            "application_version": VERSION,
            "log_level": "WARNING",
        }
        DBOS(config=config)

        @DBOS.workflow(name=WORKFLOW, max_recovery_attempts=BEGINS_AGAIN)
        def attempt(job_id: str) -> None:
            run(job_id)

    def start(self) -> None:
        """Begin with what this worker left behind, then take from the queue."""
        DBOS.launch()
        for queue, at_once in ((QUEUE, self._jobs_at_once), (LIGHT_QUEUE, 1)):
            DBOS.register_queue(
                queue, worker_concurrency=at_once, polling_interval_sec=POLL_S, on_conflict="always_update"
            )

    def take_over(self, dead_workers: Collection[str]) -> None:
        """Put the jobs of dead workers back into the queue. Private to the engine: its version is pinned exactly."""
        DBOS._recover_pending_workflows(list(dead_workers))

    def given_up(self, job_ids: Collection[str]) -> dict[str, str]:
        """Which of these jobs the queue will not begin again, and why in words."""
        found = DBOS.list_workflows(workflow_ids=list(job_ids), status=list(ENDED), load_input=False, load_output=False)
        return {workflow.workflow_id: ENDED[workflow.status] for workflow in found}

    def forget(self, job_ids: Collection[str]) -> None:
        """Delete what the queue keeps about jobs that have ended; those it does not know are no error."""
        DBOS.delete_workflows(list(job_ids))
