"""Leases of a worker on the jobs that it computes: each attempt holds one and asks it whether to go on.

A lease is the row of the job with the run token of the attempt, which is its fencing token (Kleppmann, "How to do
distributed locking", 2016): an attempt whose token is no longer in the row writes nothing.

One statement asks about all jobs of the worker, however many run at once, and now and then renews all of their leases.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Collection

import structlog

from service.schemas.job import Progress
from service.store.database import DATABASE_OUTAGES
from service.store.jobs.attempts import AttemptRepository
from service.store.jobs.task import Task
from worker.heartbeat import BEAT_S

# An answer of the database is valid for so long: less than what passes between two checks of one attempt.
ANSWER_VALID_S = 0.4
# Between two writes of how far a job is within one stage.
PROGRESS_S = 2.0
log = structlog.get_logger()


class LeaseLostError(Exception):
    """The job was cancelled, or belongs to another attempt."""


class JobTimeoutError(Exception):
    """The job has run for longer than its time limit."""


class Leases:
    """All leases of one worker. Thread-safe."""

    def __init__(self, attempts: AttemptRepository) -> None:
        self._attempts = attempts
        self._lock = threading.Lock()
        self._tasks: dict[str, Task] = {}
        self._lost: set[str] = set()
        self._asked_at = self._renewed_at = float("-inf")

    def begin(self, task: Task, limit_s: float) -> Lease:
        """Return the lease of an attempt, for a `with` block; `limit_s`: the time limit of the job."""
        return Lease(self, self._attempts, task, limit_s)

    def add(self, task: Task) -> None:
        """Include an attempt in the next queries and renewals."""
        with self._lock:
            self._tasks[task.run_token] = task

    def remove(self, task: Task) -> None:
        """Exclude an attempt from further queries."""
        with self._lock:
            del self._tasks[task.run_token]
            self._lost.discard(task.run_token)

    def is_lost(self, task: Task) -> bool:
        """True if the job was cancelled or went to another attempt; as last known while the database is away."""
        with self._lock:
            if time.monotonic() - self._asked_at >= ANSWER_VALID_S:
                # Before the answer: a database that is away keeps one attempt waiting, and not each in its turn.
                self._asked_at = time.monotonic()
                try:
                    self._lost |= self._tasks.keys() - self._ask(self._tasks.values())
                except DATABASE_OUTAGES:
                    log.warning("cannot give a sign of life", exc_info=True)
            return task.run_token in self._lost

    def _ask(self, tasks: Collection[Task]) -> set[str]:
        """Return the run tokens of the attempts that still hold their leases; renew them when that is due."""
        if time.monotonic() - self._renewed_at < BEAT_S:
            return self._attempts.held_leases(tasks)
        self._renewed_at = time.monotonic()
        return self._attempts.renew_leases(tasks)


class Lease:
    """The lease of one attempt, held until the `with` block is left."""

    def __init__(self, leases: Leases, attempts: AttemptRepository, task: Task, limit_s: float) -> None:
        self._leases = leases
        self._attempts = attempts
        self._task = task
        self._deadline = time.monotonic() + limit_s
        self._written_at, self._stage = float("-inf"), ""

    def __enter__(self) -> Lease:
        self._leases.add(self._task)
        return self

    def __exit__(self, *_: object) -> None:
        self._leases.remove(self._task)

    def check(self) -> None:
        """Raise `LeaseLostError` or `JobTimeoutError` if the attempt must end."""
        if self._leases.is_lost(self._task):
            raise LeaseLostError
        if time.monotonic() > self._deadline:
            raise JobTimeoutError

    def report(self, progress: Progress) -> None:
        """Write the progress of the job: each stage, and within it every two seconds. Raises `LeaseLostError`."""
        if progress.stage == self._stage and time.monotonic() - self._written_at < PROGRESS_S:
            return
        self._stage, self._written_at = progress.stage, time.monotonic()
        try:
            if not self._attempts.report(self._task, progress):
                raise LeaseLostError
        except DATABASE_OUTAGES:
            log.warning("cannot show how far the job is", exc_info=True)
