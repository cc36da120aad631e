"""The worker: takes jobs out of the queue and computes each in a child process of its own.

A crash in native code, a time limit or a cancellation costs a child and with it one job, never the worker. The worker
itself may be killed at any moment: its job is begun again, by itself when it comes back or by another worker that finds
its heartbeat silent. Stopping it politely is the same: there is no second way to end.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import selectors
import signal
import subprocess
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO

import structlog
from pydantic import ValidationError

from service import lifeline
from service.problems import KINDS, type_of
from service.queue import WorkerQueue
from service.queue import migrate as migrate_queue
from service.schemas import JobError
from service.settings import Settings
from service.store.engine import connect, migrate
from service.store.jobs import Jobs, Task
from service.store.workers import Workers
from worker.message import Message

BEAT_S = 2.0
SWEEP_S = 3.0
# Twice as often as a cancellation needs to reach the child.
LOOK_S = 0.5
PROGRESS_S = 0.25
LONGEST_LINE = 16 * 1024 * 1024
log = structlog.get_logger()


class AlreadyRunning(Exception):  # noqa: N818
    """A worker of this name runs on this machine."""


def run(settings: Settings) -> None:
    """Work until SIGTERM or SIGINT; never returns."""
    lock = _only_one(settings)
    worker = Worker(settings)
    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.set())
    worker.start()
    log.info("worker started", worker=settings.worker_name, threads=settings.threads)
    worker.look_after(stop)
    log.info("worker stops", worker=settings.worker_name)
    lock.close()
    # Threads may be waiting for children; those end with this process and their jobs are begun again.
    os._exit(0)


class Worker:
    """Everything that one worker process holds."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        engine = connect(settings.home_database_url)
        migrate(engine)
        migrate_queue(settings.home_database_url)
        self._jobs = Jobs(engine)
        self._workers = Workers(engine)
        self._queue = WorkerQueue(
            settings.home_database_url, settings.worker_name, settings.jobs_at_once, self._attempt
        )

    def start(self) -> None:
        """Show up and take jobs."""
        self._enter()
        self._queue.start()

    def look_after(self, stop: threading.Event) -> None:
        """Give signs of life, take over from the dead, end what the queue has given up."""
        swept = 0.0
        while not stop.wait(BEAT_S):
            try:
                if not self._workers.beat(self._settings.worker_name):
                    self._enter()
                if time.monotonic() - swept > SWEEP_S:
                    self._take_over()
                    self._reconcile()
                    swept = time.monotonic()
            except Exception:  # the database is away: the next round tries again
                log.warning("cannot look after the jobs", exc_info=True)

    def _enter(self) -> None:
        model = self._settings.model
        self._workers.enter(self._settings.worker_name, model_sha256(model) if model.is_file() else None)

    def _take_over(self) -> None:
        silence = self._settings.takeover_after_s
        dead = self._workers.silent(silence)
        if dead:
            log.warning("taking over", workers=dead)
            self._queue.take_over(dead)
            for name in dead:
                self._workers.leave(name, silence)

    def _reconcile(self) -> None:
        silent = self._jobs.unchanged_for(self._settings.takeover_after_s)
        for job_id in self._queue.given_up(silent) if silent else []:
            log.error("job given up", job=job_id)
            self._jobs.abandon(job_id, _error("job-abandoned", "Its worker died each time; see the worker's log."))

    def _attempt(self, job_id: str) -> None:
        """One attempt of a job, from its beginning to a state that is written down."""
        task = self._jobs.begin(job_id)
        if task is None:
            return
        with structlog.contextvars.bound_contextvars(job=job_id):
            log.info("job begins", venue=task.venue.id)
            begun = time.monotonic()
            self._compute(task)
            log.info("job ends", seconds=round(time.monotonic() - begun, 2))

    def _compute(self, task: Task) -> None:
        limit_s = task.options.timeout_s or self._settings.job_timeout_s
        deadline = time.monotonic() + limit_s
        shown = 0.0
        with Child(self._settings, task) as child:
            for message in child.messages():
                if message is None and not self._jobs.keep(task):
                    log.info("job taken away")
                    return
                if time.monotonic() > deadline:
                    self._jobs.fail(task, _error("job-timeout", f"It was ended after {limit_s:g} s; see timeout_s."))
                    return
                if message is None:
                    continue
                if message.result is not None:
                    self._jobs.finish(task, message.result)
                    return
                if message.error is not None:
                    self._jobs.fail(task, message.error)
                    return
                if message.progress is not None and time.monotonic() - shown >= PROGRESS_S:
                    self._jobs.report(task, message.progress)
                    shown = time.monotonic()
            self._jobs.fail(task, _error("job-crashed", child.how_it_ended()))


