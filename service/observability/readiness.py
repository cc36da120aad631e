"""Readiness of an API process, and the state of each part of the service.

Only the database decides: without it nothing can be answered. A missing worker or network, missing files or disk space
are the same for every process, so that a load balancer which used them would remove all processes at once, and with
them every answer that needs none of these.
"""

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

# Anybody may ask, and a bucket costs money: a result is reused for this time.
HOLDS_FOR_S = 1.0
# Time limit of an answer, even if checks hang.
LIMIT_S = 2.0
DECIDES = "database"


@dataclass(frozen=True)
class ComponentState:
    """State of a part of the service: whether it works, and a sentence about it."""

    ok: bool
    says: str = "ok"


HANGS = ComponentState(False, f"gave no answer within {LIMIT_S:g} s")
ComponentStates = dict[str, ComponentState]


class Readiness:
    """Checks of database, files, disk space, workers and their networks.

    They have their own threads and connections, since those of requests may all be waiting for a part that hangs. A
    check that hangs is not started again before its end.
    """

    def __init__(self, database_url: str, blobs: Blobs, disk: Disk, silence_s: float) -> None:
        self._engine = connect(database_url)
        self._jobs, self._workers = JobRepository(self._engine), WorkerRepository(self._engine)
        self._blobs = blobs
        self._disk = disk
        self._silence_s = silence_s
        # By the parts that each check reports.
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
        """Return the state of every part by name, at most a second old."""
        # Concurrent requests wait here and share one check.
        async with self._one_at_a_time:
            if time.monotonic() - self._seen_at > HOLDS_FOR_S:
                self._seen = await self._look()
                self._seen_at = time.monotonic()
            return self._seen

    def close(self) -> None:
        """Stop the checks and close the connections."""
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
    """Return the state of the networks of workers: one hash, or several during an upgrade."""
    missing = [worker.name for worker in alive if worker.model_sha256 is None]
    if missing:
        return ComponentState(False, f"missing at {', '.join(missing)}")
    hashes = sorted({worker.model_sha256 for worker in alive if worker.model_sha256})
    return ComponentState(True, f"{'ok' if len(hashes) == 1 else 'several'}: {', '.join(hashes)}")
