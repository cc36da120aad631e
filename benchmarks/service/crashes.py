"""Workers killed at random moments of a job, the API at random moments of a submission, in both homes.

Afterwards the books are compared (`testbed.books`): every accepted job ended once, no pose moved twice, nothing open,
no row, queue entry or file that belongs to nothing. A difference ends the benchmark.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import sqlalchemy as sa

from benchmarks.service.stage import SERVERS, homes, service, spread
from service.serving import YOUNG_S
from service.store import tables
from testbed.books import settle
from testbed.homes import Home
from testbed.killing import (
    chance,
    kill_api,
    kill_kept_worker,
    kill_worker_of_several,
    moment,
    seconds_of_a_job,
    seconds_of_a_submission,
    submitted,
)
from testbed.running import Service, wait_for

COMPUTES = "accept 1"


def table(options: argparse.Namespace) -> list[str]:
    """A row per what is killed and home."""
    lines = [
        f"{options.moments} random moments each, from the submission to a tenth beyond the end. Afterwards jobs, "
        "poses, queue and files add up.",
        "",
        "| killed | home | jobs | ended as succeeded | attempts | s from the kill to the end | s to a takeover |",
        "|---|---|---|---|---|---|---|",
    ]
    with homes() as both:
        for name, home in both.items():
            lines.append(f"| worker of `esc up` | {name} | {_kept_workers(home, options.moments)} | |")
        lines.append(f"| one of two workers | {SERVERS} | {_workers_of_two(both[SERVERS], options.moments)} |")
        for name, home in both.items():
            lines.append(f"| API of `esc up` | {name} | {_apis(home, options.moments)} | |")
    return lines


def _kept_workers(home: Home, moments: int) -> str:
    ends, seconds = [], []
    drawn = chance()
    with service(home) as running:
        running.ready()
        whole = seconds_of_a_job(running, running.venue("alone", COMPUTES))
        for number in range(moments):
            # One that died young is started again ever later: that is another matter.
            time.sleep(YOUNG_S)
            ended, after_s = kill_kept_worker(running, running.venue(f"v{number}", COMPUTES), moment(drawn, whole))
            ends.append(ended)
            seconds.append(after_s)
        settle(running)
    return f"{_told(ends)} | {spread(seconds)}"


def _workers_of_two(home: Home, moments: int) -> str:
    ends, seconds, takeovers = [], [], []
    drawn = chance()
    with service(home, "serve") as running:
        names = ("one", "two")
        workers = {name: running.worker_beside(_machine(running, name), name) for name in names}
        try:
            running.ready()
            whole = seconds_of_a_job(running, running.venue("alone", COMPUTES))
            for number in range(moments):
                wait_for(lambda: _alive(running) == set(names))
                death = kill_worker_of_several(
                    running, workers, running.venue(f"v{number}", COMPUTES), moment(drawn, whole)
                )
                ends.append(death.job)
                seconds.append(death.to_end_s)
                if death.to_takeover_s is not None:
                    takeovers.append(death.to_takeover_s)
                wait_for(lambda name=death.worker: name not in _alive(running))
                workers[death.worker] = running.worker_beside(_machine(running, death.worker), death.worker)
            settle(running)
        finally:
            for process in workers.values():
                process.kill()
                process.wait()
    return f"{_told(ends)} | {spread(seconds)} | {spread(takeovers)}, {len(takeovers)} times"


def _apis(home: Home, moments: int) -> str:
    ends, seconds, kept = [], [], 0
    drawn = chance()
    with service(home) as running:
        running.ready()
        whole = seconds_of_a_submission(running, running.venue("alone"))
        for number in range(moments):
            venue = running.venue(f"v{number}")
            promised = kill_api(running, venue, "key", moment(drawn, whole))
            begun = time.monotonic()
            if promised is None and number % 2:
                continue  # a client that does not come back
            job = submitted(running, venue, "key")
            assert promised in (None, job), f"{promised} was promised, {job} is the job"
            kept += promised is not None
            ends.append(running.end(job))
            seconds.append(time.monotonic() - begun)
        settle(running)
    return f"{_told(ends)}, {kept} of them promised before the kill | {spread(seconds)}"


def _told(jobs: list[dict]) -> str:
    succeeded = sum(job["status"] == "succeeded" for job in jobs)
    attempts = [job["attempt"] for job in jobs]
    counts = ", ".join(f"{attempts.count(number)} x {number}" for number in sorted(set(attempts)))
    return f"{len(jobs)} | {succeeded} | {counts}"


def _machine(running: Service, name: str) -> Path:
    return running.data.parent / name


def _alive(running: Service) -> set[str]:
    """Those with a row: it goes when others have taken a worker for dead."""
    with running.database() as connection:
        return set(connection.scalars(sa.select(tables.workers.c.name)))
