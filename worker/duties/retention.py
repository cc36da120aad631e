"""Retention: what is past its time goes, a bounded piece per round, by one worker at a time.

A round that breaks off anywhere is finished by the next one; two at once (a worker that was taken for dead) do the same
twice and no harm.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime, timedelta
from typing import TypeVar

import structlog

from service.observe.disk import Disk
from service.settings import Settings
from service.store.blobs import AWAY, Blobs
from service.store.expiry import Expiry, OldFrames
from service.store.jobs.files import drawn_together, picture_file, source_file
from service.store.workers import Workers

# Of each kind per round: some seconds on a bucket, a fraction of one in a folder.
BATCH = 100
# Two when its files are past their time, and two more when it is: a round that finds a batch of each deletes as many.
FOLDERS_OF_A_JOB = 4
# A bucket takes tens of milliseconds for each, and a disk to be sure of a file that was moved.
AT_ONCE = 16
# Rows alone, several of each job.
EVENTS = 1000
YEAR = timedelta(days=365.25)
# Between two rounds while there is more to do: what others write gets its turn.
BREATH_S = 2.0
# Between two looks at whether a round is due.
LOOK_S = 10.0
TRY_AGAIN_AFTER = timedelta(hours=1)
# So many among those that are moved or deleted at once, and the store is away.
FAILURES = 3
T = TypeVar("T")
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
        self._hands = ThreadPoolExecutor(AT_ONCE, thread_name_prefix="retention")

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
            "frames": self._expire_frames(now - timedelta(days=keep_frames_days), now),
            "pictures": self._expiry.expire_pictures(now - timedelta(days=keep.keep_pictures_days), now, BATCH),
            "jobs": self._delete_jobs(now - timedelta(days=keep.keep_jobs_days), now),
            "revisions": self._expiry.expire_revisions(now - keep.keep_revisions_years * YEAR, BATCH),
            "events": self._expiry.expire_events(now - timedelta(days=keep.keep_events_days), EVENTS),
            "folders": self._sweep(now),
        }
        if any(counts.values()):
            log.info("deleted what is past its time", short_of_room=short_of_room, **counts)
        most = dict.fromkeys(counts, BATCH) | {"events": EVENTS, "folders": FOLDERS_OF_A_JOB * BATCH}
        return any(count >= most[name] for name, count in counts.items())

    def _chosen(self) -> bool:
        """Whether this worker, of those alive, is the one to do it: the first by name."""
        alive = self._workers.alive(self._settings.takeover_after_s)
        return min((worker.name for worker in alive), default="") == self._settings.worker_name

    def _expire_frames(self, ended_before: datetime, now: datetime) -> int:
        """What nobody has looked at can be drawn for as long as pictures are kept: its frames stay beside them.

        Says how many jobs were dealt with, those among them whose frames have to stay for the time being.
        """
        job_ids: list[str] = []
        dealt_with = 0
        for handful in _handfuls(self._expiry.old_frames(ended_before, BATCH)):
            kept = list(self._hands.map(self._kept_for_pictures, handful))
            job_ids += [old.job_id for old, there in zip(handful, kept, strict=True) if there]
            if kept.count(False) >= FAILURES:
                # Neither do those behind them fare better; the next round tries again.
                break
            dealt_with += len(handful)
        self._expiry.expire_frames(job_ids, now)
        return dealt_with

    def _kept_for_pictures(self, old: OldFrames) -> bool:
        together = {drawn_together(name) for name in old.pictures} - {()}
        try:
            if all(self._blobs.has(f"{old.folder}/{picture_file(first)}") for first, *_ in together):
                return True
            for camera, path in old.frames.items():
                self._blobs.move(path, source_file(old.folder, camera))
        except AWAY:
            log.warning("cannot keep what pictures are drawn of", job=old.job_id, exc_info=True)
            return False
        return True

    def _delete_jobs(self, ended_before: datetime, now: datetime) -> int:
        job_ids = self._expiry.old_jobs(ended_before, BATCH)
        if job_ids:
            # The queue first: without our row nobody would ever ask it to forget.
            self._forget_queued(job_ids)
            self._expiry.delete_jobs(job_ids, now)
        return len(job_ids)

    def _sweep(self, now: datetime) -> int:
        swept = 0
        for handful in _handfuls(self._expiry.leftovers(now, FOLDERS_OF_A_JOB * BATCH)):
            deleted = dict(zip(handful, self._hands.map(self._deleted, handful), strict=True))
            self._expiry.swept([folder for folder, gone in deleted.items() if gone])
            stuck = [folder for folder, gone in deleted.items() if not gone]
            for folder in stuck:
                self._expiry.postpone(folder, now + TRY_AGAIN_AFTER)
            swept += len(handful) - len(stuck)
            if len(stuck) >= FAILURES:
                # Those behind these keep their place.
                break
        return swept

    def _deleted(self, folder: str) -> bool:
        try:
            self._blobs.delete_under(folder)
        except Exception:  # whatever the store says about this folder, the others need not wait for it
            log.warning("cannot delete", folder=folder, exc_info=True)
            return False
        return True


def _handfuls(several: Sequence[T]) -> Iterator[Sequence[T]]:
    """As many as are dealt with at once."""
    for first in range(0, len(several), AT_ONCE):
        yield several[first : first + AT_ONCE]
