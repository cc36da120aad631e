"""Runs of programs that compute answers to requests at once."""

import asyncio
import os
import subprocess
from collections.abc import AsyncIterator, Mapping, Sequence
from contextlib import AbstractAsyncContextManager, asynccontextmanager

import structlog
from starlette.concurrency import run_in_threadpool

from service import child_process
from service.schemas.problems import Problem

log = structlog.get_logger()
# Exit status of a program that cannot do what it was asked, and has said why on its standard error.
REFUSALS = {os.EX_UNAVAILABLE: "extra-missing", os.EX_DATAERR: "view-too-large"}
# The first picture takes about a second, and a page asks for several at once.
PATIENCE_S = 20.0
BUSY = "Other pictures are being drawn."


class ProgramPool:
    """Runs of a program, `at_once` of them; other requests wait for their turn without a thread, which all need."""

    def __init__(
        self,
        name: str,
        command: Sequence[str],
        environment: Mapping[str, str],
        longest_s: float,
        *,
        at_once: int = 1,
        busy: str = BUSY,
        again_s: int = 2,
    ) -> None:
        """`name`: what a run makes; `environment`, `longest_s`: see `run_program`; `busy`, `again_s`: see `turn_of`."""
        self._arguments = name, command, environment, longest_s
        self._busy, self._again_s = busy, again_s
        self._turns = asyncio.Semaphore(at_once)

    async def run(self, given: bytes) -> bytes:
        """Return what the program answers to `given` bytes, in turn."""
        async with self.turn():
            return await run_in_threadpool(self.run_in_this_thread, given)

    def run_in_this_thread(self, given: bytes) -> bytes:
        """Return what the program answers, in the thread of the caller, who has a turn."""
        return run_program(*self._arguments, given)

    def turn(self) -> AbstractAsyncContextManager[None]:
        """Hold one of the places of the pool."""
        return turn_of(self._turns, self._busy, self._again_s)


@asynccontextmanager
async def turn_of(lock: asyncio.Lock | asyncio.Semaphore, busy: str = BUSY, again_s: int = 2) -> AsyncIterator[None]:
    """Hold a lock. After `PATIENCE_S` raises the problem that it is `busy`, and to come again after `again_s`."""
    try:
        async with asyncio.timeout(PATIENCE_S):
            await lock.acquire()
    except TimeoutError:
        raise Problem("unavailable", busy, headers={"Retry-After": str(again_s)}) from None
    try:
        yield
    finally:
        lock.release()


def run_program(
    name: str, command: Sequence[str], environment: Mapping[str, str], longest_s: float, given: bytes
) -> bytes:
    """Return what a program writes to its standard output when it is `given` bytes on its standard input.

    Raises the problem of `REFUSALS` for a program that says why it cannot do it, `unavailable` after `longest_s`.
    """
    try:
        done = subprocess.run(
            command,
            input=given,
            env={**child_process.without_secrets(), **environment},
            capture_output=True,
            timeout=longest_s,
            check=True,
        )
    except subprocess.TimeoutExpired as error:
        raise Problem("unavailable", f"The {name} was not done after {longest_s:g} s.") from error
    except subprocess.CalledProcessError as error:
        said = error.stderr.decode(errors="replace")
        if error.returncode in REFUSALS:
            raise Problem(REFUSALS[error.returncode], f"{said.strip()}.") from None
        log.error("a program failed", program=name, stderr=said[-2000:])
        raise
    return done.stdout
