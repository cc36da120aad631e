"""`make bench-rate`: the path of a job, without the engine, at the rate of 10 000 venues every 15 minutes.

An API process, several workers and PostgreSQL that writes to its disk as it would for a customer; frames go to a folder
and are tiny. Instead of the engine a shell script waits as long as a job takes and hands back a result, which moves the
stored poses. Submissions come by the clock, not by the answers: how late an answer is counts from when it was due.
Before the first one, all of them are idle for a while.

Transactions and core-milliseconds of a job are what to compare, also between machines that do something else besides.
Those of the script that stands in for the engine are told apart.
"""

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import httpx
import psycopg
import sqlalchemy as sa
from prometheus_client.parser import text_string_to_metric_families

from benchmarks.processes import core_s
from service.schemas.geometry import Moved, Pose
from service.schemas.job import Progress
from service.schemas.options import Options
from service.schemas.venue import VenueIn
from service.settings import Settings
from service.store import tables
from service.store.database import connect, migrate, writing
from testbed.homes import postgres_binaries, postgres_server
from testbed.running import Service, upload, venue, wait_for
from testbed.stock import result as accepted_result
from worker.protocol import Message

CAMERAS = ("left", "right")
SAMPLE_EVERY_S = 5
# Of a queue that keeps up: a worker looks into it twice a second.
KEEPS_UP_S = 5.0
SENDERS = 32
# A job of two 4K cameras tells its worker that often how far it is.
REPORTS = 11
STUB = """for report in {reports}; do echo '{progress}'; sleep {pause}; done
echo '{result}'
"""
# At the start nothing is warm, and for as long as a job takes nothing can end.
WARMING_UP_S = 15.0
# What a start leaves to be done.
SETTLING_S = 5.0
STAND_IN = "stand-in for the engine"


@dataclass
class Seen:
    """Samples of a measurement."""

    submitted: list[float] = field(default_factory=list)
    answers: Counter = field(default_factory=Counter)
    oldest_s: list[float] = field(default_factory=list)
    waiting: list[float] = field(default_factory=list)
    running: list[float] = field(default_factory=list)
    ended: list[tuple[float, float]] = field(default_factory=list)

    @property
    def ended_per_s(self) -> float:
        """Once the first had had their time to end."""
        (begun, before), (until, after) = self.ended[0], self.ended[-1]
        return (after - before) / (until - begun)


def main() -> int:
    chosen = arguments()
    binaries = postgres_binaries()
    if binaries is None:
        print("There is no PostgreSQL here (Debian: apt-get install postgresql).", file=sys.stderr)
        return 2
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="esc-rate-")))
        server = stack.enter_context(postgres_server(binaries, ("max_connections=300",)))
        with psycopg.connect(server.url("postgres"), autocommit=True) as connection:
            connection.execute("CREATE DATABASE esc")
        register_venues(server.url("esc"), chosen.venues)
        api = Service(folder, "serve", cold=True, **settings(folder, server.url("esc"), chosen))
        stack.callback(api.stop)
        command = [sys.executable, "-m", "service.cli", "worker", "--name"]
        workers = []
        for number in range(chosen.workers):
            worker = stack.enter_context(subprocess.Popen([*command, f"worker-{number}"], env=api.environment))
            stack.callback(worker.terminate)
            workers.append(worker)
        wait_for(lambda: figures(api.url)["esc_workers"] == chosen.workers, 60)
        parts = Parts(server.url("esc"), api.process, workers)
        measure_idle(chosen, parts)
        return measure(chosen, api.url, parts)


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rate", type=float, default=10_000 / 900, help="submissions per second")
    parser.add_argument("--minutes", type=float, default=3.0)
    parser.add_argument("--venues", type=int, default=10_000)
    parser.add_argument("--workers", type=int, default=4)
    parser.add_argument("--jobs-at-once", type=int, default=24, help="per worker")
    parser.add_argument("--seconds", type=float, default=7.0, help="that a job takes")
    parser.add_argument("--idle-s", type=float, default=20.0, help="without a job, before the first")
    return parser.parse_args()


def settings(folder: Path, database_url: str, chosen: argparse.Namespace) -> dict[str, str]:
    stub = folder / "stub.sh"
    progress = Message(progress=Progress(stage="segmentation", fraction=0.1)).model_dump_json()
    reports = " ".join(map(str, range(REPORTS)))
    pause = chosen.seconds / REPORTS
    stub.write_text(STUB.format(progress=progress, reports=reports, pause=pause, result=result().model_dump_json()))
    return {
        "ESC_DATABASE_URL": database_url,
        "ESC_BLOB_URL": (folder / "blobs").as_uri(),
        "ESC_JOB_PROGRAM": json.dumps(["/bin/sh", str(stub)]),
        "ESC_JOBS_AT_ONCE": str(chosen.jobs_at_once),
        "ESC_QUEUE_LIMIT": str(chosen.venues),
        "ESC_LOG_LEVEL": "warning",
        "ESC_TAKEOVER_AFTER_S": str(Settings.model_fields["takeover_after_s"].default),
    }


