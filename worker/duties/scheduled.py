"""Calibrations by schedule: what is due is fetched and put into the queue, by one worker for all."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, timedelta

import structlog

from service.intake.from_sources import FromSources
from service.observe.disk import Disk
from service.store.jobs.submission import Refusal
from service.store.jobs.task import Origin
from service.store.schedules import Firing, Schedules
from service.store.venues import Venues
from service.wire.options import Options
from service.wire.problems import Problem

LOOK_S = 1.0
# As many venues have their frames fetched at the same time.
AT_ONCE = 4
# Longer than it takes to fetch frames and to store them.
ATTEMPT = timedelta(minutes=10)
log = structlog.get_logger()


class Scheduled:
    """Fires what is due by the clock of the database."""

    def __init__(self, schedules: Schedules, venues: Venues, from_sources: FromSources, disk: Disk) -> None:
        self._schedules = schedules
        self._venues = venues
        self._from_sources = from_sources
        self._disk = disk
        self._fetchers = ThreadPoolExecutor(AT_ONCE, thread_name_prefix="schedule")

    def look(self) -> float:
        """Fire what is due; returns the seconds until it is worth looking again."""
        now = self._schedules.now()
        due = self._schedules.fire(now, now + ATTEMPT, AT_ONCE)
        for fired in [self._fetchers.submit(self._fire, firing) for firing in due]:
            fired.result()
        return 0.0 if len(due) == AT_ONCE else LOOK_S

    def _fire(self, firing: Firing) -> None:
        with structlog.contextvars.bound_contextvars(venue=firing.venue_id):
            try:
                job_id, error = self._calibrate(firing), None
            except Problem as problem:
                job_id, error = None, problem.detail
            except Refusal as refusal:
                job_id, error = None, f"{type(refusal).__name__}: {refusal.__doc__}"
            if error is not None:
                log.warning("schedule fired in vain", why=error)
            self._schedules.done(firing, self._schedules.now(), job_id, error)

    def _calibrate(self, firing: Firing) -> str | None:
        venue = self._venues.get(firing.venue_id)
        if venue is None:
            return None
        if self._disk.short():
            raise Problem("disk-full", "Less is free on the disk than must be.")
        # Fired again after a worker died over it, it is the same job.
        name = f"schedule-{firing.due_at.astimezone(UTC):%Y%m%dT%H%M%SZ}"
        job, _ = self._from_sources.calibrate(venue, Options(), name, Origin(request_id=name))
        log.info("schedule fired", job=job.id)
        return job.id
