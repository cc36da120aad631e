"""The worker process: takes jobs out of the queue, computes each in a child process.

A crash in native code, a time limit or a cancellation costs a child and with it one job, never the worker. The worker
itself may be killed at any moment: its job is begun again, by itself when it comes back or by another worker that finds
its heartbeat silent. Stopped politely, it takes no more jobs, lets those that run end, and hands back those that do not
end in time: nothing is counted against them.
"""

import os
import signal
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import suppress
from typing import TypeVar

import structlog

from service import build
from service.application_state import ApplicationState
from service.observability import tracing
from service.queue import GivenUp, WorkerQueue
from service.schemas.job import JobError
from service.settings import Settings
from service.store.database import DATABASE_OUTAGES, without_timeouts
from service.store.expiry import ExpiryRepository
from service.store.jobs.task import Task, UnreadableJob
from service.worker_lock import REFUSED, lock_identity, lock_worker
from worker.duties.alarms import AlarmTimer
from worker.duties.retention import Retention
from worker.duties.scheduler import Scheduler
from worker.duties.webhook_delivery import WebhookDelivery
from worker.heartbeat import BEAT_S, Heartbeat
from worker.job_files import FileUnavailableError, JobFiles
from worker.job_process import POLL_S, JobProcess, JobPrograms
from worker.lease import JobTimeoutError, Lease, LeaseLostError, Leases
from worker.protocol import Files, Message
from worker.result_checks import fault_in
from worker.spans import Spans

# How long the database may be away, beyond the time the job has anyway, before its end is lost.
OUTAGE_S = 60.0
RETRY_S = 1.0
DUTY_RETRY_S = 10.0
DRAIN_POLL_S = 0.1
Answer = TypeVar("Answer")
log = structlog.get_logger()


def run(settings: Settings) -> None:
    """Work until SIGTERM or SIGINT, asked twice without waiting for jobs; never returns."""
    lock = lock_worker(settings)
    tracing.configure("esc-worker", settings.worker_name)
    worker = Worker(settings, lock_identity(lock))
    stop, hurry = threading.Event(), threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: (hurry if stop.is_set() else stop).set())
    worker.start()
    log.info("worker started", worker=settings.worker_name, threads=settings.threads, build=build.description())
    worker.run_until(stop)
    log.info("worker stops", worker=settings.worker_name, running=worker.running)
    worker.drain(hurry)
    lock.close()
    tracing.flush()
    # Threads may be waiting for children; those end with this process.
    os._exit(REFUSED if worker.was_replaced else 0)