def result() -> Message:
    """Accepted, two cameras, every number there: a result as large as they are."""
    stored = VenueIn.model_validate(venue("v", cameras=CAMERAS)).to_venue()
    plain = accepted_result(stored, accepted=True)
    pose = Pose.from_position(
        [1.6123456789, 0.1123456789, -0.2123456789], [-1.0123456789, -50.0123456789, 8.0123456789]
    )
    moved = Moved(rotation_deg=0.8123456789, position_m=0.1123456789, pixels=22.0123456789)
    long_numbers = {"pose": pose, "moved": moved, "iou": 0.9712345678, "residual_px": 1.2123456789}
    cameras = [camera.model_copy(update=long_numbers) for camera in plain.cameras]
    stages = ("decode", "segmentation", "evolution", "refinement", "quality", "preview")
    asked = {"model_sha256": "f" * 64, "options": Options(seed=7).model_dump(exclude={"callback_url"})}
    whole = {
        "cameras": cameras,
        "stitch_error_px": 0.2123456789,
        "stitch_error_before_px": 14.123456789,
        "loss": 0.2123456789,
        "timings_s": dict.fromkeys(stages, 1.234),
        "provenance": plain.provenance.model_copy(update=asked),
    }
    return Message(result=plain.model_copy(update=whole))


def register_venues(database_url: str, count: int) -> None:
    """Straight into the table: how fast venues are put is not the question."""
    engine = connect(database_url)
    migrate(engine)
    document = VenueIn.model_validate(venue("v", cameras=CAMERAS)).to_venue().model_dump(mode="json")
    now = datetime.now(UTC)
    rows = [
        {"id": name(number), "document": document | {"id": name(number)}, "updated_at": now} for number in range(count)
    ]
    with writing(engine) as connection:
        connection.execute(sa.insert(tables.venues), rows)
    engine.dispose()


def name(number: int) -> str:
    return f"venue-{number}"


def figures(address: str) -> dict[str, float]:
    """Return the metrics of the service, added up over their labels."""
    text = httpx.get(f"{address}/metrics", timeout=30).raise_for_status().text
    total: Counter = Counter()
    for family in text_string_to_metric_families(text):
        for sample in family.samples:
            total[sample.name] += sample.value
    return total


@dataclass(frozen=True)
class Parts:
    """The processes whose processor time counts."""

    database_url: str
    api: subprocess.Popen
    workers: list[subprocess.Popen]

    def cpu_s(self) -> dict[str, float]:
        """Seconds of processor time so far, by part."""
        return {
            "API": cpu_s([self.api]),
            "workers": cpu_s(self.workers),
            STAND_IN: cpu_s(self.workers, children=True) - cpu_s(self.workers),
            "PostgreSQL": cpu_s_of_postgres(self.database_url),
        }


def measure_idle(chosen: argparse.Namespace, parts: Parts) -> None:
    """Print what all of it costs while there is nothing to do, most of it by the workers."""
    time.sleep(SETTLING_S)
    before, spent, begun = state_of(parts.database_url), parts.cpu_s(), time.monotonic()
    time.sleep(chosen.idle_s)
    after, idle_s = state_of(parts.database_url), time.monotonic() - begun
    shares = {part: (seconds - spent[part]) / idle_s for part, seconds in parts.cpu_s().items()}
    shares["workers"] /= chosen.workers
    commits = (after["commits"] - before["commits"]) / idle_s / chosen.workers
    print(
        f"idle: {commits:.1f} transactions a second for each worker; of a core, a worker {shares['workers']:.2%}, "
        f"the API {shares['API']:.2%}, PostgreSQL {shares['PostgreSQL']:.2%}"
    )


def measure(chosen: argparse.Namespace, address: str, parts: Parts) -> int:
    seen = Seen()
    before, spent, begun = state_of(parts.database_url), parts.cpu_s(), time.monotonic()
    count = round(chosen.rate * chosen.minutes * 60)
    limits = httpx.Limits(max_connections=SENDERS)
    with (
        httpx.Client(base_url=address, timeout=60, limits=limits) as client,
        ThreadPoolExecutor(SENDERS + 1) as senders,
    ):
        watching = senders.submit(watch, address, seen, begun + count / chosen.rate)
        for number in range(count):
            due = begun + number / chosen.rate
            time.sleep(max(0.0, due - time.monotonic()))
            senders.submit(submit, client, number, due, chosen, seen)
        watching.result()
    accepted = seen.answers[202]
    wait_for(lambda: figures(address)["esc_jobs_ended_total"] >= accepted, 60 + 20 * chosen.seconds)
    busy_s = time.monotonic() - begun
    spent = {part: seconds - spent[part] for part, seconds in parts.cpu_s().items()}
    after = state_of(parts.database_url)
    return report(chosen, seen, busy_s, spent, before, after)


def submit(client: httpx.Client, number: int, due: float, chosen: argparse.Namespace, seen: Seen) -> None:
    venue_id = name(number % chosen.venues)
    answer = client.post(f"/venues/{venue_id}/calibrate", files=upload(number % 256, CAMERAS))
    seen.answers[answer.status_code] += 1
    if number > WARMING_UP_S * chosen.rate:
        seen.submitted.append(time.monotonic() - due)


