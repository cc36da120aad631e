"""A month of a fleet in fast motion: its jobs made through the store day by day, tidied up by a clock that was moved.

A job is submitted, begun and ended as API and worker do it, with tiny files and no engine; then it is moved to the day
that it stands for. Tidying is the worker's own, with full batches and the pauses between them: what it deletes a second
is what it can keep up with. Jobs are kept for less than the month here, so that all is deleted that ever is.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from hashlib import sha256
from pathlib import Path

import numpy as np
import sqlalchemy as sa

from benchmarks.processes import resident_mb
from benchmarks.service.stage import homes
from service.application_state import ApplicationState
from service.intake.submit import frame_paths
from service.observability import logs
from service.schemas.options import Options
from service.schemas.venue import VenueIn
from service.settings import Settings
from service.store import tables
from service.store.expiry import ExpiryRepository
from service.store.ids import new_id
from service.store.jobs.files import OF_CAMERA, STITCHED, picture_folder
from service.store.jobs.queries import JobPage
from service.store.jobs.submission import Submission
from testbed.homes import Home as Place
from testbed.homes import files
from testbed.running import venue
from testbed.stock import result
from worker.duties.retention import BETWEEN_ROUNDS_S, FOLDERS_OF_A_JOB, Retention

VENUES, CAMERAS = 100, ("left", "right")
# Of 10 000 venues every 15 minutes: 11.1 jobs a second, and four folders of each.
NEEDED_PER_S = 44
KEEP_JOBS_DAYS = 20
# What can be drawn of a job, and the masks, which are made with it.
PICTURES = [*STITCHED, "birdseye", *(f"{each}_{camera}" for camera in CAMERAS for each in (*OF_CAMERA, "mask"))]
PAGE, LOOKS = 51, 5
MOST_WAITING = 10
DAYS_OF_A_ROW = 5
HEAD = (
    "| day | jobs kept | folders deleted | a second | jobs, ms | jobs of a venue, ms | venues, ms | memory, MB | "
    "database, kB a job | objects |"
)


@dataclass(frozen=True)
class Day:
    """Figures at the end of a day; `folders_per_s`: with the pauses between rounds, None where nothing was deleted."""

    jobs: int
    folders: int
    folders_per_s: float | None
    jobs_ms: float
    venue_ms: float
    venues_ms: float
    resident_mb: float
    kept_kb_per_job: float
    objects: int


class Counted(ExpiryRepository):
    """Counts the folders that are gone."""

    gone = 0

    def forget_leftovers(self, folders: Collection[str]) -> None:
        """Count the folders and forget them."""
        super().forget_leftovers(folders)
        self.gone += len(folders)


def table(options: argparse.Namespace) -> list[str]:
    """A table per home: every fifth day."""
    lines = [
        f"{options.fleet_days} days of {options.fleet_jobs} jobs, {VENUES} venues; frames are kept for 2 days, "
        f"pictures for 14, jobs for {KEEP_JOBS_DAYS}. At 11 jobs a second {NEEDED_PER_S} folders a second are needed.",
    ]
    # PostgreSQL as it would run for a customer.
    with homes(()) as both:
        for name, place in both.items():
            days = _month(place, options.fleet_days, options.fleet_jobs)
            lines += [
                "",
                f"{name}: {_kept_up(days, options.fleet_jobs)}",
                "",
                HEAD,
                "|" + "---|" * HEAD.count(" | ") + "---|",
                *(
                    _row(number, day)
                    for number, day in enumerate(days, 1)
                    if number % DAYS_OF_A_ROW == 0 or number == len(days)
                ),
            ]
    return lines


def _kept_up(days: Sequence[Day], jobs: int) -> str:
    """By the days on which all went that as many jobs leave; before them a round deletes less in as many pauses."""
    whole = FOLDERS_OF_A_JOB * jobs
    rates = [day.folders_per_s for day in days if day.folders_per_s is not None and day.folders >= whole]
    if not rates:
        return f"more than {KEEP_JOBS_DAYS} days are needed to say whether tidying keeps up."
    kept_up = "tidying keeps up" if min(rates) > NEEDED_PER_S else "tidying does not keep up"
    return f"{kept_up}, with {min(rates):.0f} to {max(rates):.0f} folders a second on the {len(rates)} last days."


def _month(place: Place, days: int, jobs: int) -> list[Day]:
    with tempfile.TemporaryDirectory(prefix="esc-fleet-") as name:
        folder = Path(name)
        settings = Settings(data=folder, keep_jobs_days=KEEP_JOBS_DAYS, log_level="warning", **place.settings(folder))
        logs.configure(settings)
        home = ApplicationState(settings)
        counted = Counted(home.engine)
        retention = Retention(settings, counted, home.blobs, home.workers, home.queue.forget)
        for number in range(VENUES):
            stored = VenueIn.model_validate(venue(f"v{number}", cameras=CAMERAS)).to_venue()
            home.venues.put(stored)
        begun = home.expiry.now()
        measured = []
        for number in range(1, days + 1):
            evening = begun + timedelta(days=number)
            _live(home, evening, jobs)
            measured.append(_seen(home, *_tidied(retention, counted, evening)))
        home.close()
        return measured


def _live(home: ApplicationState, evening: datetime, jobs: int) -> None:
    """A day with so many jobs."""
    since = home.expiry.now()
    ids = [_calibrated(home, f"v{number % VENUES}") for number in range(jobs)]
    j, e = tables.jobs.c, tables.events.c
    moments = {"created_at": evening, "updated_at": evening, "finished_at": evening}
    just_now = [e.at >= since, e.at < since + timedelta(hours=12)]
    with home.engine.begin() as connection:
        connection.execute(sa.update(tables.jobs).where(j.id.in_(ids)).values(moments))
        connection.execute(sa.update(tables.events).where(*just_now).values(at=evening))


def _seen(home: ApplicationState, folders: int, seconds: float) -> Day:
    with home.engine.connect() as connection:
        kept = connection.execute(sa.select(sa.func.count()).select_from(tables.jobs)).scalar_one()
    return Day(
        jobs=kept,
        folders=folders,
        folders_per_s=folders / seconds if folders else None,
        jobs_ms=_ms(lambda: home.jobs.page(JobPage(PAGE)).jobs),
        venue_ms=_ms(lambda: home.jobs.page(JobPage(PAGE, venue="v7", status="succeeded")).jobs),
        venues_ms=_ms(lambda: home.venues.calibration_summaries([f"v{number}" for number in range(50)])),
        resident_mb=resident_mb(os.getpid()),
        kept_kb_per_job=_database_kb(home) / kept,
        objects=len(files(home.settings.home_blob_url)),
    )


def _calibrated(home: ApplicationState, venue_id: str) -> str:
    """A job from its submission to its end."""
    stored, job_id = home.venues.get(venue_id), new_id()
    assert stored is not None
    submission = Submission(
        job_id=job_id,
        venue=stored,
        options=Options(seed=1),
        frames=frame_paths(job_id, {camera: [sha256(b"frame").hexdigest()] for camera in CAMERAS}),
        content_hash=job_id,
        idempotency_key=None,
    )

    for (path,) in submission.frames.values():
        home.blobs.put(path, b"frame")
    # The queue has them all: nobody takes them out of it.
    home.submissions.submit(submission, MOST_WAITING, home.queue.enqueue)
    task = home.attempts.begin(job_id)
    assert task is not None
    for camera in CAMERAS:
        home.blobs.put(f"{picture_folder(job_id, task.run_token)}/mask_{camera}.png", b"mask")
    home.attempts.finish(task, result(stored, accepted=True), PICTURES)
    return job_id


def _tidied(retention: Retention, counted: Counted, now: datetime) -> tuple[int, float]:
    """Rounds until nothing is left to do: folders that went, and the seconds that this takes a worker."""
    before, seconds, more = counted.gone, 0.0, True
    while more:
        begun = time.monotonic()
        more = retention.round(now)
        seconds += time.monotonic() - begun + (BETWEEN_ROUNDS_S if more else 0)
    return counted.gone - before, seconds


def _ms(look: Callable[[], object]) -> float:
    """The median of a few looks."""

    def once() -> float:
        begun = time.perf_counter()
        look()
        return 1e3 * (time.perf_counter() - begun)

    return float(np.median([once() for _ in range(LOOKS)]))


def _database_kb(home: ApplicationState) -> float:
    """Return the size of the database, with the queue's tables and with room that deleted rows left."""
    if home.engine.dialect.name == "sqlite":
        return sum(path.stat().st_size for path in home.settings.data.glob("esc.sqlite*")) / 1e3
    with home.engine.connect() as connection:
        return float(connection.exec_driver_sql("SELECT pg_database_size(current_database())").scalar_one()) / 1e3


def _row(number: int, day: Day) -> str:
    rate = "none" if day.folders_per_s is None else f"{day.folders_per_s:.0f}"
    times = f"{day.jobs_ms:.1f} | {day.venue_ms:.1f} | {day.venues_ms:.1f}"
    held = f"{day.resident_mb:.0f} | {day.kept_kb_per_job:.1f} | {day.objects}"
    return f"| {number} | {day.jobs} | {day.folders} | {rate} | {times} | {held} |"
