"""Heartbeat and name of a worker.

No other worker may have the name at the same time.
"""

import hashlib
import time
import uuid
from collections.abc import Collection
from pathlib import Path

import structlog

from service import build
from service.settings import Settings
from service.store.workers import Round, WorkerRepository
from service.worker_lock import AlreadyRunning

BEAT_S = 2.0
START_POLL_S = 0.5
log = structlog.get_logger()


class Heartbeat:
    """Writes the heartbeat of one start of a worker. `place`: where its lock excludes others of its name."""

    def __init__(self, settings: Settings, workers: WorkerRepository, place: str) -> None:
        self.was_replaced = False
        self._settings = settings
        self._name = settings.worker_name
        self._workers = workers
        self._place, self._token = place, uuid.uuid4().hex

    def start(self) -> None:
        """Send the first heartbeat. Raises `AlreadyRunning` where a worker of this name is alive elsewhere."""
        self._require_the_name()
        self._enter()

    def beat(self) -> None:
        """Send a heartbeat."""
        self._go_on(self._workers.beat(self._name, self._token))

    def beat_and_listen(self, unreadable_jobs: Collection[str]) -> Round | None:
        """Send a heartbeat; return the silent workers and jobs, or None if another worker of this name has started.

        `unreadable_jobs`: those that wait and that this worker cannot read; they are not among the silent ones.
        """
        silence = self._workers.beat_and_listen(
            self._name, self._token, self._settings.takeover_after_s, unreadable_jobs
        )
        return silence if self._go_on(silence.is_of_this_start) else None

    def _go_on(self, is_of_this_start: bool) -> bool:
        """Return whether this start goes on, which it does not once another one has its name."""
        if is_of_this_start:
            return True
        if self._workers.start_of(self._name) is None:
            # The others have given this one up: it was away for longer than they wait.
            self._enter()
            return True
        if not self.was_replaced:
            log.error("another worker of this name has started, this one ends: rename one of them", worker=self._name)
        self.was_replaced = True
        return False

    def end(self) -> None:
        """Say that this start has ended, so that the next one of the name need not wait to be sure of it."""
        self._workers.end(self._name, self._token)

    def _require_the_name(self) -> None:
        """Raise `AlreadyRunning` if another worker of this name sends heartbeats.

        One that ran in this place has ended, since this one holds its lock. Of another that was killed just now nobody
        can know but by waiting.
        """
        silence_s = self._settings.takeover_after_s
        before, until = self._workers.start_of(self._name), time.monotonic() + silence_s
        if before is None or before.place in (None, self._place):
            return
        while time.monotonic() < until and self._name in [worker.name for worker in self._workers.alive(silence_s)]:
            now = self._workers.start_of(self._name)
            if now is not None and now.seen_at != before.seen_at:
                raise AlreadyRunning(
                    f"A worker called {self._name} already runs elsewhere, on another machine or folder: give this one "
                    "another name (ESC_WORKER_NAME, --name). Two of one name would begin each other's jobs again."
                )
            time.sleep(START_POLL_S)

    def _enter(self) -> None:
        model = self._settings.model
        sha256 = model_sha256(model) if model.is_file() else None
        self._workers.register(self._name, sha256, self._token, self._place, build.version())


def model_sha256(path: Path) -> str:
    """Return the SHA-256 of the model file in hex, as `provenance` has it."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
