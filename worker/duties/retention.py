"""Retention deletes what is past its time, a bounded batch per round, in one worker at a time.

A round that breaks off anywhere is finished by the next one; two at once (a worker that was taken for dead) do the same
twice and no harm.
"""

import time
from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime, timedelta
from typing import TypeVar

import structlog

from service.observability.disk import Disk
from service.settings import Settings
from service.store.blobs import BLOB_OUTAGES, Blobs
from service.store.expiry import ExpiryRepository, OldFrames
from service.store.jobs.files import drawn_together, picture_file, source_file
from service.store.workers import WorkerRepository

# Most of each kind per round: they take some seconds on a bucket, a fraction of one in a folder.
BATCH = 100
# Two when its files are past their time, and two more when it is: a round that finds a batch of each deletes as many.
FOLDERS_OF_A_JOB = 4
# A bucket takes tens of milliseconds for each, and a disk to be sure of a file that was moved.
AT_ONCE = 16
# Rows alone, several of each job.
EVENTS = 1000
YEAR = timedelta(days=365.25)
# Between two rounds while there is more to do: what others write gets its turn.
BETWEEN_ROUNDS_S = 2.0
# Between two polls whether a round is due.
POLL_S = 10.0
TRY_AGAIN_AFTER = timedelta(hours=1)
# So many among those that are moved or deleted at once, and the store is away.
MAX_FAILURES = 3
T = TypeVar("T")
log = structlog.get_logger()


class Retention:
    """Deletes frames, pictures, jobs, revisions, deliveries, events and live minutes that are past their time."""

    def __init__(
        self,
        settings: Settings,
        expiry: ExpiryRepository,
        blobs: Blobs,
        workers: WorkerRepository,
        forget_queued: Callable[[Collection[str]], None],
    ) -> None:
        self._settings = settings
        self._expiry = expiry
        self._blobs = blobs
        self._workers = workers
        self._disk = Disk(settings)
        self._forget_queued = forget_queued
        self._due = 0.0
        self._pool = ThreadPoolExecutor(AT_ONCE, thread_name_prefix="retention")

    def poll(self) -> float:
        """Run a round if one is due and this worker is elected; return the seconds until the next poll."""
        short = self._disk.is_short()
        if (time.monotonic() < self._due and not short) or not self._is_elected():
            return min(POLL_S, self._settings.tidy_every_s)
        if self.round(self._expiry.now(), short_of_room=short):
            return BETWEEN_ROUNDS_S
        self._due = time.monotonic() + self._settings.tidy_every_s
        return min(POLL_S, self._settings.tidy_every_s)

    def round(self, now: datetime, *, short_of_room: bool = False) -> bool:
        """Delete up to a batch of each kind; return True if there is more.

        Short of room, the frames of jobs that have ended go before their time, the oldest first: nobody computes with
        them any more, and without room no job could follow.
        """
        keep = self._settings
        keep_frames_days = 0 if short_of_room else keep.keep_frames_days
        counts = {
            "frames": self._expire_frames(now - timedelta(days=keep_frames_days), now),
            "pictures": self._expiry.expire_pictures(now - timedelta(days=keep.keep_pictures_days), now, BATCH),
            "jobs": self._delete_jobs(now - timedelta(days=keep.keep_jobs_days), now),
            "revisions": self._expiry.expire_revisions(now - keep.keep_revisions_years * YEAR, BATCH),
            "deliveries": self._expire_deliveries(now - timedelta(days=keep.callback_expires_days)),
            "events": self._expiry.expire_events(now - timedelta(days=keep.keep_events_days), EVENTS),
            "live_minutes": self._expiry.expire_live_minutes(now - timedelta(days=keep.keep_live_days), EVENTS),
            "folders": self._sweep(now),
        }
        if any(counts.values()):
            log.info("deleted what is past its time", short_of_room=short_of_room, **counts)
        most = dict.fromkeys(counts, BATCH) | {
            "deliveries": EVENTS,
            "events": EVENTS,
            "live_minutes": EVENTS,
            "folders": FOLDERS_OF_A_JOB * BATCH,
        }
        return any(count >= most[name] for name, count in counts.items())

    def _is_elected(self) -> bool:
        """True if this worker is the first by name of those alive."""
        alive = self._workers.alive(self._settings.takeover_after_s)
        return min((worker.name for worker in alive), default="") == self._settings.worker_name

    def _expire_frames(self, ended_before: datetime, now: datetime) -> int:
        """Expire the frames of old jobs; return how many jobs were processed, those whose frames must stay included.

        Pictures that were never drawn can be drawn for as long as pictures are kept: their frames move beside them.
        """
        job_ids: list[str] = []
        dealt_with = 0
        for batch in _batches(self._expiry.old_frames(ended_before, BATCH)):
            moved = list(self._pool.map(self._keep_for_pictures, batch))
            job_ids += [old.job_id for old, done in zip(batch, moved, strict=True) if done]
            if moved.count(False) >= MAX_FAILURES:
                # Neither do those behind them fare better; the next round tries again.
                break
            dealt_with += len(batch)
        self._expiry.expire_frames(job_ids, now)
        return dealt_with

    def _keep_for_pictures(self, old: OldFrames) -> bool:
        together = {drawn_together(name) for name in old.pictures} - {()}
        try:
            if all(self._blobs.has(f"{old.folder}/{picture_file(first)}") for first, *_ in together):
                return True
            for camera, path in old.frames.items():
                self._blobs.move(path, source_file(old.folder, camera))
        except BLOB_OUTAGES:
            log.warning("cannot keep what pictures are drawn of", job=old.job_id, exc_info=True)
            return False
        return True

    def _expire_deliveries(self, before: datetime) -> int:
        expired = self._expiry.expire_deliveries(before, EVENTS)
        for receiver, count in expired.items():
            log.error("callbacks expired", receiver=receiver, count=count)
        return expired.total()

    def _delete_jobs(self, ended_before: datetime, now: datetime) -> int:
        job_ids = self._expiry.old_jobs(ended_before, BATCH)
        if job_ids:
            # The queue first: without our row nobody would ever ask it to forget.
            self._forget_queued(job_ids)
            self._expiry.delete_jobs(job_ids, now)
        return len(job_ids)

    def _sweep(self, now: datetime) -> int:
        swept = 0
        for batch in _batches(self._expiry.leftovers(now, FOLDERS_OF_A_JOB * BATCH)):
            deleted = dict(zip(batch, self._pool.map(self._delete, batch), strict=True))
            self._expiry.forget_leftovers([folder for folder, gone in deleted.items() if gone])
            stuck = [folder for folder, gone in deleted.items() if not gone]
            for folder in stuck:
                self._expiry.postpone(folder, now + TRY_AGAIN_AFTER)
            swept += len(batch) - len(stuck)
            if len(stuck) >= MAX_FAILURES:
                # Those behind these keep their place.
                break
        return swept

    def _delete(self, folder: str) -> bool:
        try:
            self._blobs.delete_under(folder)
        except Exception:  # whatever the store says about this folder, the others need not wait for it
            log.warning("cannot delete", folder=folder, exc_info=True)
            return False
        return True


def _batches(several: Sequence[T]) -> Iterator[Sequence[T]]:
    """Yield slices of up to `AT_ONCE` items."""
    for first in range(0, len(several), AT_ONCE):
        yield several[first : first + AT_ONCE]
