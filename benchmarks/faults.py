"""Answers that each caller gets while something hangs, is away or is full: `make bench-faults`.

Prints a table: the answers that each kind of caller got, and the longest wait of any of them. Every caller asks again
and again, on a connection of its own each time. Real processes, PostgreSQL, S3 (moto's server), sockets and, where root
may mount, a disk that is full; the program that computes a job is the stub of the tests. The moved clock is that of
the processes of a service, on SQLite, which has no clock of its own.
"""

from __future__ import annotations

import argparse
import itertools
import socket
import tempfile
import threading
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, closing, contextmanager, nullcontext
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import httpx
import sqlalchemy as sa

from benchmarks.printing import table_head
from benchmarks.processes import peak_mb
from benchmarks.service.stage import EMBEDDED, SERVERS, homes, service
from service.store import tables
from testbed.clocks import Clock
from testbed.disks import filled, may_mount, small_disk
from testbed.homes import Home
from testbed.network_cameras import NetworkCamera
from testbed.running import Service, png, upload, venue

SILENT = 200
UPLOADS, FRAMES, FRAME = 16, 24, png() + bytes(1_000_000)
DISK_MB = 64
# Nobody is held for longer than this.
PATIENCE_S = 120.0
Call = Callable[[httpx.Client], httpx.Response]
Fault = Callable[[Service], AbstractContextManager[None]]


@dataclass
class Seen:
    """Answers that one kind of caller got, and the longest wait."""

    answers: Counter[str] = field(default_factory=Counter)
    longest_s: float = 0.0

    def note(self, answer: str, seconds: float) -> None:
        """Count an answer."""
        self.answers[answer] += 1
        self.longest_s = max(self.longest_s, seconds)


CALLERS: dict[str, Call] = {
    "`/livez`": lambda http: http.get("/livez"),
    "`/readyz`": lambda http: http.get("/readyz"),
    "a venue": lambda http: http.get("/venues/v"),
    "jobs": lambda http: http.get("/jobs"),
    "an upload": lambda http: http.post("/venues/v/calibrate", files=upload()),
}
CLOCK_MOVED_S = 6 * 3600
NUMBERS = itertools.count()


class NotDone(httpx.HTTPError):
    """A job did not end well."""


def calibrated(http: httpx.Client) -> httpx.Response:
    """A calibration of a venue of its own, at its end."""
    name = f"new-{next(NUMBERS)}"
    http.put(f"/venues/{name}", json=venue(name, "accept 0.1")).raise_for_status()
    job = http.post(f"/venues/{name}/calibrate", files=upload()).raise_for_status().json()["id"]
    ended = http.get(f"/jobs/{job}", params={"wait": 60}).raise_for_status()
    if ended.json()["status"] != "succeeded":
        raise NotDone(ended.text)
    return ended


def until_scheduled(http: httpx.Client) -> httpx.Response:
    """The job that the schedule of the live venue, which is due, brings: waits until it is there."""
    while not (listed := http.get("/jobs", params={"venue": "live"}).raise_for_status()).json()["jobs"]:
        time.sleep(0.2)
    return listed


TO_ITS_END: dict[str, Call] = {"a new venue, calibrated": calibrated}
FROM_CAMERA = {"a calibration from a live camera": lambda http: http.post("/venues/live/calibrate")}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=20.0, help="that each fault lasts")
    seconds = parser.parse_args().seconds
    print(table_head("fault | home | caller | answers | longest wait, s"), flush=True)
    with homes() as both:
        servers = both[SERVERS]
        faults: list[tuple[str, str, Home, Fault]] = [
            ("none", EMBEDDED, both[EMBEDDED], lambda _: nullcontext()),
            ("none", SERVERS, servers, lambda _: nullcontext()),
            ("a table is locked", SERVERS, servers, lambda one: servers.table_locked(one.data, "venues, jobs")),
            ("the bucket is silent", SERVERS, servers, lambda _: servers.bucket_away()),
        ]
        for fault, name, home, begin in faults:
            with service(home) as running:
                tell(fault, name, watched(running.ready(), begin, CALLERS, seconds))
        with service(both[EMBEDDED], ESC_SOURCES='["127.0.0.0/8"]') as one:
            seen = watched(one.ready(), silent_cameras, CALLERS | FROM_CAMERA, seconds)
            tell(f"{SILENT} silent cameras, looked through at once", EMBEDDED, seen)
        with service(both[EMBEDDED], ESC_SOURCES='["127.0.0.0/8"]') as one:
            scheduled = CALLERS | {"the job of a live venue, due with them": until_scheduled}
            seen = watched(one.ready(), silent_schedules, scheduled, seconds)
            tell(f"{SILENT} silent cameras, by schedule, for the first time", EMBEDDED, seen)
        tell("the clock is moved 6 h forth, and back", EMBEDDED, with_a_clock_that_moves(both[EMBEDDED], seconds))
        # Those of the callers come beside them.
        with service(both[EMBEDDED], ESC_UPLOADS_AT_ONCE=str(UPLOADS + 2)) as running:
            peaks: list[float] = []
            seen = watched(running.ready(), lambda one: many_uploads(one, peaks), CALLERS, seconds)
            tell(f"{UPLOADS} uploads of {FRAMES * len(FRAME) / 1e6:.0f} MB", EMBEDDED, seen)
    if may_mount():
        tell("the disk is full", EMBEDDED, on_a_full_disk(seconds))
    else:
        print(f"| the disk is full | {EMBEDDED} | not tried: needs root, and that root may mount | | |")
    print(
        f"\nThe API's memory with {UPLOADS} uploads at once: {peaks[0]:.0f} MB before, {peaks[1]:.0f} MB at its peak."
    )


