"""Calibrations by schedule: what is due is fetched and put into the queue, by one worker for all.

A time that came is never dropped because there is no room for it: what cannot be a job now is put off until it can.
"""

from __future__ import annotations

from datetime import UTC, timedelta
from functools import partial

import structlog

from service.intake.from_sources import FromSources
from service.observe.disk import Disk
from service.settings import Settings
from service.store.jobs.submission import QueueFull, Refusal, Submissions, VenueBusy, VenueReplaced
from service.store.jobs.task import Origin
from service.store.schedules import Firing, Schedules
from service.store.venues import Venues
from service.wire.job import Job
from service.wire.options import Options
from service.wire.problems import Problem
from service.wire.venue import Venue
from worker.duties.hands import Hands

LOOK_S = 1.0
# As many venues have their frames fetched at the same time.
AT_ONCE = 4
# Longer than it takes to fetch frames and to store them.
ATTEMPT = timedelta(minutes=10)
PUT_OFF = timedelta(seconds=30)
# What ends by itself: jobs that wait or run, and files past their time.
PASSING = (QueueFull, VenueBusy, VenueReplaced)
log = structlog.get_logger()


class Passing(Exception):  # noqa: N818
    """Why there is no job yet: what will be over by itself."""


class Scheduled:
    """Fires what is due by the clock of the database."""

    def __init__(
        self,
        settings: Settings,
        schedules: Schedules,
        venues: Venues,
        submissions: Submissions,
        from_sources: FromSources,
        disk: Disk,
    ) -> None:
        self._settings = settings
        self._schedules = schedules
        self._venues = venues
        self._submissions = submissions
        self._from_sources = from_sources
        self._disk = disk
        self._fetchers = Hands(AT_ONCE, "schedule")

    def look(self) -> float:
        """Begin to fire what is due; returns the seconds until it is worth looking again."""
        now = self._schedules.now()
        # What finds no room in the queue would have had its frames fetched in vain.
        room = self._settings.queue_limit - self._submissions.waiting() - (AT_ONCE - self._fetchers.free)
        due = self._schedules.fire(now, now + ATTEMPT, max(0, min(room, self._fetchers.free)))
        for firing in due:
            self._fetchers.begin(partial(self._fire, firing), firing.venue_id)
        if not due and self._fetchers.free:
            return LOOK_S
        self._fetchers.until_one_is_free(LOOK_S)
        return 0.0

    def finish(self) -> None:
        """Wait for those that are being fired."""
        self._fetchers.rest()

    def _fire(self, firing: Firing) -> None:
        with structlog.contextvars.bound_contextvars(venue=firing.venue_id):
            venue = self._venues.get(firing.venue_id)
            if venue is None or venue.schedule is None:
                return
            try:
                job = self._job(firing, venue, venue.schedule.options or Options())
            except Passing as passing:
                self._schedules.put_off(firing, self._schedules.now() + PUT_OFF, str(passing))
                log.warning("schedule put off", why=str(passing))
            except Refusal as refusal:
                self._schedules.done(firing, self._schedules.now(), None, refusal.__doc__)
                log.warning("schedule fired in vain", why=refusal.__doc__)
            else:
                error = None if job.error is None else job.error.detail
                self._schedules.done(firing, self._schedules.now(), job.id, error)
                log.info("schedule fired", job=job.id, error=error)

    def _job(self, firing: Firing, venue: Venue, options: Options) -> Job:
        """What became of it: a job, which has failed where the frames could not be had."""
        if self._disk.short():
            raise Passing("Less is free on the disk than must be.")
        # Fired again after a worker died over it, it is the same job.
        name = f"schedule-{firing.due_at.astimezone(UTC):%Y%m%dT%H%M%SZ}"
        origin = Origin(request_id=name, asked_by="schedule")
        try:
            return self._from_sources.calibrate(venue.id, options, name, origin)[0]
        except PASSING as refusal:
            raise Passing(refusal.__doc__) from None
        except Problem as problem:
            if problem.kind == "unavailable":
                raise Passing(problem.detail) from None
            return self._from_sources.fail(venue, options, name, origin, problem)
