"""Readiness: whether this process can answer, and what else of the service is missing, part by part.

Only the database decides: without it nothing can be answered. A worker, its network, the files or room on the disk
that are missing are the same for every process of the service, so that a balancer that went by them would take all of
them out at once, and with them every answer that needs none of it.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from service.observability.disk import Disk
from service.store.blobs import Blobs
from service.store.database import connect
from service.store.jobs.queries import JobRepository
from service.store.workers import WorkerHeartbeat, WorkerRepository

# Anybody may ask, and a bucket asks for money: one look answers all who come within this time.
HOLDS_FOR_S = 1.0
# Whoever asks has an answer after this, whatever hangs.
LIMIT_S = 2.0
DECIDES = "database"


@dataclass(frozen=True)
class ComponentState:
    """A part of the service: whether it is there, and what there is to say about it."""

    ok: bool
    says: str = "ok"


HANGS = ComponentState(False, f"gave no answer within {LIMIT_S:g} s")
ComponentStates = dict[str, ComponentState]


class Readiness:
    """Checks database, files, room on the disk, workers and their networks.

    In threads and on connections of its own: those that answer requests may all be waiting for what hangs. A check that
    hangs is begun again only after its end.
    """

    def __init__(self, database_url: str, blobs: Blobs, disk: Disk, silence_s: float) -> None:
        self._engine = connect(database_url)
        self._jobs, self._workers = JobRepository(self._engine), WorkerRepository(self._engine)
        self._blobs = blobs
        self._disk = disk
        self._silence_s = silence_s
        # By the parts that each tells of.
        self._checks: Mapping[tuple[str, ...], Callable[[], ComponentStates]] = {
            (DECIDES,): lambda: {DECIDES: _answers(self._jobs.check, "cannot be read")},
            ("blobs",): lambda: {"blobs": _answers(self._blobs.check, "cannot be reached")},
            ("disk",): lambda: {"disk": self._room()},
            ("worker", "model"): self._worker,
        }
        self._threads = ThreadPoolExecutor(len(self._checks), thread_name_prefix="readiness")
        self._running: dict[tuple[str, ...], asyncio.Future[ComponentStates]] = {}
        self._one_at_a_time = asyncio.Lock()
        self._seen: ComponentStates = {}
        self._seen_at = float("-inf")

    async def look(self) -> ComponentStates:
        """Every part by its name, not older than a second."""
        # Those who come meanwhile wait here: one look is enough for all.
        async with self._one_at_a_time:
            if time.monotonic() - self._seen_at > HOLDS_FOR_S:
                self._seen = await self._look()
                self._seen_at = time.monotonic()
            return self._seen

    def close(self) -> None:
        """Let the database go."""
        self._threads.shutdown(wait=False, cancel_futures=True)
        self._engine.dispose()

    async def _look(self) -> ComponentStates:
        for names, check in self._checks.items():
            if names not in self._running:
                self._running[names] = asyncio.get_running_loop().run_in_executor(self._threads, check)
        await asyncio.wait(self._running.values(), timeout=LIMIT_S)
        parts: ComponentStates = {}
        for names, answer in list(self._running.items()):
            if answer.done():
                parts |= answer.result()
                del self._running[names]
            else:
                parts |= dict.fromkeys(names, HANGS)
        return parts

    def _room(self) -> ComponentState:
        try:
            free = self._disk.free_bytes()
        except OSError as error:
            return ComponentState(False, f"cannot be read: {type(error).__name__}")
        least = self._disk.min_free_bytes
        if free is None or free >= least:
            return ComponentState(True)
        return ComponentState(False, f"{free / 1e6:.0f} MB free, {least / 1e6:.0f} needed: uploads are refused")

    def _worker(self) -> ComponentStates:
        try:
            alive = self._workers.alive(self._silence_s)
        except Exception:  # the database is already named above
            alive = []
        if not alive:
            return {
                "worker": ComponentState(False, "none gave a sign of life"),
                "model": ComponentState(False, "unknown: only workers have it"),
            }
        return {"worker": ComponentState(True), "model": _model(alive)}


def _answers(check: Callable[[], None], otherwise: str) -> ComponentState:
    try:
        check()
    except Exception as error:  # whatever a driver or a store says
        return ComponentState(False, f"{otherwise}: {type(error).__name__}")
    return ComponentState(True)


def _model(alive: list[WorkerHeartbeat]) -> ComponentState:
    """The network: one hash, or for the minutes of an upgrade several."""
    missing = [worker.name for worker in alive if worker.model_sha256 is None]
    if missing:
        return ComponentState(False, f"missing at {', '.join(missing)}")
    hashes = sorted({worker.model_sha256 for worker in alive if worker.model_sha256})
    return ComponentState(True, f"{'ok' if len(hashes) == 1 else 'several'}: {', '.join(hashes)}")
