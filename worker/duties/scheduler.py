"""The scheduler fetches the frames of calibrations that are due by schedule and submits their jobs.

A due time is never dropped because there is no room for it: what cannot be a job now is postponed until it can.
Cameras that give no frame, or take long, wait in a slow lane of their own, so that no other venue waits for them. Many
venues are probed at once: most of them by a TCP connection, before a process is started to fetch anything.
"""

import threading
import time
from datetime import UTC, timedelta
from functools import partial
from typing import NoReturn

import structlog

from service.application_state import ApplicationState
from service.intake.snapshots import SourceLate
from service.schemas.job import Job
from service.schemas.options import Options
from service.schemas.problems import PROBLEM_TYPES, Problem
from service.schemas.schedule import Schedule
from service.schemas.venue import Venue
from service.store.jobs.task import SCHEDULE, Origin
from service.store.schedules import Due, Firing
from service.store.unreadable import UnreadableRow
from worker.duties.clock_watch import ClockWatch
from worker.duties.reachability import HostReachability
from worker.duties.thread_pool import BoundedThreadPool

POLL_S = 2.0
# The cameras of so many venues are probed at the same time: threads that wait.
TRIED_AT_ONCE = 64
# As many venues have their frames fetched at the same time, in each lane: each is a process.
AT_ONCE = 4
# What takes longer goes on in the slow lane.
QUICK_S = 4.0
# Longer than it takes to fetch frames and to store them.
ATTEMPT = timedelta(minutes=10)
DEFER = timedelta(seconds=30)
# Problems that end by themselves: jobs that wait or run, and other fetches.
TRANSIENT = ("queue-full", "venue-busy", "venue-replaced", "unavailable")
# Problems of the submission itself: the venue was deleted, or a person has used the key of the schedule.
REFUSED = ("venue-not-found", "idempotency-key-reused")
log = structlog.get_logger()


class DeferredError(Exception):
    """No job can be submitted yet, for a transient reason, which the message names."""


class TooSlowError(Exception):
    """The cameras were too slow for the quick lane."""


