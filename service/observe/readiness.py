"""Whether all is there that a job needs, part by part."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from dataclasses import dataclass

from starlette.concurrency import run_in_threadpool

from service.observe.disk import Disk
from service.store.blobs import Blobs
from service.store.jobs.reading import Jobs
from service.store.workers import SeenWorker, Workers

# Anybody may ask, and a bucket asks for money: one look answers all who come within this time.
HOLDS_FOR_S = 1.0


@dataclass(frozen=True)
class Part:
    """What a job needs: whether it is there, and what there is to say about it."""

    ok: bool
    says: str = "ok"


class Readiness:
    """Looks at database, files, room on the disk, workers and their networks."""

    def __init__(self, jobs: Jobs, blobs: Blobs, disk: Disk, workers: Workers, silence_s: float) -> None:
        self._jobs = jobs
        self._blobs = blobs
        self._disk = disk
        self._workers = workers
        self._silence_s = silence_s
        self._one_at_a_time = asyncio.Lock()
        self._seen: dict[str, Part] = {}
        self._seen_at = float("-inf")

    async def look(self) -> dict[str, Part]:
        """Every part by its name, not older than a second."""
        # Those who come meanwhile wait here, not in the threads that answer everybody else.
        async with self._one_at_a_time:
            if time.monotonic() - self._seen_at > HOLDS_FOR_S:
                self._seen = await run_in_threadpool(self._look)
                self._seen_at = time.monotonic()
            return self._seen

    def _look(self) -> dict[str, Part]:
        return {
            "database": _answers(self._jobs.check, "cannot be read"),
            "blobs": _answers(self._blobs.check, "cannot be reached"),
            "disk": self._room(),
            **self._worker(),
        }

    def _room(self) -> Part:
        try:
            free = self._disk.free_bytes()
        except OSError as error:
            return Part(False, f"cannot be read: {type(error).__name__}")
        least = self._disk.least_bytes
        if free is None or free >= least:
            return Part(True)
        return Part(False, f"{free / 1e6:.0f} MB free, {least / 1e6:.0f} needed: uploads are refused")

    def _worker(self) -> dict[str, Part]:
        try:
            alive = self._workers.alive(self._silence_s)
        except Exception:  # the database is already named above
            alive = []
        if not alive:
            return {
                "worker": Part(False, "none gave a sign of life"),
                "model": Part(False, "unknown: only workers have it"),
            }
        return {"worker": Part(True), "model": _model(alive)}


def _answers(check: Callable[[], None], otherwise: str) -> Part:
    try:
        check()
    except Exception as error:  # whatever a driver or a store says
        return Part(False, f"{otherwise}: {type(error).__name__}")
    return Part(True)


def _model(alive: list[SeenWorker]) -> Part:
    """The network: one hash, or for the minutes of an upgrade several."""
    missing = [worker.name for worker in alive if worker.model_sha256 is None]
    if missing:
        return Part(False, f"missing at {', '.join(missing)}")
    hashes = sorted({worker.model_sha256 for worker in alive if worker.model_sha256})
    return Part(True, f"{'ok' if len(hashes) == 1 else 'several'}: {', '.join(hashes)}")
