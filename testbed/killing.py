"""Processes of a running service, killed in the middle of a job or of a submission."""

import os
import random
import secrets
import signal
import sys
import threading
import time
from contextlib import suppress
from dataclasses import dataclass
from subprocess import Popen

import httpx

from testbed.running import Service, computing, wait_for

# Beyond the time that something takes when nobody disturbs it: the last moments of it are of interest too.
A_LITTLE_LONGER = 1.1
# Set to the number that a failed run printed, the moments are drawn as they were then.
SEED = "ESC_TEST_SEED"


@dataclass(frozen=True)
class Death:
    """Death of a worker and the end of its job: seconds from the kill to both, and to the takeover if it had begun."""

    worker: str
    job: dict
    to_end_s: float
    to_takeover_s: float | None


def chance() -> random.Random:
    """Random generator whose seed is printed: pytest shows it when a test fails."""
    seed = int(os.environ.get(SEED) or secrets.randbits(32))
    print(f"{SEED}={seed}", file=sys.stderr)
    return random.Random(seed)


def moment(chance: random.Random, of_s: float) -> float:
    """A random one, counted from the beginning of what takes `of_s`."""
    after_s = chance.uniform(0, A_LITTLE_LONGER * of_s)
    print(f"kill after {after_s:.4f} s", file=sys.stderr)
    return after_s


def seconds_of_a_job(service: Service, venue: str) -> float:
    """From its submission to its end."""
    begun = time.monotonic()
    job = service.submit(venue).json()["id"]
    wait_for(lambda: service.job(job)["status"] not in ("queued", "running"))
    return time.monotonic() - begun


def seconds_of_a_submission(service: Service, venue: str) -> float:
    """Until its answer; the job is taken back."""
    begun = time.monotonic()
    answer = service.submit(venue).raise_for_status()
    seconds = time.monotonic() - begun
    service.http.post(f"/jobs/{answer.json()['id']}/cancel").raise_for_status()
    return seconds


def kill_kept_worker(service: Service, venue: str, after_s: float) -> tuple[dict, float]:
    """The end of a job during which the worker of `esc up` was killed, and the seconds from there to here."""
    job = service.submit(venue).raise_for_status().json()["id"]
    time.sleep(after_s)
    os.kill(service.worker(), signal.SIGKILL)
    killed = time.monotonic()
    return service.end(job), time.monotonic() - killed


def kill_worker_of_several(service: Service, workers: dict[str, Popen], venue: str, after_s: float) -> Death:
    """Kill the worker that computes the job, or the first, at a moment of a job; it stays dead until the job ended."""
    job = service.submit(venue).raise_for_status().json()["id"]
    time.sleep(after_s)
    name = next((name for name, process in workers.items() if computing(process.pid)), next(iter(workers)))
    workers[name].kill()
    killed = time.monotonic()
    workers[name].wait()
    before = service.job(job)
    to_takeover_s = None
    if before["status"] == "running":
        wait_for(lambda: service.job(job)["attempt"] > before["attempt"])
        to_takeover_s = time.monotonic() - killed
    return Death(name, service.end(job), time.monotonic() - killed, to_takeover_s)


def kill_api(service: Service, venue: str, key: str, after_s: float) -> str | None:
    """Kill the service in the course of a submission and start it again; gives the job, if one was promised."""
    promised = []

    def submit() -> None:
        with suppress(httpx.TransportError):
            promised.append(submitted(service, venue, key))

    client = threading.Thread(target=submit)
    client.start()
    time.sleep(after_s)
    service.process.kill()
    client.join()
    service.gone()
    service.start()
    return promised[0] if promised else None


def submitted(service: Service, venue: str, key: str) -> str:
    """The job that a submission with this key is."""
    return service.submit(venue, headers={"Idempotency-Key": key}).raise_for_status().json()["id"]
