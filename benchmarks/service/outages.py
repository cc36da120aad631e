"""What is taken away from the service while a job runs, how that job and others end, and how soon all is well again.

Nothing is started again by hand. A state other than the documented one (docker/README.md) ends the benchmark.
"""

from __future__ import annotations

import argparse
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx

from benchmarks.service.stage import EMBEDDED, SERVERS, homes, service
from testbed.books import settle
from testbed.disks import filled, may_mount, small_disk
from testbed.homes import Embedded, Home
from testbed.running import Service, wait_for
from testbed.running import upload as frames

DISK_MB = 64
LEAST_FREE_MB = 16
# Longer than an upload waits for a bucket.
BUCKET_AWAY_S = 15.0


@dataclass
class Observed:
    """In words, and seconds from the end of the outage until `/readyz` is content and another job has ended."""

    job: str
    upload: str
    recovered_s: float


def table(options: argparse.Namespace) -> list[str]:
    """A row per outage and home."""
    lines = [
        "| outage | home | the job that ran | an upload meanwhile | s until ready and another job has ended |",
        "|---|---|---|---|---|",
    ]

    def row(outage: str, home: str, observed: Observed) -> None:
        lines.append(
            f"| {outage} | {home} | {observed.job} | {observed.upload} | {observed.recovered_s:.1f} |",
        )

    with homes() as both:
        for name, home in both.items():
            row("the job kills its process", name, _poisoned(home, "crash", "job-crashed", attempts=1))
            row(
                "the job kills its worker, each time", name, _poisoned(home, "kill-worker", "job-abandoned", attempts=3)
            )
            row("the job hangs, `timeout_s` 3", name, _poisoned(home, "hang", "job-timeout", attempts=1, timeout_s=3))
        away_s = options.away_s
        locked = Embedded.database_locked
        row(f"SQLite locked for {away_s:g} s", EMBEDDED, _away(both[EMBEDDED], locked, away_s, {202}))
        away = type(both[SERVERS]).database_away
        row(f"PostgreSQL stopped for {away_s:g} s", SERVERS, _away(both[SERVERS], away, away_s, {503}))
        silent = lambda home, _: home.bucket_away()  # noqa: E731
        row(f"S3 silent for {BUCKET_AWAY_S:g} s", SERVERS, _away(both[SERVERS], silent, BUCKET_AWAY_S, {503}))
        if may_mount():
            row("disk short of room", EMBEDDED, _short_disk())
            row("disk full to the last byte, the log's too", EMBEDDED, _full_disk(away_s))
        else:
            lines.append(f"| full disk | {EMBEDDED} | not tried: needs root, and that root may mount | | |")
    return lines


def _poisoned(home: Home, behaviour: str, problem: str, attempts: int, **options: object) -> Observed:
    """A job that would end the service if it could; others go on behind it."""
    with service(home) as running:
        running.ready()
        begun = time.monotonic()
        job = running.submit(running.venue("poisoned", behaviour), **options).json()["id"]
        other = running.submit(running.venue("other")).raise_for_status()
        ended = wait_for(lambda: _ended(running, job), deadline_s=60)
        after_s = time.monotonic() - begun
        assert (ended["error"]["type"], ended["attempt"]) == (f"/problems/{problem}", attempts), ended
        gone = time.monotonic()
        _well_again(running, other.json()["id"])
        told = f"`{problem}` after {after_s:.1f} s, attempts: {attempts}"
        return Observed(told, str(other.status_code), time.monotonic() - gone)