def watch(address: str, seen: Seen, until: float) -> None:
    time.sleep(WARMING_UP_S)
    while time.monotonic() < until:
        now = figures(address)
        seen.oldest_s.append(now["esc_queue_oldest_age_seconds"])
        seen.waiting.append(now["esc_queue_jobs"])
        seen.running.append(now["esc_jobs_running"])
        seen.ended.append((time.monotonic(), now["esc_jobs_ended_total"]))
        time.sleep(min(SAMPLE_EVERY_S, max(0.0, until - time.monotonic())))


def state_of(database_url: str) -> dict[str, float]:
    """Return counters and sizes of PostgreSQL."""
    with psycopg.connect(database_url, autocommit=True) as connection:
        # The statistics of other sessions are a second old at most once these are asked for again.
        time.sleep(1.5)
        commits, written, size, wal = connection.execute(
            "SELECT xact_commit + xact_rollback, tup_inserted + tup_updated + tup_deleted, "
            "pg_database_size(current_database()), pg_current_wal_lsn() - '0/0' "
            "FROM pg_stat_database WHERE datname = current_database()"
        ).fetchone()
        ours = "SELECT coalesce(sum(pg_total_relation_size(c.oid)), 0) FROM pg_class c JOIN pg_namespace n ON "
        ours += "n.oid = c.relnamespace WHERE c.relkind = 'r' AND n.nspname = %s"
        public, dbos = (float(connection.execute(ours, (schema,)).fetchall()[0][0]) for schema in ("public", "dbos"))
    return {
        "commits": float(commits),
        "rows": float(written),
        "size": float(size),
        "wal": float(wal),
        "public": public,
        "dbos": dbos,
    }


def cpu_s(processes: list[subprocess.Popen], *, children: bool = False) -> float:
    """Seconds of processor time of processes; `children`: and of those that they have waited for."""
    return sum(core_s(process.pid, children=children) for process in processes)


def cpu_s_of_postgres(database_url: str) -> float:
    with psycopg.connect(database_url) as connection:
        file = connection.execute("SELECT setting FROM pg_settings WHERE name = 'data_directory'").fetchall()[0][0]
    postmaster = int((Path(file) / "postmaster.pid").read_text().split()[0])
    backends = [int(child) for child in Path(f"/proc/{postmaster}/task/{postmaster}/children").read_text().split()]
    spent = 0.0
    for backend in backends:
        # One that has ended meanwhile is among those that the postmaster has waited for.
        with suppress(FileNotFoundError):
            spent += core_s(backend)
    return spent + core_s(postmaster, children=True)


def report(
    chosen: argparse.Namespace,
    seen: Seen,
    busy_s: float,
    spent: dict[str, float],
    before: dict[str, float],
    after: dict[str, float],
) -> int:
    jobs = seen.answers[202]
    ms = [1000 * seconds for seconds in seen.submitted]
    quantile = statistics.quantiles(ms, n=100)
    per_job = {key: (after[key] - before[key]) / jobs for key in before}
    path = {part: seconds for part, seconds in spent.items() if part != STAND_IN}
    print(
        f"{chosen.minutes:g} minutes at {chosen.rate:.1f} submissions a second, {chosen.venues} venues, "
        f"{chosen.workers} workers of {chosen.jobs_at_once} jobs at once, a job takes {chosen.seconds:g} s; "
        f"without the first {WARMING_UP_S:.0f} s"
    )
    lines = {
        "answers": str(dict(seen.answers)),
        "submission, from when due": f"p50 {quantile[49]:.0f} ms, p99 {quantile[98]:.0f} ms, longest {max(ms):.0f} ms",
        "jobs ended": f"{seen.ended_per_s:.2f} a second",
        "jobs running": f"{statistics.mean(seen.running):.0f} on average",
        "jobs waiting": f"{statistics.mean(seen.waiting):.1f} on average, {max(seen.waiting):.0f} at most",
        "oldest waiting": f"{max(seen.oldest_s):.1f} s at most",
        **{
            part: f"{seconds / busy_s:.2f} cores, {1000 * seconds / jobs:.0f} ms of a core per job"
            for part, seconds in spent.items()
        },
        "all but the stand-in": f"{1000 * sum(path.values()) / jobs:.0f} ms of a core per job",
        "PostgreSQL, per job": f"{per_job['commits']:.0f} transactions, {per_job['rows']:.0f} rows written, "
        f"{per_job['wal'] / 1000:.0f} kB of WAL",
        "kept per job": f"{per_job['public'] / 1000:.1f} kB of ours, {per_job['dbos'] / 1000:.1f} kB of the queue's",
    }
    for title, line in lines.items():
        print(f"{title:<28}{line}")
    held = set(seen.answers) == {202} and seen.ended_per_s >= 0.98 * chosen.rate and max(seen.oldest_s) <= KEEPS_UP_S
    print("The path holds this rate." if held else "The path does not hold this rate.")
    return 0 if held else 1


if __name__ == "__main__":
    sys.exit(main())