class Scheduler:
    """Fires schedules that are due by the clock of the database."""

    def __init__(self, home: ApplicationState) -> None:
        self._home, self._settings, self._schedules = home, home.settings, home.schedules
        self._reachability = HostReachability(home.settings.sources)
        self._quick = BoundedThreadPool(TRIED_AT_ONCE, "schedule")
        self._quick_fetches = threading.BoundedSemaphore(AT_ONCE)
        self._slow = BoundedThreadPool(AT_ONCE, "slow-schedule")
        self._clock = ClockWatch()

    def poll(self) -> float:
        """Begin to fire what is due; return the seconds until the next poll."""
        due = self._schedules.due()
        if self._clock.was_put_back(due.now):
            wrong = self._schedules.repair_due_times(due.now, ATTEMPT)
            if wrong:
                log.warning("the clock was put back, schedules are reckoned anew", schedules=wrong)
                due = self._schedules.due()
        begun = self._begin(due) if due.quick or due.slow else 0
        if not begun and self._quick.free_threads:
            return POLL_S
        self._quick.wait_for_free(POLL_S)
        return 0.0

    def finish(self, at_most_s: float | None = None) -> None:
        """Wait for the schedules that are being fired, at most so many seconds."""
        self._quick.wait_all(at_most_s)
        self._slow.wait_all(at_most_s)

    def _begin(self, due: Due) -> int:
        """Fire what there is room for; return how many of the quick lane."""
        # What finds no room in the queue would have had its frames fetched in vain.
        room = (
            self._settings.queue_limit - self._home.submissions.waiting() - (TRIED_AT_ONCE - self._quick.free_threads)
        )
        fired = 0
        for lane, waiting, slow in ((self._quick, due.quick, False), (self._slow, due.slow, True)):
            limit = min(room, lane.free_threads)
            if not waiting or limit <= 0:
                continue
            firings = self._schedules.claim_due(due.now, due.now + ATTEMPT, limit, slow=slow)
            for firing in firings:
                lane.begin(partial(self._fire, firing, slow=slow), firing.venue)
            room -= len(firings)
            fired += 0 if slow else len(firings)
        return fired

    def _fire(self, firing: Firing, *, slow: bool) -> None:
        with structlog.contextvars.bound_contextvars(venue=firing.venue):
            try:
                venue = self._home.venues.get(firing.venue)
                if venue is None or venue.schedule is None:
                    return
                job = self._job(firing, venue, venue.schedule, slow=slow)
            except UnreadableRow as unreadable:
                self._schedules.done(firing, self._schedules.now(), None, f"The {unreadable}.")
            except TooSlowError:
                self._schedules.postpone(firing, self._schedules.now(), "Its cameras are slow or silent.")
                log.info("schedule goes to the slow lane")
            except DeferredError as deferred:
                self._schedules.postpone(firing, self._schedules.now() + DEFER, str(deferred))
                log.warning("schedule put off", why=str(deferred))
            except Problem as refusal:
                self._schedules.done(firing, self._schedules.now(), None, _in_words(refusal))
                log.warning("schedule fired in vain", why=_in_words(refusal))
            else:
                error = None if job.error is None else job.error.detail
                self._schedules.done(firing, self._schedules.now(), job.id, error)
                log.info("schedule fired", job=job.id, error=error)

    def _job(self, firing: Firing, venue: Venue, schedule: Schedule, *, slow: bool) -> Job:
        """Return the submitted job, one that has failed if its frames could not be fetched."""
        if self._home.disk.is_short():
            raise DeferredError("Less is free on the disk than must be.")
        if slow:
            return self._fetched_job(firing, venue, schedule, slow=True)
        sources = _sources(venue)
        if self._reachability.is_silent(sources) or not self._reachability.connect(sources):
            self._to_slow_lane(firing)
        with self._quick_fetches:
            # Fetches that ended meanwhile may have found the host silent.
            if self._reachability.is_silent(sources):
                self._to_slow_lane(firing)
            return self._fetched_job(firing, venue, schedule, slow=False)

    def _to_slow_lane(self, firing: Firing) -> NoReturn:
        self._schedules.not_fetched(firing)
        raise TooSlowError

    def _fetched_job(self, firing: Firing, venue: Venue, schedule: Schedule, *, slow: bool) -> Job:
        options = schedule.options or Options()
        # Fired again after a worker died over it, it is the same job.
        name = f"schedule-{firing.due_at.astimezone(UTC):%Y%m%dT%H%M%SZ}"
        origin = Origin(request_id=name, asked_by=SCHEDULE)
        begun, quick_s = time.monotonic(), QUICK_S + (schedule.frames - 1) * schedule.spacing_s

        def fetched() -> None:
            self._reachability.note_answers(_sources(venue))
            self._schedules.fetched(firing, slowly=slow and time.monotonic() - begun > quick_s)

        try:
            return self._home.from_sources.calibrate(
                venue.id,
                options,
                name,
                origin,
                frames=schedule.frames,
                spacing_s=schedule.spacing_s,
                within_s=None if slow else QUICK_S,
                fetched=fetched,
            )[0]
        except Problem as problem:
            if problem.kind in TRANSIENT:
                raise DeferredError(_in_words(problem)) from None
            if problem.kind in REFUSED:
                raise
            if problem.kind == "source-failed":
                self._schedules.not_fetched(firing)
            if isinstance(problem, SourceLate) and "source" in problem.parts:
                self._reachability.note_late(problem.parts["source"])
            if isinstance(problem, SourceLate) and not slow and self._settings.source_timeout_s > QUICK_S:
                raise TooSlowError from None
            return self._home.from_sources.fail(venue, options, name, origin, problem)


def _in_words(problem: Problem) -> str:
    return f"{PROBLEM_TYPES[problem.kind].title}. {problem.detail}"


def _sources(venue: Venue) -> list[str]:
    return [camera.source for camera in venue.cameras if camera.source is not None]
