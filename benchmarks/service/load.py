"""Fifty pollers on one job while the engine computes it, and the same job alone, alternately.

The demo's two 4K frames through the real engine. The pollers are one process (`poller.py`) held to a core; API, worker
and engine run where the kernel puts them.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np

from benchmarks.printing import spread
from benchmarks.processes import core_s
from benchmarks.service.poller import POLLERS
from benchmarks.service.stage import service
from service.client import Client
from service.schemas.venue import VenueIn
from service.settings import MODEL_BESIDE_THE_CODE
from testbed.homes import Embedded
from testbed.running import Service, wait_for

DEMO = Path(__file__).parents[2] / "demo"
ENGINE = [sys.executable, "-P", "-m", "worker.jobs.program"]
PER_S = 510
POLLERS_CORE = max(os.sched_getaffinity(0))


@dataclass(frozen=True)
class Polled:
    """Answers that the pollers got during one job, and the cores that the API and they used."""

    per_s: float
    milliseconds: np.ndarray
    unchanged: float
    api_cores: float
    pollers_cores: float


def table(options: argparse.Namespace) -> list[str]:
    """Answers, their times, and what they cost the job."""
    alone, beside, polled = [], [], []
    settings = {"ESC_MODEL": str(MODEL_BESIDE_THE_CODE), "ESC_JOB_PROGRAM": json.dumps(ENGINE)}
    with service(Embedded(), **settings) as running, Client(running.url) as client:
        running.ready()
        venue = client.put_venue(VenueIn.model_validate_json((DEMO / "venue.json").read_text()))
        frames = {camera.id: [DEMO / f"{camera.id}.jpg"] for camera in venue.cameras}
        submit = lambda: client.calibrate(venue.id, frames, {"seed": 1, "dry_run": True}).id  # noqa: E731
        _end(running, submit())  # what is read from the disk once is not counted
        for _ in range(options.rounds):
            alone.append(_seconds(_end(running, submit())))
            job = submit()
            with _asking(running, job) as heard:
                beside.append(_seconds(_end(running, job)))
            polled.append(heard())
    everything = np.concatenate([round_.milliseconds for round_ in polled])
    slower = [with_them / without for with_them, without in zip(beside, alone, strict=True)]
    return [
        f"{POLLERS} clients, each with a connection of its own, ask {PER_S} times a second together for the job that "
        f"computes (demo venue, two 4K frames, the real engine); {options.rounds} jobs with them and as many alone, "
        f"alternately. {os.cpu_count()} cores; API, worker and engine are not pinned, the clients are one process on "
        f"core {POLLERS_CORE}. Time counts from the moment a question is due.",
        "",
        "| | median (least to most of the rounds) |",
        "|---|---|",
        f"| answers per second | {spread([round_.per_s for round_ in polled], 0)} |",
        f"| of them 304, % | {spread([100 * round_.unchanged for round_ in polled], 0)} |",
        f"| p50, ms | {spread([_percentile(round_.milliseconds, 50) for round_ in polled])} |",
        f"| p99, ms | {spread([_percentile(round_.milliseconds, 99) for round_ in polled])} |",
        f"| p99 over all {len(everything)} answers, ms | {_percentile(everything, 99):.1f} |",
        f"| cores used by the API | {spread([round_.api_cores for round_ in polled], 2)} |",
        f"| cores used by the clients | {spread([round_.pollers_cores for round_ in polled], 2)} |",
        f"| job alone, s | {spread(alone)} |",
        f"| job with the clients, s | {spread(beside)} |",
        f"| times slower | {spread(slower, 2)} |",
    ]


def _end(running: Service, job: str) -> dict:
    """A machine that is busy with other things takes its time."""
    return wait_for(lambda: (found := running.job(job, wait=5))["finished_at"] and found, deadline_s=600)


def _seconds(job: dict) -> float:
    """From the beginning of a job to its end."""
    assert job["status"] == "succeeded", job["error"]
    started, finished = (datetime.fromisoformat(job[name]) for name in ("started_at", "finished_at"))
    return (finished - started).total_seconds()


@contextmanager
def _asking(running: Service, job: str) -> Iterator[Callable[[], Polled]]:
    """The pollers, for as long as the block runs; afterwards the call gives what they heard."""
    command = [sys.executable, "-m", "benchmarks.service.poller", running.url, job, str(PER_S)]
    api_before = core_s(running.process.pid)
    clients = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    os.sched_setaffinity(clients.pid, {POLLERS_CORE})

    def heard() -> Polled:
        api_s = core_s(running.process.pid) - api_before
        told = json.loads(clients.communicate()[0])
        statuses, seconds = np.array(told["answers"]).T
        assert set(statuses) <= {200, 304}, set(statuses)
        return Polled(
            per_s=len(seconds) / told["seconds"],
            milliseconds=1000 * seconds,
            unchanged=float(np.mean(statuses == 304)),
            api_cores=api_s / told["seconds"],
            pollers_cores=told["cpu_s"] / told["seconds"],
        )

    yield heard


def _percentile(milliseconds: np.ndarray, percent: float) -> float:
    return float(np.percentile(milliseconds, percent))
