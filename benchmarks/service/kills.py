"""Worker, API or database killed at a moment that a seed draws, amid submissions and jobs, in both homes.

Afterwards every job whose submission was answered has ended as it was asked, each once, and the books add up
(`testbed.books`): no accepted job lost, none applied twice. A difference ends the benchmark, and its seed is the last
that was printed: `--only kills --seeds 1 --seed N` plays it again. `--only takeovers`: one of two workers is killed at
moments of its jobs, and the other one takes over.
"""

from __future__ import annotations

import argparse
import os
import random
import secrets
import signal
import sys
import threading
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from subprocess import Popen

import httpx
import sqlalchemy as sa

from benchmarks.printing import spread
from benchmarks.service.stage import EMBEDDED, SERVERS, SURE, homes, service
from service.serving import MIN_HEALTHY_UPTIME_S
from service.store import tables
from testbed.books import settle
from testbed.homes import Home, Servers
from testbed.killing import A_LITTLE_LONGER, chance, kill_worker_of_several, moment, seconds_of_a_job, submitted
from testbed.running import Service, wait_for

VICTIMS = ("worker", "API", "database")
COMPUTES, TAKEN_OVER = "accept 0.5", "accept 1"
MOST_JOBS = 3
# About what each takes, on a machine that does other things too: a seed stands for the same moment on all machines.
SUBMISSION_S, JOB_S = 0.1, 1.5


@dataclass
class Tally:
    """Totals of one victim in one home: jobs, those promised before the kill, attempts, seconds to the end."""

    jobs: int = 0
    promised: int = 0
    attempts: list[int] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)


def table(options: argparse.Namespace) -> list[str]:
    """A row per victim and home."""
    first = options.seed if options.seed is not None else secrets.randbelow(10**6)
    seeds = range(first, first + options.seeds)
    tallies = {(victim, name): Tally() for victim in VICTIMS for name in (EMBEDDED, SERVERS)}
    with homes(SURE) as both, service(both[EMBEDDED]) as embedded, service(both[SERVERS]) as servers:
        stages = {EMBEDDED: embedded, SERVERS: servers}
        for seed in seeds:
            drawn = random.Random(seed)
            name, victim = drawn.choice(list(stages)), drawn.choice(VICTIMS)
            _round(stages[name], both[name], seed, victim, drawn, tallies[victim, name])
    return [
        f"Seeds {seeds[0]} to {seeds[-1]}, {len(seeds)} rounds: every job that was accepted ended as succeeded, none "
        "moved its venue twice, and jobs, poses, queue and files add up after each.",
        "",
        "| killed | home | rounds | jobs | promised before the kill | attempts | s from the kill to the last end |",
        "|---|---|---|---|---|---|---|",
        *(f"| {victim} | {name} | {_told(tally)} |" for (victim, name), tally in tallies.items()),
    ]


def _round(running: Service, home: Home, seed: int, victim: str, drawn: random.Random, tally: Tally) -> None:
    jobs = drawn.randint(1, MOST_JOBS)
    # As many amid the submissions as amid what comes of them.
    after_s = drawn.uniform(0, A_LITTLE_LONGER * jobs * drawn.choice((SUBMISSION_S, JOB_S)))
    print(f"seed {seed}: {victim} of {type(home).__name__} after {after_s:.3f} s, {jobs} jobs", file=sys.stderr)
    running.ready()
    # A worker that died young is started again ever later: that is another matter.
    time.sleep(MIN_HEALTHY_UPTIME_S)
    venues = [running.venue(f"v{seed}-{number}", COMPUTES) for number in range(jobs)]
    promised: dict[str, str] = {}

    def submit() -> None:
        for venue in venues:
            try:
                promised[venue] = submitted(running, venue, "key")
            except (httpx.TransportError, httpx.HTTPStatusError):
                return

    client = threading.Thread(target=submit)
    client.start()
    time.sleep(after_s)
    _kill(running, home, victim, client.join)
    killed = time.monotonic()
    # What nobody was promised is sent again, with the same key.
    ids = {venue: _insisted(running, venue) for venue in venues}
    assert all(ids[venue] == job for venue, job in promised.items()), f"{promised} were promised, {ids} are the jobs"
    ended = [running.end(job) for job in ids.values()]
    assert [job["status"] for job in ended] == ["succeeded"] * jobs, ended
    tally.seconds.append(time.monotonic() - killed)
    settle(running)
    tally.jobs += jobs
    tally.promised += len(promised)
    tally.attempts += [job["attempt"] for job in ended]


def _kill(running: Service, home: Home, victim: str, client_left: Callable[[], None]) -> None:
    """Kill it, and start again what nobody else does."""
    if victim == "database" and isinstance(home, Servers):
        home.kill_database()
        client_left()
        return
    if victim in ("worker", "database"):
        os.kill(running.worker(), signal.SIGKILL)
    if victim == "worker":
        client_left()
        return
    # SQLite is in the processes that use it: it dies with both.
    running.process.kill()
    client_left()
    running.gone()
    running.start()


def _insisted(running: Service, venue: str) -> str:
    """The job of a submission, asked for until it is answered."""

    def again() -> str | None:
        try:
            return submitted(running, venue, "key")
        except httpx.HTTPStatusError as error:
            if error.response.status_code != httpx.codes.SERVICE_UNAVAILABLE:
                raise
            # The database is starting again.
            return None

    return wait_for(again)


def takeovers(options: argparse.Namespace) -> list[str]:
    """Kill one of two workers at random moments of a job, and measure until the other one takes it over."""
    ends, seconds, takeovers = [], [], []
    drawn = chance()
    with homes() as both, service(both[SERVERS], "serve") as running, ExitStack() as stack:

        def work(name: str) -> Popen:
            process = running.worker_beside(running.data.parent / name, name)
            stack.callback(process.wait)
            stack.callback(process.kill)
            return process

        workers = {name: work(name) for name in ("one", "two")}
        running.ready()
        whole = seconds_of_a_job(running, running.venue("alone", TAKEN_OVER))
        for number in range(options.moments):
            wait_for(lambda: _registered_workers(running) == set(workers))
            venue = running.venue(f"v{number}", TAKEN_OVER)
            death = kill_worker_of_several(running, workers, venue, moment(drawn, whole))
            ends.append(death.job)
            seconds.append(death.to_end_s)
            if death.to_takeover_s is not None:
                takeovers.append(death.to_takeover_s)
            wait_for(lambda name=death.worker: name not in _registered_workers(running))
            workers[death.worker] = work(death.worker)
        settle(running)
    succeeded = sum(job["status"] == "succeeded" for job in ends)
    return [
        f"{options.moments} random moments, from the submission to a tenth beyond the end.",
        "",
        "| jobs | ended as succeeded | attempts | s from the kill to the end | s to a takeover |",
        "|---|---|---|---|---|",
        f"| {len(ends)} | {succeeded} | {_counts([job['attempt'] for job in ends])} | {spread(seconds)} "
        f"| {spread(takeovers)}, {len(takeovers)} times |",
    ]


def _registered_workers(running: Service) -> set[str]:
    """Names of the workers with a row, which goes when others have taken a worker for dead."""
    with running.database() as connection:
        return set(connection.scalars(sa.select(tables.workers.c.name)))


def _counts(attempts: list[int]) -> str:
    return ", ".join(f"{attempts.count(number)} x {number}" for number in sorted(set(attempts)))


def _told(tally: Tally) -> str:
    return (
        f"{len(tally.seconds)} | {tally.jobs} | {tally.promised} | {_counts(tally.attempts)} | {spread(tally.seconds)}"
    )