class Worker:
    """A worker process: its queue, heartbeat, leases and duties."""

    def __init__(self, settings: Settings, place: str) -> None:
        self._settings = settings
        self._running: dict[str, Task] = {}
        self._handed_back: set[str] = set()
        home = ApplicationState(settings)
        self._attempts, self._workers, self._enqueue = home.attempts, home.workers, home.queue.enqueue
        self._leases = Leases(home.attempts)
        self._heartbeat = Heartbeat(settings, home.workers, place)
        self._hand_back = home.queue.hand_back
        # Jobs that wait for a worker of a newer version, and those whose rows are broken: each is logged once.
        self._unreadable: set[str] = set()
        self._broken: set[str] = set()
        self._files = JobFiles(settings)
        self._programs = JobPrograms(settings)
        self._queue = WorkerQueue(
            settings.home_database_url, settings.worker_name, settings.jobs_at_once, self._attempt
        )
        expiry = ExpiryRepository(without_timeouts(home.engine))
        self._retention = Retention(settings, expiry, home.blobs, home.workers, self._queue.forget)
        self._webhooks = WebhookDelivery(settings, home, home.outbox.now)
        self._alarms = AlarmTimer(home.venues)
        self._scheduler = Scheduler(home)

    @property
    def was_replaced(self) -> bool:
        """True if another worker of this name has started, so that this one ends."""
        return self._heartbeat.was_replaced

    @property
    def running(self) -> list[str]:
        """The ids of the jobs that are being computed."""
        return list(self._running)

    def start(self) -> None:
        """Send the first heartbeat and take jobs. Raises `AlreadyRunning` if a worker of this name runs elsewhere."""
        self._heartbeat.start()
        self._programs.prepare()
        self._queue.start()

    def run_until(self, stop: threading.Event) -> None:
        """Send heartbeats, take over jobs of dead workers and end those that the queue has given up, until `stop`.

        The duties (retention, webhook delivery, alarms, schedules) run in a thread each beside it.
        """
        for poll in (self._retention.poll, self._webhooks.poll, self._alarms.poll, self._scheduler.poll):
            threading.Thread(target=_run_duty, args=(poll, stop), daemon=True).start()
        last_beat, silence_counts_from = time.monotonic(), 0.0
        while not stop.wait(BEAT_S):
            try:
                # A copy: the threads of jobs add to it.
                unreadable = set(self._unreadable)
                silence = self._heartbeat.beat_and_listen(unreadable)
                if silence is None:
                    return
                beat_before, last_beat = last_beat, time.monotonic()
                if last_beat - beat_before > 2 * BEAT_S:
                    # The database was away and nobody could send a heartbeat: silence proves nothing yet.
                    silence_counts_from = last_beat + self._settings.takeover_after_s
                if last_beat >= silence_counts_from:
                    self._take_over(silence.silent_workers)
                self._unreadable -= unreadable - self._attempts.still_waiting(unreadable)
                self._reconcile(silence.silent_jobs)
            except Exception:  # the database is away: the next round tries again
                log.warning("cannot look after the jobs", exc_info=True)

    def drain(self, hurry: threading.Event) -> None:
        """Take no more jobs, and let those that run end until `drain_s` are over or `hurry` is set.

        What has not ended by then goes back into the queue.
        """
        self._queue.stop_taking()
        over = time.monotonic() + self._settings.drain_s
        self._scheduler.finish(self._settings.drain_s)
        last_beat = 0.0
        while not self._queue.is_idle() and time.monotonic() < over and not hurry.wait(DRAIN_POLL_S):
            if time.monotonic() - last_beat >= BEAT_S:
                with suppress(*DATABASE_OUTAGES):
                    self._heartbeat.beat()
                last_beat = time.monotonic()
        for job_id, task in list(self._running.items()):
            with suppress(*DATABASE_OUTAGES):
                self._release(job_id, task)
        with suppress(*DATABASE_OUTAGES):
            self._heartbeat.end()

    def _release(self, job_id: str, task: Task) -> None:
        self._handed_back.add(job_id)
        if self._attempts.hand_back(task):
            self._hand_back(job_id, task.kind)
            log.info("job handed back", job=job_id, venue=task.venue.id if task.venue else None)

    def _take_over(self, dead: Sequence[str]) -> None:
        if dead:
            log.warning("taking over", workers=dead)
            self._queue.take_over(dead)
            for name in dead:
                self._workers.forget(name, self._settings.takeover_after_s)

    def _reconcile(self, silent: Sequence[str]) -> None:
        given_up = self._queue.given_up(silent) if silent else {}
        for job_id, ended in given_up.items():
            try:
                self._end_or_requeue(job_id, ended)
            except DATABASE_OUTAGES:
                raise
            except UnreadableJob as error:
                self._leave_unreadable(job_id, error)
            except Exception:  # one job whose rows are broken must not keep the others from their end
                if job_id not in self._broken:
                    self._broken.add(job_id)
                    log.exception("cannot end or begin a job that the queue has given up", job=job_id)

    def _end_or_requeue(self, job_id: str, given_up: GivenUp) -> None:
        """Requeue a job that was never begun, end one that was; raises `UnreadableJob`."""
        unchanged_s = self._settings.takeover_after_s
        stranded = self._attempts.reclaim(job_id, unchanged_s) if given_up.can_wait else None
        if stranded is not None:
            # The worker that had it may be one of an older version, which cannot read it.
            log.warning("putting a job back into the queue", job=job_id, why=given_up.why)
            self._queue.forget([job_id])
            self._attempts.enqueue(job_id, stranded, self._enqueue)
            return
        error = JobError.of("job-abandoned", f"{given_up.why}; see the worker's log.")
        # A slow job may have ended while the queue was asked, or another worker has put it back.
        if self._attempts.abandon(job_id, error, unchanged_s):
            log.error("job given up", job=job_id, why=given_up.why)

    def _leave_unreadable(self, job_id: str, error: UnreadableJob) -> None:
        """Leave a job in the queue for a worker that can read it; this worker skips it from now on."""
        if job_id not in self._unreadable:
            self._unreadable.add(job_id)
            log.error("job left to a worker of a newer version", job=job_id, not_understood=str(error))

    def _attempt(self, job_id: str) -> None:
        """Run one attempt of a job, from its beginning until its end is in the database."""
        begun = time.monotonic()
        try:
            task = _retry_until(lambda: self._attempts.begin(job_id), begun + OUTAGE_S)
        except UnreadableJob as error:
            self._leave_unreadable(job_id, error)
            return
        if task is None:
            return
        self._running[job_id] = task
        try:
            self._compute_and_record(task, begun)
        finally:
            del self._running[job_id]
            if job_id in self._handed_back:
                # The queue would take a job for done whose thread ends: this one ends with the process.
                threading.Event().wait()

    def _compute_and_record(self, task: Task, begun: float) -> None:
        limit_s = task.options.timeout_s or self._settings.job_timeout_s
        subject = {"job": task.job_id, "kind": task.kind, "venue": task.venue.id if task.venue else None}
        with structlog.contextvars.bound_contextvars(**subject, **task.origin.names()), Spans(task) as spans:
            log.info("job begins")
            try:
                last = self._compute(task, limit_s, spans)
                spans.end(last)
                _retry_until(lambda: self._record_end(task, last), begun + limit_s + OUTAGE_S)
            except Exception as error:  # an attempt that raises would leave the job open and nobody at it
                log.exception("job broke off")
                # In the words of the operating system, but not in those of a server.
                why = str(error) if isinstance(error, OSError) else type(error).__name__
                crashed = JobError.of("job-crashed", f"The attempt broke off: {why}; see the worker's log.")
                _retry_until(lambda: self._attempts.fail(task, crashed), time.monotonic() + OUTAGE_S)
                last = Message(error=crashed)
            outcome = {"verdict": "taken away"} if last is None else last.outcome
            log.info("job ends", **outcome, seconds=round(time.monotonic() - begun, 2))

    def _compute(self, task: Task, limit_s: float, spans: Spans) -> Message | None:
        """Return the last message about the job; None if the lease was lost."""
        try:
            with self._leases.begin(task, limit_s) as lease:
                files = _run_with_checks(lambda: self._files.frames(task), lease.check)
                last, pictures = self._run_program(task, files, lease, spans)
                return self._store_pictures(task, last, pictures, lease)
        except LeaseLostError:
            return None
        except JobTimeoutError:
            return Message(error=JobError.of("job-timeout", f"It was ended after {limit_s:g} s; see timeout_s."))
        except FileUnavailableError as missing:
            return Message(error=JobError.of(missing.kind, str(missing), missing.camera))

    def _store_pictures(self, task: Task, last: Message, pictures: dict[str, bytes], lease: Lease) -> Message:
        """Store the pictures. A result outlives pictures that cannot be stored: it gets a warning instead."""
        try:
            _run_with_checks(lambda: self._files.keep(task, pictures), lease.check)
        except FileUnavailableError as missing:
            if last.result is None:
                raise
            log.warning("pictures are missing", why=str(missing))
            return last.without_pictures(str(missing))
        return last

    def _run_program(self, task: Task, files: Files, lease: Lease, spans: Spans) -> tuple[Message, dict[str, bytes]]:
        """Run the job program; return its last message and the pictures that came with it."""
        with JobProcess(self._programs, task, files) as child:
            for message in child.messages():
                if message is None:
                    lease.check()
                elif message.last:
                    if (fault := fault_in(message, task)) is not None:
                        detail = f"Its program reports what cannot be stored: {fault}. Nothing was stored."
                        return Message(error=JobError.of("job-crashed", detail)), {}
                    return message, child.pictures
                elif message.warning is not None:
                    log.warning("said by its program", what=message.warning)
                elif message.progress is not None:
                    spans.at(message.progress.stage)
                    lease.report(message.progress)
                    lease.check()
            return Message(error=JobError.of("job-crashed", child.exit_reason())), {}

    def _record_end(self, task: Task, last: Message | None) -> None:
        if last is None:
            log.info("job taken away")
        elif last.result is not None:
            self._attempts.finish(task, last.result, [*last.pictures, *last.later], last.memories)
        elif last.error is not None:
            self._attempts.fail(task, last.error)


def _retry_until(write: Callable[[], Answer], until: float) -> Answer:
    """Call `write`, retry while the database is away, until the monotonic time `until`."""
    while True:
        try:
            return write()
        except DATABASE_OUTAGES:
            if time.monotonic() > until:
                raise
            log.warning("the database is away, trying again", exc_info=True)
            time.sleep(RETRY_S)


def _run_duty(poll: Callable[[], float], stop: threading.Event) -> None:
    """Call `poll` until `stop` is set; it returns the seconds until its next call. Retry after errors."""
    pause_s = 0.0
    while not stop.wait(pause_s):
        try:
            pause_s = poll()
        except Exception:  # the database or the store is away: the next call tries again
            log.warning("duty failed, it is tried again", duty=poll.__qualname__, exc_info=True)
            pause_s = DUTY_RETRY_S


def _run_with_checks(work: Callable[[], Answer], check: Callable[[], None]) -> Answer:
    """Run `work`, which may wait for the store, in a thread, and call `check` until it is done; return its result.

    If `check` raises, `work` goes on in its thread and its result is dropped.
    """
    pool = ThreadPoolExecutor(1)
    future = pool.submit(work)
    pool.shutdown(wait=False)
    while not wait([future], POLL_S).done:
        check()
    return future.result()