def _away(
    home: Home, taken: Callable[[Home, Path], AbstractContextManager[None]], seconds: float, uploads: set[int]
) -> Observed:
    """The database or the bucket is away from the middle of a job until after its computation."""
    with service(home) as running:
        running.ready()
        running.venue("other")
        running.venue("later")
        job = running.submit(running.venue("v", f"accept {seconds / 2:g}")).json()["id"]
        running.running(job)
        with taken(home, running.data):
            back = time.monotonic() + seconds
            with _uploading(running, "other") as answers:
                assert running.http.get("/livez").status_code == 200
                time.sleep(back - time.monotonic())
        gone = time.monotonic()
        ended = running.end(job)
        assert (ended["status"], ended["attempt"]) == ("succeeded", 1), ended
        [(status, after_s)] = answers()
        assert status in uploads, status
        _well_again(running, running.submit("later").raise_for_status().json()["id"])
        recovered_s = time.monotonic() - gone
        settle(running)
        return Observed("succeeded, attempts: 1", f"{status} after {after_s:.1f} s", recovered_s)


def _short_disk() -> Observed:
    """Less room than `ESC_MIN_FREE_MB` asks for."""
    with _on_small_disk(str(LEAST_FREE_MB)) as (running, disk):
        job = running.submit(running.venue("v", "accept 2")).json()["id"]
        running.running(job)
        with filled(disk, leave_bytes=LEAST_FREE_MB * 500_000):
            refused = running.submit("other")
            assert (refused.status_code, refused.json()["type"]) == (507, "/problems/disk-full")
            assert "disk" in running.http.get("/readyz").json()["warnings"]
            assert running.end(job)["status"] == "succeeded"
        gone = time.monotonic()
        _well_again(running, running.submit("other").raise_for_status().json()["id"])
        return Observed("succeeded, attempts: 1", "507", time.monotonic() - gone)


def _full_disk(seconds: float) -> Observed:
    """Not a byte more can be written, to database, files and log."""
    with _on_small_disk("0") as (running, disk):
        worker = running.worker()
        job = running.submit(running.venue("v", "accept 2")).json()["id"]
        running.running(job)
        with filled(disk):
            begun = time.monotonic()
            refused = running.submit("other")
            assert (refused.status_code, refused.json()["type"]) == (503, "/problems/unavailable")
            assert running.http.get("/livez").status_code == 200
            time.sleep(begun + seconds - time.monotonic())
        gone = time.monotonic()
        ended = running.end(job)
        assert ended["error"]["type"] == "/problems/job-crashed", ended
        _well_again(running, running.submit("other").raise_for_status().json()["id"])
        recovered_s = time.monotonic() - gone
        assert running.worker() == worker
        return Observed("`job-crashed`, attempts: 1", "503", recovered_s)


@contextmanager
def _on_small_disk(least_free_mb: str) -> Iterator[tuple[Service, Path]]:
    with tempfile.TemporaryDirectory(prefix="esc-bench-") as name, small_disk(Path(name) / "disk", DISK_MB) as disk:
        running = Service(disk / "esc", ESC_MIN_FREE_MB=least_free_mb, ESC_TAKEOVER_AFTER_S="10").ready()
        try:
            running.venue("other")
            yield running, disk
        finally:
            running.kill()


@contextmanager
def _uploading(running: Service, venue: str) -> Iterator[Callable[[], list[tuple[int, float]]]]:
    """An upload beside the block; the call waits for its answer and gives status and seconds."""
    answers = []

    def upload() -> None:
        begun = time.monotonic()
        with httpx.Client(base_url=running.url, timeout=60) as client:
            answer = client.post(f"/venues/{venue}/calibrate", files=frames())
        answers.append((answer.status_code, time.monotonic() - begun))

    thread = threading.Thread(target=upload)
    thread.start()

    def answered() -> list[tuple[int, float]]:
        thread.join()
        return answers

    yield answered


def _well_again(running: Service, job: str) -> None:
    """A job ends as if nothing had been, and the service calls itself ready."""
    ended = wait_for(lambda: _ended(running, job), deadline_s=60)
    assert ended["status"] == "succeeded", ended
    running.ready()


def _ended(running: Service, job: str) -> dict | None:
    found = running.job(job, wait=1)
    return None if found["status"] in ("queued", "running") else found
