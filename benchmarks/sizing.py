"""Resources of a fleet of venues: measured figures in, the tables of docs/sizing.md out.

`python -m benchmarks.sizing` prints the tables, `python -m benchmarks.sizing measure` measures again what
one real job costs (the demo venue, two rendered 4K cameras); what a job costs the database `make bench-rate` says.
"""

import statistics
import sys
from collections.abc import Callable
from dataclasses import dataclass

import obstore
from obstore.store import from_url

from benchmarks.cost.__main__ import HERE, measure_job, running
from benchmarks.cost.cases import DEMO_CAMERAS, case
from service.settings import Settings

FLEETS = (100, 10_000)
JOBS_MEASURED = 3


@dataclass(frozen=True)
class Measured:
    """Cost of one job of two 4K cameras."""

    # `make bench-cost`, near the stored pose, on two quiet cores of a rented server.
    core_s: float = 1.39
    elapsed_s: float = 1.57
    frame_mb: float = 5.76
    frames: int = 2
    # Of the masks; the other pictures are drawn when somebody looks, and are then so many and so large.
    picture_mb: float = 0.20
    pictures: int = 2
    looked_at_mb: float = 8.62
    looked_at: int = 14
    # `make bench-rate`, on the same cores: core-seconds at 11.1 submissions a second, bytes at 30, where they are more.
    transactions: float = 10
    wal_kb: float = 29
    database_kb: float = 15.5
    api_core_s: float = 0.015
    worker_core_s: float = 0.026
    postgres_core_s: float = 0.009


@dataclass(frozen=True)
class Chosen:
    """Decisions of an operator."""

    every_s: float = 900
    # Of the cores that compute: the rest is for bursts, restarts and the night a machine is missing.
    used: float = 0.7
    keep_frames_days: float = Settings.model_fields["keep_frames_days"].default
    keep_pictures_days: float = Settings.model_fields["keep_pictures_days"].default
    keep_jobs_days: float = Settings.model_fields["keep_jobs_days"].default
    # Where 400 days are too much.
    keep_jobs_fewer_days: float = 30
    cores_per_machine: int = 16
    # A small one that stands beside the cameras.
    small_cores: int = 2
    small_w: float = 30


@dataclass(frozen=True)
class Fleet:
    """Resources of so many venues."""

    venues: int
    job: Measured
    chosen: Chosen

    @property
    def jobs_per_s(self) -> float:
        return self.venues / self.chosen.every_s

    @property
    def jobs_per_day(self) -> float:
        return 86_400 * self.jobs_per_s

    @property
    def all_core_s(self) -> float:
        """Core-seconds of one job, with all that is around it."""
        job = self.job
        return job.core_s + job.worker_core_s + job.api_core_s + job.postgres_core_s

    @property
    def worker_cores(self) -> float:
        return self.jobs_per_s * (self.job.core_s + self.job.worker_core_s) / self.chosen.used

    @property
    def venues_on_a_small_machine(self) -> float:
        return self.chosen.used * self.chosen.small_cores * self.chosen.every_s / self.all_core_s

    @property
    def joules_per_job(self) -> float:
        """Energy of a job on a small machine that has as much to do as it may."""
        return self.chosen.small_w * self.chosen.every_s / self.venues_on_a_small_machine

    @property
    def files_kept_days(self) -> float:
        """Frames stay as long as pictures that nobody has looked at could be drawn of them."""
        return max(self.chosen.keep_frames_days, self.chosen.keep_pictures_days)

    def database_gb(self, kept_days: float) -> float:
        """Size of the database if jobs are kept for so long."""
        return self.jobs_per_day * kept_days * self.job.database_kb / 1e6


MEASURED = Measured()
ROWS: dict[str, Callable[[Fleet, Measured, Chosen], str]] = {
    "jobs": lambda f, job, chosen: f"{_n(f.jobs_per_s)} a second, {_n(f.jobs_per_day)} a day",
    "**Workers**: cores": lambda f, job, chosen: f"{_n(f.worker_cores)} at {chosen.used:.0%} use",
    "machines of 16 cores": lambda f, job, chosen: _machines(f.worker_cores / chosen.cores_per_machine),
    "jobs running at once": lambda f, job, chosen: _n(f.jobs_per_s * job.elapsed_s),
    "**API**: cores, but for the bytes of frames": lambda f, job, chosen: _n(f.jobs_per_s * job.api_core_s),
    "**Database**: cores": lambda f, job, chosen: _n(f.jobs_per_s * job.postgres_core_s),
    "transactions": lambda f, job, chosen: f"{_n(f.jobs_per_s * job.transactions)} a second",
    "write-ahead log": lambda f, job, chosen: f"{_n(f.jobs_per_s * job.wal_kb / 1e3)} MB a second",
    "rows of jobs, kept 400 days": lambda f, job, chosen: _n(f.jobs_per_day * chosen.keep_jobs_days),
    "size, kept 400 days": lambda f, job, chosen: f"{_n(f.database_gb(chosen.keep_jobs_days))} GB",
    "size, kept 30 days": lambda f, job, chosen: f"{_n(f.database_gb(chosen.keep_jobs_fewer_days))} GB",
    "**Bucket**: size": lambda f, job, chosen: (
        f"{_n(f.jobs_per_day * f.files_kept_days * (job.frame_mb + job.picture_mb) / 1e3)} GB"
    ),
    "objects": lambda f, job, chosen: _n(f.jobs_per_day * f.files_kept_days * (job.frames + job.pictures)),
    # Frames are copied once more, to stay beside the pictures.
    "PUT": lambda f, job, chosen: f"{_n(30 * f.jobs_per_day * (2 * job.frames + job.pictures))} a month",
    # A worker gets each frame, and looks for four pictures, one of each that are drawn together, before those go;
    # frames and pictures are listed once more to be deleted, which costs nothing itself.
    "GET and LIST": lambda f, job, chosen: f"{_n(30 * f.jobs_per_day * (job.frames + 4 + 2))} a month",
    "**Network**: from the venues": lambda f, job, chosen: f"{_n(8 * f.jobs_per_s * job.frame_mb)} Mbit/s",
    # In by the API, out to the worker, and the pictures in.
    "to and from the bucket": lambda f, job, chosen: (
        f"{_n(8 * f.jobs_per_s * (2 * job.frame_mb + job.picture_mb))} Mbit/s"
    ),
}


