"""Reads of jobs that clients share: all that ask for a job before its read begins get the same answer.

A production tool polls one job from many places. Each answer shows the job as it is after its request came, so a read
that has begun is not shared with anybody who comes later: they share the next one.
"""

import asyncio
from collections.abc import Callable

from starlette.concurrency import run_in_threadpool

from service.schemas.job import Job

# More threads only wait for each other, which cost the slowest of fifty pollers a second.
AT_ONCE = 2


class SharedReads:
    """Reads jobs by id in few threads."""

    def __init__(self, read: Callable[[str], Job | None]) -> None:
        self._read = read
        self._turns = asyncio.Semaphore(AT_ONCE)
        self._next: dict[str, asyncio.Task[Job | None]] = {}

    async def get(self, job_id: str) -> Job | None:
        """Return a job as it is after this call, None if there is none."""
        reading = self._next.get(job_id)
        if reading is None:
            reading = self._next[job_id] = asyncio.create_task(self._when_its_turn_comes(job_id))
        # A client that goes away must not end the read of the others.
        return await asyncio.shield(reading)

    async def _when_its_turn_comes(self, job_id: str) -> Job | None:
        async with self._turns:
            del self._next[job_id]
            return await run_in_threadpool(self._read, job_id)
