"""Retention: what is past its time goes, a bounded piece per round, by one worker at a time.

A round that breaks off anywhere is finished by the next one; two at once (a worker that was taken for dead) do the same
twice and no harm.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from datetime import datetime, timedelta

import structlog

from service.observe.disk import Disk
from service.settings import Settings
from service.store.blobs import Blobs
from service.store.expiry import Expiry
from service.store.workers import Workers

# Of each kind per round: some seconds on a bucket, a fraction of one in a folder.
BATCH = 100
# Rows alone, several of each job.
EVENTS = 1000
YEAR = timedelta(days=365.25)
# Between two rounds while there is more to do: what others write gets its turn.
BREATH_S = 2.0
# Between two looks at whether a round is due.
LOOK_S = 10.0
TRY_AGAIN_AFTER = timedelta(hours=1)
# A store that is away is asked about so many folders per round.
FAILURES = 3
log = structlog.get_logger()


class Retention:
    """Deletes frames, pictures, jobs, revisions and events after the time that the settings keep them."""

    def __init__(
        self,
        settings: Settings,
        expiry: Expiry,
        blobs: Blobs,
        workers: Workers,
        forget_queued: Callable[[Collection[str]], None],
    ) -> None:
        self._settings = settings
        self._expiry = expiry
        self._blobs = blobs
        self._workers = workers
        self._disk = Disk(settings)
        self._forget_queued = forget_queued
        self._due = 0.0

    def look(self) -> float:
        """Do a round if one is due and this worker's to do; returns the seconds until it is worth looking again."""
        short = self._disk.short()
        if (time.monotonic() < self._due and not short) or not self._chosen():
            return min(LOOK_S, self._settings.tidy_every_s)
        if self.round(self._expiry.now(), short_of_room=short):
            return BREATH_S
        self._due = time.monotonic() + self._settings.tidy_every_s
        return min(LOOK_S, self._settings.tidy_every_s)

    def round(self, now: datetime, *, short_of_room: bool = False) -> bool:
        """Delete up to a batch of each kind; says whether there is more.

        Short of room, the frames of jobs that have ended go before their time, the oldest first: nobody computes with
        them any more, and without room no job could follow.
        """
        keep = self._settings
        keep_frames_days = 0 if short_of_room else keep.keep_frames_days
        counts = {
            "frames": self._expiry.expire_frames(now - timedelta(days=keep_frames_days), now, BATCH),
            "pictures": self._expiry.expire_pictures(now - timedelta(days=keep.keep_pictures_days), now, BATCH),
            "jobs": self._delete_jobs(now - timedelta(days=keep.keep_jobs_days), now),
            "revisions": self._expiry.expire_revisions(now - keep.keep_revisions_years * YEAR, BATCH),
            "events": self._expiry.expire_events(now - timedelta(days=keep.keep_events_days), EVENTS),
            "folders": self._sweep(now),
        }
        if any(counts.values()):
            log.info("deleted what is past its time", short_of_room=short_of_room, **counts)
        return any(count >= BATCH for count in counts.values())

    def _chosen(self) -> bool:
        """Whether this worker, of those alive, is the one to do it: the first by name."""
        alive = self._workers.alive(self._settings.takeover_after_s)
        return min((worker.name for worker in alive), default="") == self._settings.worker_name

    def _delete_jobs(self, ended_before: datetime, now: datetime) -> int:
        job_ids = self._expiry.old_jobs(ended_before, BATCH)
        if job_ids:
            # The queue first: without our row nobody would ever ask it to forget.
            self._forget_queued(job_ids)
            self._expiry.delete_jobs(job_ids, now)
        return len(job_ids)

    def _sweep(self, now: datetime) -> int:
        swept = failed = 0
        for folder in self._expiry.leftovers(now, BATCH):
            if failed == FAILURES:
                # The store is away: those behind these keep their place.
                break
            try:
                self._blobs.delete_under(folder)
            except Exception:  # whatever the store says about this folder, the others need not wait for it
                log.warning("cannot delete", folder=folder, exc_info=True)
                self._expiry.postpone(folder, now + TRY_AGAIN_AFTER)
                failed += 1
            else:
                self._expiry.swept(folder)
                swept += 1
        return swept
