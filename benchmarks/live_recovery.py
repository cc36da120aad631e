"""Tracked cameras that are lost, and a service that finds them again: `esc live --recover` and the real engine.

The first camera is knocked or zoomed and stays so; what it sends afterwards is judged by where it then is.
"""

from __future__ import annotations

import json
import time

import httpx
import numpy as np

from benchmarks.live_faults import Fault, filmed
from benchmarks.live_running import VENUE, Film, LiveRun
from benchmarks.service.load import ENGINE
from benchmarks.service.stage import service
from models import MODEL_PATH
from testbed.homes import Embedded

# From what happens until a job has ended at the latest, and how long poses are judged afterwards.
JOB_S, AFTERWARDS_S, LOOK_EVERY_S = 180.0, 20.0, 1.0
# Of the faults, those that a job has to mend.
LOSING_ZOOM, LOSING_KNOCK = -2, -1


def run_recoveries(film: Film, every: int) -> None:
    """Have each happen to the first camera of a service of its own, and print what became of it."""
    print(
        "| what happens | job | measured after, s | turn off, ° rms, and in its sigma | before the job, in its sigma |"
    )
    print("|---" * 5 + "|", flush=True)
    settings = {"ESC_MODEL": str(MODEL_PATH), "ESC_JOB_PROGRAM": json.dumps(ENGINE), "ESC_THREADS": "1"}
    for number in (LOSING_ZOOM, LOSING_KNOCK):
        with (
            service(Embedded(), **settings) as serving,
            filmed(film, every, "--recover", url=serving.ready().url) as (run, listed),
        ):
            print(row(run, listed[number], serving.url), flush=True)


def row(run: LiveRun, fault: Fault, url: str) -> str:
    """Have it happen, wait for the job, and see what is sent then."""
    begun_ns, begun_s = time.time_ns(), time.monotonic()
    what, *more = fault.begin
    run.cameras.happen(str(what), 0, *more)
    job = None
    while job is None and time.monotonic() < begun_s + JOB_S:
        time.sleep(LOOK_EVERY_S)
        jobs = httpx.get(f"{url}/jobs", params={"venue": VENUE}).raise_for_status().json()["jobs"]
        job = next((one for one in jobs if one["finished_at"]), None)
    ended_ns = time.time_ns()
    time.sleep(AFTERWARDS_S)
    first = run.names[0]
    # Two seconds after a job at the latest its poses are sent, and a camera is found anew.
    after = [one for one in run.judged(first, ended_ns + 4e9) if one.sent.status == "measured"]
    before = [one.turn_in_sigma for one in run.judged(first, begun_ns, ended_ns) if one.sent.status == "measured"]
    turn, ratio = np.array([[one.turn_deg, one.turn_in_sigma] for one in after]).T if after else np.full((2, 1), np.nan)
    again_s = (min(one.sent.at_ns for one in after) - begun_ns) / 1e9 if after else np.nan
    for at_ns, words in run.warnings:
        print(f"  +{(at_ns - begun_ns) / 1e9:.1f} s: {words}")
    return (
        f"| {fault.name.partition(' for ')[0]} | {job and job['status']} | {again_s:.1f} "
        f"| {np.sqrt(np.mean(turn**2)):.3f}, {np.sqrt(np.mean(ratio**2)):.2f}, at most {np.max(ratio):.1f} "
        f"| {max(before, default=0.0):.1f} |"
    )
