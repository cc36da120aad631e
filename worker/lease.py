"""Leases of a worker on the jobs that it computes.

Each attempt holds one, and asks it whether to go on.

A lease is the row of the job with the run token of the attempt, which is its fencing token (Kleppmann, "How to do
distributed locking", 2016): an attempt whose token is no longer in the row writes nothing.

One transaction asks about all jobs of the worker, however many run at once. The same one writes how far those are that
have something new to say, and now and then renews all leases.
"""

import threading
import time

import structlog

from service.schemas.job import Progress
from service.store.database import DATABASE_OUTAGES
from service.store.jobs.attempts import AttemptRepository
from service.store.jobs.task import Task
from worker.heartbeat import BEAT_S

# An answer of the database is valid for so long. With what passes between two checks of one attempt, and with the end
# of its program, a cancellation takes less than two seconds.
ANSWER_VALID_S = 0.9
# Or for so long, if there is progress to be written: less than what passes between two checks.
PROGRESS_WAITS_S = 0.4
# Between two reports of how far a job is within one stage.
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
        # By the fencing token of the attempt.
        self._tasks: dict[str, Task] = {}
        self._progress: dict[str, Progress] = {}
        self._lost: set[str] = set()
        self._asked_at = self._renewed_at = float("-inf")

    def begin(self, task: Task, limit_s: float) -> "Lease":
        """Return the lease of an attempt, for a `with` block; `limit_s`: the time limit of the job."""
        return Lease(self, task, limit_s)

    def add(self, task: Task) -> None:
        """Include an attempt in the next queries and renewals."""
        with self._lock:
            self._tasks[task.run_token] = task

    def remove(self, task: Task) -> None:
        """Exclude an attempt from further queries."""
        with self._lock:
            del self._tasks[task.run_token]
            self._progress.pop(task.run_token, None)
            self._lost.discard(task.run_token)

    def report(self, task: Task, progress: Progress) -> None:
        """Have the next query write how far a job is."""
        with self._lock:
            self._progress[task.run_token] = progress

    def is_lost(self, task: Task) -> bool:
        """True if the job was cancelled or went to another attempt; as last known while the database is away."""
        with self._lock:
            valid_s = PROGRESS_WAITS_S if self._progress else ANSWER_VALID_S
            if time.monotonic() - self._asked_at >= valid_s:
                # Before the answer: a database that is away keeps one attempt waiting, and not each in its turn.
                self._asked_at = time.monotonic()
                try:
                    self._lost |= self._tasks.keys() - self._ask()
                except DATABASE_OUTAGES:
                    log.warning("cannot give a sign of life", exc_info=True)
            return task.run_token in self._lost

    def _ask(self) -> set[str]:
        """Return the fencing tokens whose leases are valid; renew these leases when that is due."""
        is_due = time.monotonic() - self._renewed_at >= BEAT_S
        if is_due:
            self._renewed_at = time.monotonic()
        valid = self._attempts.check_leases(self._tasks.values(), self._progress, renew=is_due)
        self._progress = {}
        return valid


class Lease:
    """The lease of one attempt, held until the `with` block is left."""

    def __init__(self, leases: Leases, task: Task, limit_s: float) -> None:
        self._leases = leases
        self._task = task
        self._deadline = time.monotonic() + limit_s
        self._reported_at, self._stage = float("-inf"), ""

    def __enter__(self) -> "Lease":
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
        """Have the next check write how far the job is: each stage, and within it every two seconds."""
        if progress.stage != self._stage or time.monotonic() - self._reported_at >= PROGRESS_S:
            self._stage, self._reported_at = progress.stage, time.monotonic()
            self._leases.report(self._task, progress)
