"""The worker: takes jobs out of the queue and computes each in a child process of its own.

A crash in native code, a time limit or a cancellation costs a child and with it one job, never the worker. The worker
itself may be killed at any moment: its job is begun again, by itself when it comes back or by another worker that finds
its heartbeat silent. Stopping it politely is the same: there is no second way to end.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import signal
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import suppress
from pathlib import Path
from typing import IO, TypeVar

import structlog

from service.home import Home
from service.observe import tracing
from service.queue import WorkerQueue
from service.settings import Settings
from service.store.engine import AWAY
from service.store.jobs.attempts import Attempts
from service.store.jobs.task import Task
from service.wire.job import JobError, Progress
from service.wire.problems import KINDS, first_line, type_of
from worker.child import LOOK_S, Child
from worker.duties.alarms import Alarms
from worker.duties.delivering import Delivering
from worker.duties.retention import Retention
from worker.duties.scheduled import Scheduled
from worker.files import JobFiles, NotStored
from worker.message import Files, Message
from worker.spans import Spans

BEAT_S = 2.0
PROGRESS_S = 0.25
# How long the database may be away, beyond the time the job has anyway, before its end is lost.
OUTAGE_S = 60.0
TRY_AGAIN_S = 1.0
PUT_OFF_S = 10.0
Answer = TypeVar("Answer")
log = structlog.get_logger()


class AlreadyRunning(Exception):  # noqa: N818
    """A worker of this name runs on this machine."""


def run(settings: Settings) -> None:
    """Work until SIGTERM or SIGINT; never returns."""
    lock = _only_one(settings)
    tracing.configure("esc-worker", settings.worker_name)
    worker = Worker(settings)
    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.set())
    worker.start()
    log.info("worker started", worker=settings.worker_name, threads=settings.threads)
    worker.look_after(stop)
    log.info("worker stops", worker=settings.worker_name)
    lock.close()
    tracing.flush()
    # Threads may be waiting for children; those end with this process and their jobs are begun again.
    os._exit(0)


class Worker:
    """Everything that one worker process holds."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        home = Home(settings)
        self._attempts, self._workers = home.attempts, home.workers
        self._files = JobFiles(settings)
        self._queue = WorkerQueue(
            settings.home_database_url, settings.worker_name, settings.jobs_at_once, self._attempt
        )
        self._retention = Retention(settings, home.expiry, home.blobs, home.workers, self._queue.forget)
        self._delivering = Delivering(settings, home.deliveries, home.jobs, home.following, home.deliveries.now)
        self._alarms = Alarms(home.venues)
        self._scheduled = Scheduled(
            settings, home.schedules, home.venues, home.submissions, home.from_sources, home.disk
        )

    def start(self) -> None:
        """Show up and take jobs."""
        self._enter()
        self._queue.start()

    def look_after(self, stop: threading.Event) -> None:
        """Give signs of life, take over from the dead, end what the queue has given up.

        Beside that, in threads of their own, tidy up, tell who asked for it of the ends of jobs and of alarms, see
        which alarms have come of time that has passed, and submit what schedules ask for.
        """
        for look in (self._retention.look, self._delivering.look, self._alarms.look, self._scheduled.look):
            threading.Thread(target=_again_and_again, args=(look, stop), daemon=True).start()
        beaten, judging_from = time.monotonic(), 0.0
        while not stop.wait(BEAT_S):
            try:
                if not self._workers.beat(self._settings.worker_name):
                    self._enter()
                before, beaten = beaten, time.monotonic()
                if beaten - before > 2 * BEAT_S:
                    # The database was away and nobody could give a sign of life: silence proves nothing yet.
                    judging_from = beaten + self._settings.takeover_after_s
                if beaten >= judging_from:
                    self._take_over()
                self._reconcile()
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
        silent = self._attempts.unchanged_for(self._settings.takeover_after_s)
        given_up = self._queue.given_up(silent) if silent else {}
        for job_id, why in given_up.items():
            # A slow job may have ended while the queue was asked.
            if self._attempts.abandon(job_id, _error("job-abandoned", f"{why}; see the worker's log.")):
                log.error("job given up", job=job_id, why=why)

    def _attempt(self, job_id: str) -> None:
        """One attempt of a job, from its beginning to a state that is written down."""
        begun = time.monotonic()
        task = _insist(lambda: self._attempts.begin(job_id), begun + OUTAGE_S)
        if task is None:
            return
        limit_s = task.options.timeout_s or self._settings.job_timeout_s
        with structlog.contextvars.bound_contextvars(job=job_id, **task.origin.names()), Spans(task) as spans:
            log.info("job begins", kind=task.kind, venue=task.venue.id if task.venue else None)
            try:
                last = self._compute(task, limit_s, spans)
                spans.end(last)
                _insist(lambda: self._write_down(task, last), begun + limit_s + OUTAGE_S)
            except Exception as error:  # an attempt that raises would leave the job open and nobody at it
                log.exception("job broke off")
                crashed = _error("job-crashed", f"The attempt broke off: {first_line(error)}")
                _insist(lambda: self._attempts.fail(task, crashed), time.monotonic() + OUTAGE_S)
            log.info("job ends", seconds=round(time.monotonic() - begun, 2))

    def _compute(self, task: Task, limit_s: float, spans: Spans) -> Message | None:
        """The last word about the job; None if it was taken away."""
        hold = Hold(self._attempts, task, limit_s)
        try:
            files = _looking(lambda: self._files.frames(task), hold.look)
            last, pictures = self._computed(task, files, hold, spans)
            _looking(lambda: self._files.keep(task, pictures), hold.look)
        except TakenAway:
            return None
        except TooLate:
            return Message(error=_error("job-timeout", f"It was ended after {limit_s:g} s; see timeout_s."))
        except NotStored as missing:
            return Message(error=_error("job-crashed", str(missing), missing.camera))
        return last

    def _computed(self, task: Task, files: Files, hold: Hold, spans: Spans) -> tuple[Message, dict[str, bytes]]:
        """What its program says last, and the pictures that come with it."""
        shown = 0.0
        with Child(self._settings, task, files) as child:
            for message in child.messages():
                if message is None:
                    hold.look()
                elif message.last:
                    return message, child.pictures
                elif message.warning is not None:
                    log.warning("said by its program", what=message.warning)
                elif message.progress is not None:
                    spans.at(message.progress.stage)
                    if time.monotonic() - shown >= PROGRESS_S:
                        self._show(task, message.progress)
                        shown = time.monotonic()
            return Message(error=_error("job-crashed", child.how_it_ended())), {}

    def _show(self, task: Task, progress: Progress) -> None:
        with suppress(*AWAY):
            self._attempts.report(task, progress)

    def _write_down(self, task: Task, last: Message | None) -> None:
        if last is None:
            log.info("job taken away")
        elif last.result is not None:
            self._attempts.finish(task, last.result, [*last.pictures, *last.later], last.memories)
        elif last.error is not None:
            self._attempts.fail(task, last.error)