def tell(fault: str, home: str, seen: Mapping[str, Seen]) -> None:
    """Print the rows of a fault."""
    for caller, one in seen.items():
        answers = ", ".join(f"{count} x {answer}" for answer, count in sorted(one.answers.items()))
        print(f"| {fault} | {home} | {caller} | {answers} | {one.longest_s:.1f} |", flush=True)


def watched(running: Service, fault: Fault, callers: Mapping[str, Call], seconds: float) -> dict[str, Seen]:
    """Return what callers see from the beginning of a fault until all who asked during it have an answer."""
    running.venue("v", "accept 1")
    seen: dict[str, Seen] = defaultdict(Seen)
    with fault(running), ThreadPoolExecutor(2 * len(callers)) as threads:
        until = time.monotonic() + seconds
        # Two of each, so that one that hangs is not the only one.
        asking = [threads.submit(ask, running.url, call, seen[name], until) for name, call in 2 * [*callers.items()]]
        for one in asking:
            one.result()
    return seen


def ask(url: str, call: Call, seen: Seen, until: float) -> None:
    """Ask again and again."""
    while (begun := time.monotonic()) < until:
        try:
            with httpx.Client(base_url=url, timeout=PATIENCE_S) as http:
                answer = str(call(http).status_code)
        except httpx.HTTPError as error:
            answer = type(error).__name__
        seen.note(answer, time.monotonic() - begun)
        time.sleep(0.1)


@contextmanager
def silent_cameras(running: Service) -> Iterator[None]:
    """Clients that look through cameras which let themselves be connected to and say nothing."""
    with silent_and_live(running):
        over = threading.Event()

        def look(number: int) -> None:
            with httpx.Client(base_url=running.url, timeout=PATIENCE_S) as http:
                while not over.is_set():
                    http.get(f"/venues/silent-{number}/cameras/left/snapshot")

        with ThreadPoolExecutor(SILENT) as clients:
            for number in range(SILENT):
                clients.submit(look, number)
            time.sleep(1)
            try:
                yield
            finally:
                over.set()


@contextmanager
def silent_schedules(running: Service) -> Iterator[None]:
    """Schedules of venues with such cameras, and of one whose camera answers, that are due at one moment."""
    with silent_and_live(running, schedule={"cron": "0 3 * * *"}):
        with running.database() as connection:
            now = datetime.now(UTC)
            connection.execute(sa.update(tables.schedules).values(due_at=now, look_at=now))
        yield


@contextmanager
def silent_and_live(running: Service, **more: object) -> Iterator[None]:
    """Venues whose cameras are connected to and say nothing, and one whose camera answers."""
    live = NetworkCamera()
    with closing(socket.create_server(("127.0.0.1", 0), backlog=2 * SILENT)) as silent:
        address = f"http://127.0.0.1:{silent.getsockname()[1]}/"
        for number in range(SILENT):
            put_camera(running, f"silent-{number}", address + str(number), **more)
        put_camera(running, "live", live.url("/ok"), **more)
        yield
    live.close()


def put_camera(running: Service, name: str, source: str, **more: object) -> None:
    """A venue of one camera."""
    document = venue(name, cameras=("left",)) | more
    document["cameras"][0]["source"] = source
    running.http.put(f"/venues/{name}", json=document).raise_for_status()


def with_a_clock_that_moves(home: Home, seconds: float) -> dict[str, Seen]:
    """Return what callers see of a service whose clock is hours ahead from the beginning, and right again half way."""
    with tempfile.TemporaryDirectory(prefix="esc-bench-") as folder:
        clock = Clock(Path(folder))

        @contextmanager
        def moves(_: Service) -> Iterator[None]:
            clock.put(CLOCK_MOVED_S)
            back = threading.Timer(seconds / 2, clock.put, (0,))
            back.start()
            yield
            back.join()

        with service(home, **clock.environment) as running:
            return watched(running.ready(), moves, CALLERS | TO_ITS_END, seconds)


@contextmanager
def many_uploads(running: Service, peaks: list[float]) -> Iterator[None]:
    """Uploads of many small frames, all at once; notes the API's memory before and its peak."""
    for number in range(UPLOADS):
        running.venue(f"many-{number}")
    peaks.append(peak_mb(running.process.pid))

    def send(number: int) -> str:
        files = [(camera, ("f.png", FRAME)) for camera in ("left", "right") for _ in range(FRAMES // 2)]
        path = f"{running.url}/venues/many-{number}/calibrate"
        answer = httpx.post(path, files=files, timeout=PATIENCE_S)
        return "" if answer.is_success else answer.text

    with ThreadPoolExecutor(UPLOADS) as clients:
        answers = clients.map(send, range(UPLOADS))
        yield
        if refused := {*answers} - {""}:
            raise SystemExit(f"uploads were refused: {refused}")
    peaks.append(peak_mb(running.process.pid))


def on_a_full_disk(seconds: float) -> dict[str, Seen]:
    """Return what callers see where not a byte can be written, to database, files and log."""
    with tempfile.TemporaryDirectory(prefix="esc-bench-") as name, small_disk(Path(name) / "disk", DISK_MB) as disk:
        running = Service(disk / "esc", ESC_MIN_FREE_MB="0").ready()
        try:
            return watched(running, lambda _: filled(disk), CALLERS, seconds)
        finally:
            running.kill()


if __name__ == "__main__":
    main()