def main() -> None:
    if sys.argv[1:] == ["measure"]:
        measure()
        return
    print(tables())


def tables() -> str:
    """Markdown."""
    job, fleets = MEASURED, [Fleet(venues, MEASURED, Chosen()) for venues in FLEETS]
    costs = {
        "processor": f"{job.core_s:.1f} core seconds, {job.elapsed_s:.1f} s on two cores",
        "frames": f"{job.frames}, {job.frame_mb:.1f} MB in all",
        "pictures": f"{job.pictures}, {job.picture_mb:.1f} MB in all; once somebody has looked at all of them, "
        f"{job.looked_at}, {job.looked_at_mb:.1f} MB",
        "database": f"{job.transactions:.0f} transactions, {job.wal_kb:.0f} kB of write-ahead log, "
        f"{job.database_kb:.0f} kB that stay",
        "around it": f"{1000 * job.api_core_s:.0f} ms of a core in the API, {1000 * job.worker_core_s:.0f} ms in the "
        f"worker, {1000 * job.postgres_core_s:.0f} ms in PostgreSQL",
    }
    lines = [
        "| a job of two 4K cameras | costs |",
        "|---|---|",
        *(f"| {what} | {much} |" for what, much in costs.items()),
    ]
    lines += ["", f"| venues | {' | '.join(_n(fleet.venues) for fleet in fleets)} |", "|---|" + "---|" * len(fleets)]
    lines += [
        f"| {title} | {' | '.join(cell(fleet, job, fleet.chosen) for fleet in fleets)} |"
        for title, cell in ROWS.items()
    ]
    lines += ["", energy(fleets[0])]
    return "\n".join(lines)


def energy(fleet: Fleet) -> str:
    """In words."""
    chosen, joules = fleet.chosen, fleet.joules_per_job
    kwh_a_year = 365 * 86_400 / chosen.every_s * joules / 3.6e6
    return (
        f"A machine of {chosen.small_cores} cores that takes {chosen.small_w:.0f} W keeps "
        f"{_n(fleet.venues_on_a_small_machine)} venues calibrated every {chosen.every_s / 60:.0f} minutes, at "
        f"{chosen.used:.0%} use: {_n(joules)} J a job, {_n(kwh_a_year)} kWh a venue and year."
    )


def measure() -> None:
    """Measure a real job, with nothing else on the machine."""
    demo = case(DEMO_CAMERAS, "start")
    with running("sizing", HERE) as release:
        jobs = [measure_job(release, demo) for _ in range(JOBS_MEASURED)]
        blobs = obstore.list(from_url((release.data / "blobs").as_uri()))
        sizes_mb = {one["path"]: one["size"] / 1e6 for page in blobs for one in page}
    frames_mb = sum(mb for path, mb in sizes_mb.items() if path.startswith("frames/"))
    # The preview is drawn because the measurement looks at it.
    masks_mb = sum(mb for path, mb in sizes_mb.items() if "/mask_" in path)
    print(f"core_s={statistics.median(job['core_s'] for job in jobs):.1f}")
    print(f"elapsed_s={statistics.median(job['answered_s'] for job in jobs):.1f}")
    print(f"frame_mb={frames_mb / JOBS_MEASURED:.2f}")
    print(f"picture_mb={masks_mb / JOBS_MEASURED:.2f}")


def _n(value: float) -> str:
    """Two digits that count, and spaces between thousands."""
    if value >= 100:
        digits = len(f"{value:.0f}") - 2
        return f"{round(value / 10**digits) * 10**digits:,}".replace(",", " ")
    return f"{value:.2g}"


def _machines(number: float) -> str:
    return "part of one" if number < 1 else _n(-(-number // 1))


if __name__ == "__main__":
    main()