class TakenAway(Exception):  # noqa: N818
    """The job was cancelled, or is another attempt's."""


class TooLate(Exception):  # noqa: N818
    """The job has had its time."""


class Hold:
    """An attempt's hold on its job: looked at often, and now and then renewed, which costs the database a write."""

    def __init__(self, attempts: Attempts, task: Task, limit_s: float) -> None:
        self._attempts = attempts
        self._task = task
        self._renewed = time.monotonic()
        self._deadline = self._renewed + limit_s

    def look(self) -> None:
        """Raise `TakenAway` or `TooLate` if the attempt is not to go on."""
        if self._lost():
            raise TakenAway
        if time.monotonic() > self._deadline:
            raise TooLate

    def _lost(self) -> bool:
        """Whether the job went to a cancellation or to another attempt; while the database is away, nobody can say."""
        try:
            if time.monotonic() - self._renewed < BEAT_S:
                return not self._attempts.holds(self._task)
            self._renewed = time.monotonic()
            return not self._attempts.keep(self._task)
        except AWAY:
            log.warning("cannot give a sign of life", exc_info=True)
            return False


def model_sha256(path: Path) -> str:
    """The hash of the model file, as in `provenance`."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _insist(write: Callable[[], Answer], until: float) -> Answer:
    """Do it, again and again while the database is away, until the monotonic time `until`."""
    while True:
        try:
            return write()
        except AWAY:
            if time.monotonic() > until:
                raise
            log.warning("the database is away, trying again", exc_info=True)
            time.sleep(TRY_AGAIN_S)


def _again_and_again(look: Callable[[], float], stop: threading.Event) -> None:
    """A duty that no job waits for; `look` says after how many seconds it wants to be called again."""
    pause_s = 0.0
    while not stop.wait(pause_s):
        try:
            pause_s = look()
        except Exception:  # the database or the store is away: the next call tries again
            log.warning("put off", duty=look.__qualname__, exc_info=True)
            pause_s = PUT_OFF_S


def _looking(work: Callable[[], Answer], look: Callable[[], None]) -> Answer:
    """Do what may have to wait for the store, and `look` meanwhile; if that raises, it is left to itself."""
    aside = ThreadPoolExecutor(1)
    done = aside.submit(work)
    aside.shutdown(wait=False)
    while not wait([done], LOOK_S).done:
        look()
    return done.result()


def _error(kind: str, detail: str, camera: str | None = None) -> JobError:
    return JobError(type=type_of(kind), title=KINDS[kind].title, detail=detail, camera=camera)


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
