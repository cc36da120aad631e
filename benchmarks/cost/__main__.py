"""`make bench-cost`: core-seconds, wall-clock seconds and memory of jobs, before and after, in one run.

`--before FOLDER` names a clone of an earlier release with its `.venv` (`git worktree add FOLDER v0.1.0`, then
`make setup` there): its service runs beside the one of this folder, and each kind of job goes to one and then to the
other, so that what else the machine does hits both. Without it only this folder is measured. What was measured stays in
`runs/bench/cost.jsonl` by the commit that it is of.

Core-seconds are those of all processes of the service, so that imports count wherever they are made, and memory is that
of the process that computes the job. The stages are those of the answer.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

import httpx

from benchmarks.cost.cases import Case, case
from benchmarks.processes import measured as costs_of
from benchmarks.rows import Rows
from testbed.running import ready, wait_for

HERE = Path.cwd()
ROWS = Rows(Path("runs/bench/cost.jsonl"))
# Of the seed a search's length depends.
OPTIONS = json.dumps({"seed": 1, "dry_run": True})
# What the page of a venue shows.
LOOKED_AT = ("preview.jpg",)


@dataclass(frozen=True)
class Release:
    """A service of one clone, which runs."""

    name: str
    commit: str
    data: Path
    process: int
    http: httpx.Client


def main() -> None:
    """Measure what is not known yet, print the tables."""
    arguments = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    arguments.add_argument("--before", type=Path, help="a clone of an earlier release, with its .venv")
    arguments.add_argument("--runs", type=int, default=7, help="of each kind of job")
    arguments.add_argument("--cameras", nargs="+", default=["demo", "1", "2", "4", "8", "16"], help="demo, or 1 to 16")
    arguments.add_argument("--starts", nargs="+", default=["near", "start"], help="near, start")
    asked = arguments.parse_args()
    with ExitStack() as open_until_the_end:
        releases = [
            open_until_the_end.enter_context(running(name, folder.resolve()))
            for name, folder in (("before", asked.before), ("after", HERE))
            if folder is not None
        ]
        for cameras in asked.cameras:
            for start in asked.starts:
                measured = {release.name: [] for release in releases}
                for number in range(asked.runs):
                    for release in releases:
                        measured[release.name].append(row(release, cameras, start, number))
                print("\n".join(table(cameras, start, measured)), flush=True)


def row(release: Release, cameras: str, start: str, number: int) -> dict:
    """One job of a release, from the file or run now."""
    key = {"release": release.name, "commit": release.commit, "cameras": cameras, "start": start, "run": number}
    return ROWS.remembered(key, lambda: measure_job(release, case(cameras, start)))


def measure_job(release: Release, asked: Case) -> dict:
    """Measure a job from POST to its result, and then the time to fetch its pictures."""
    release.http.put(f"/venues/{asked.name}", json=asked.venue).raise_for_status()
    begun = time.monotonic()
    parts = [*asked.files.items(), ("options", (None, OPTIONS))]
    with costs_of(release.process) as cost:
        job = release.http.post(f"/venues/{asked.name}/calibrate", files=parts).raise_for_status().json()
        ended = wait_for(
            lambda: (now := release.http.get(f"/jobs/{job['id']}?wait=60").json())["finished_at"] and now, 600
        )
        answered_s = time.monotonic() - begun
    result = ended["result"]
    if result is None or not result["accepted"]:
        raise SystemExit(f"{release.name}, {asked.name}: expected an accepted job, got {ended}")
    looking = time.monotonic()
    for picture in LOOKED_AT:
        release.http.get(f"/jobs/{job['id']}/{picture}").raise_for_status()
    return {
        **asdict(cost),
        "answered_s": answered_s,
        "looked_s": time.monotonic() - looking,
        "timings_s": result["timings_s"],
        "cpu_s": result.get("cpu_s", {}),
        "poses": [camera["pose"]["position"] + camera["pose"]["rotation"] for camera in result["cameras"]],
    }


@contextmanager
def running(name: str, folder: Path) -> Iterator[Release]:
    """`esc up` of a clone."""
    python = str(folder / ".venv/bin/python")
    commit = subprocess.check_output(["git", "-C", folder, "rev-parse", "--short", "HEAD"], text=True).strip()
    with tempfile.TemporaryDirectory(prefix="esc-cost-") as data:
        environment = {"ESC_DATA": data, "ESC_LOG_LEVEL": "warning"}
        command = [python, "-m", "service.cli", "up", "--port", "0"]
        with subprocess.Popen(
            command, cwd=folder, env=os.environ | environment, stdout=subprocess.PIPE, text=True
        ) as service:
            try:
                with httpx.Client(base_url=service.stdout.readline().split()[-1], timeout=120) as http:
                    wait_for(lambda: ready(http))
                    yield Release(name, commit, Path(data), service.pid, http)
            finally:
                service.terminate()


def table(cameras: str, start: str, measured: dict[str, list[dict]]) -> Iterator[str]:
    """Markdown: a line per stage, its medians of core-seconds and of seconds, a pair of columns per release."""
    runs = max(len(rows) for rows in measured.values())
    what = "the demo" if cameras == "demo" else f"{cameras} camera{'s' * (cameras != '1')}"
    yield f"\n{what}, {start}; medians of {runs}, core-seconds and seconds"
    yield f"\n| | {' | '.join(f'{name}: core s | s' for name in measured)} |"
    yield "|---|" + "---|---|" * len(measured)
    lines: dict[str, tuple[Callable[[dict], float | None], Callable[[dict], float | None]]] = {
        "**all its processes**": (lambda row: row["core_s"], lambda _: None),
        "POST to result": (lambda _: None, lambda row: row["answered_s"]),
        "its preview, looked at then": (lambda _: None, lambda row: row["looked_s"]),
        "peak memory, MB": (lambda row: row["peak_mb"], lambda _: None),
    }
    for stage in measured["after"][0]["timings_s"]:
        lines[f"`{stage}`, by the answer"] = (_said("cpu_s", stage), _said("timings_s", stage))
    for title, values in lines.items():
        cells = [_median(rows, value) for rows in measured.values() for value in values]
        yield f"| {title} | {' | '.join(cells)} |"


def _said(what: str, stage: str) -> Callable[[dict], float | None]:
    return lambda row: row[what].get(stage)


def _median(rows: Sequence[dict], value: Callable[[dict], float | None]) -> str:
    values = [number for row in rows if (number := value(row)) is not None]
    if not values:
        return ""
    middle = statistics.median(values)
    return f"{middle:.0f}" if middle >= 100 else f"{middle:.2f}"


if __name__ == "__main__":
    sys.exit(main())