class Child:
    """The process that computes one job; killed when the `with` block is left."""

    def __init__(self, settings: Settings, task: Task) -> None:
        # Arrays as small as a population's gain nothing from BLAS threads; ONNX Runtime and OpenCV get `threads`.
        single = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
        bomb = {"OPENCV_IO_MAX_IMAGE_PIXELS": str(settings.max_frame_pixels)}
        self._process = subprocess.Popen(
            [*settings.job_program, task.job_id, task.run_token],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            env=os.environ | _as_environment(settings) | single | bomb | lifeline.for_child(),
        )
        assert self._process.stdout is not None
        self._output: IO[bytes] = self._process.stdout

    def __enter__(self) -> Child:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()
        self._output.close()

    def messages(self) -> Iterator[Message | None]:
        """What the child says until it ends, and None at least every `LOOK_S`."""
        descriptor, pending, looked = self._output.fileno(), b"", time.monotonic()
        with selectors.DefaultSelector() as selector:
            selector.register(descriptor, selectors.EVENT_READ)
            while True:
                if selector.select(LOOK_S):
                    chunk = os.read(descriptor, 65536)
                    if not chunk or len(pending) > LONGEST_LINE:
                        return
                    *lines, pending = (pending + chunk).split(b"\n")
                    yield from (message for line in lines if (message := _understood(line)))
                if time.monotonic() - looked >= LOOK_S:
                    looked = time.monotonic()
                    yield None

    def how_it_ended(self) -> str:
        """For the job's error, after the output has ended."""
        code = self._process.wait()
        if code == -signal.SIGKILL:
            return "Its process was killed, most likely for lack of memory."
        if code < 0:
            return f"Its process died of {signal.Signals(-code).name}; see the worker's log."
        return f"Its process ended with code {code} and no result; see the worker's log."


def model_sha256(path: Path) -> str:
    """The hash of the model file, as in `provenance`."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _understood(line: bytes) -> Message | None:
    try:
        return Message.model_validate_json(line)
    except ValidationError:
        log.warning("not understood", line=line[:500].decode(errors="replace"))
        return None


def _error(kind: str, detail: str) -> JobError:
    return JobError(type=type_of(kind), title=KINDS[kind].title, detail=detail)


def _as_environment(settings: Settings) -> dict[str, str]:
    """What the child needs to find the same home, however this process was configured."""
    return {
        "ESC_DATA": str(settings.data.absolute()),
        "ESC_DATABASE_URL": settings.home_database_url,
        "ESC_BLOB_URL": settings.home_blob_url,
        "ESC_MODEL": str(settings.model.absolute()),
        "ESC_THREADS": str(settings.threads),
        "ESC_LOG_FORMAT": settings.log_format,
        "ESC_LOG_LEVEL": settings.log_level,
    }


def _only_one(settings: Settings) -> IO[bytes]:
    """Two workers of one name would compute each job twice. The lock ends with the process, however it ends."""
    settings.data.mkdir(parents=True, exist_ok=True)
    lock = (settings.data / f"worker-{settings.worker_name}.lock").open("wb")
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        raise AlreadyRunning(
            f"A worker called {settings.worker_name} already runs on {settings.data}; give this one another name."
        ) from None
    return lock
