"""Jobs in a row, as in months: does memory grow, and do database and folder stay as small as retention makes them?

Frames and pictures are kept for seconds here, and jobs until fifty newer ones have ended: these are then made to have
ended long ago. What is kept for good, and so grows, is counted beside it: the poses that ever held.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import sqlalchemy as sa

from benchmarks.processes import resident_mb
from benchmarks.service.load import ENGINE
from benchmarks.service.stage import service
from service.settings import MODEL_BESIDE_THE_CODE
from service.store import tables
from testbed import rendered_pair
from testbed.books import everything_in, queued, settle
from testbed.homes import Embedded
from testbed.running import Service, wait_for

KEEP_S = 20
KEEP_JOBS = 50
STUBS = {"a": "accept", "b": "accept", "c": "reject", "d": "accept", "e": "fail"}
DAY_S = 86400


@dataclass(frozen=True)
class Sample:
    """After a job: resident memory in MB, of the database too, files in kB, rows."""

    api: float
    worker: float
    database: float
    files_kb: float
    jobs: int
    queued: int
    poses: int


def table(options: argparse.Namespace) -> list[str]:
    """A row per figure and kind of job: means of the second and of the last quarter."""
    stub = _endured(options.jobs, _submit_stub)
    settings = {"ESC_MODEL": str(MODEL_BESIDE_THE_CODE), "ESC_JOB_PROGRAM": json.dumps(ENGINE)}
    real = _endured(options.real_jobs, _submit_real, **settings)
    return [
        f"`esc up` on SQLite and a folder: {options.jobs} jobs through the stub of the engine, {options.real_jobs} "
        f"through the engine (two cameras of 1280x720). Kept: {KEEP_JOBS} jobs; frames and pictures for {KEEP_S} s.",
        "Means over the second and the last quarter of the jobs.",
        "",
        "| | stub: second | last | times | engine: second | last | times |",
        "|---|---|---|---|---|---|---|",
        *(
            f"| {title} | {_compared(stub, name)} | {_compared(real, name)} |"
            for title, name in {
                "resident memory of the API, MB": "api",
                "resident memory of the worker, MB": "worker",
                "database with its log, MB": "database",
                "frames and pictures, kB": "files_kb",
                "rows: jobs": "jobs",
                "rows: entries of the queue": "queued",
                "rows: poses that ever held (kept for good)": "poses",
            }.items()
        ),
    ]


def _endured(jobs: int, submit: Callable[[Service, int], str], **settings: str) -> list[Sample]:
    keep_days = f"{KEEP_S / DAY_S:.8f}"
    short = {"ESC_KEEP_FRAMES_DAYS": keep_days, "ESC_KEEP_PICTURES_DAYS": keep_days}
    samples = []
    with service(Embedded(), **short, **settings) as running:
        running.ready()
        worker = running.worker()
        for number in range(jobs):
            job = _followed(running, submit(running, number))
            if job["result"]:
                running.http.get(job["links"]["birdseye"]).raise_for_status()
            _age(running)
            samples.append(_sample(running, worker))
        assert running.worker() == worker, "the worker was started again"
        settle(running)
    return samples


def _submit_stub(running: Service, number: int) -> str:
    name = list(STUBS)[number % len(STUBS)]
    if number < len(STUBS):
        running.venue(name, STUBS[name])
    return running.submit(name).raise_for_status().json()["id"]


def _submit_real(running: Service, number: int) -> str:
    if number == 0:
        running.http.put("/venues/real", json=rendered_pair.venue("real")).raise_for_status()
    files = [(camera, (f"{camera}.jpg", data)) for camera, data in rendered_pair.frames().items()]
    options = ("options", (None, json.dumps({"seed": number})))
    answer = running.http.post("/venues/real/calibrate", files=[*files, options])
    return answer.raise_for_status().json()["id"]


def _followed(running: Service, job: str) -> dict:
    """Follow a job as a production tool does: polls with the last ETag, lists, reads metrics."""
    tag = ""

    def ended() -> dict | None:
        nonlocal tag
        answer = running.http.get(f"/jobs/{job}", headers={"If-None-Match": tag})
        tag = answer.headers["etag"]
        running.http.get("/jobs", params={"limit": 10}).raise_for_status()
        running.http.get("/metrics").raise_for_status()
        found = answer.json() if answer.status_code == 200 else None
        return found if found and found["finished_at"] else None

    return wait_for(ended, deadline_s=600)


def _age(running: Service) -> None:
    """Let the jobs before the last fifty have ended long ago."""
    j = tables.jobs.c
    long_ago = datetime.now(UTC) - timedelta(days=1000)
    with running.database() as connection:
        young = sa.select(j.id).order_by(j.id.desc()).limit(KEEP_JOBS)
        old = sa.and_(j.finished_at.is_not(None), j.id.not_in(young))
        connection.execute(sa.update(tables.jobs).where(old).values(finished_at=long_ago))


def _sample(running: Service, worker: int) -> Sample:
    with running.database() as connection:
        jobs, poses = (
            connection.scalar(sa.select(sa.func.count()).select_from(rows)) for rows in (tables.jobs, tables.revisions)
        )
        entries = len(queued(connection))
    blobs = running.data / "blobs"
    return Sample(
        api=resident_mb(running.process.pid),
        worker=resident_mb(worker),
        database=sum(_size_mb(path) for path in running.data.glob("esc.sqlite*")),
        files_kb=1000 * sum(_size_mb(blobs / path) for path in everything_in(running.blob_url)),
        jobs=jobs,
        queued=entries,
        poses=poses,
    )


def _size_mb(path: Path) -> float:
    """Return the size of a file; 0 if it was deleted a moment ago."""
    try:
        return path.stat().st_size / 1e6
    except FileNotFoundError:
        return 0.0


def _compared(samples: Sequence[Sample], name: str) -> str:
    values = [getattr(sample, name) for sample in samples]
    quarter = max(len(values) // 4, 1)
    second, last = float(np.mean(values[quarter : 2 * quarter])), float(np.mean(values[-quarter:]))
    return f"{second:.1f} | {last:.1f} | {last / second:.3f}"
