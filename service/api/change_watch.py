"""Waiting for changes of jobs and venues: one small query each, a few times a second, for all clients that wait."""

import asyncio
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from math import inf
from typing import Generic, TypeVar

import structlog
from starlette.concurrency import run_in_threadpool

from service.schemas.problems import Problem

# A look at a file costs a third of a millisecond, one at a server is a transaction that others share.
INTERVAL_S, FILE_INTERVAL_S = 0.25, 0.1
# Whoever's connection broke finds the place that it had taken for a moment.
AGAIN_S = 5
State = TypeVar("State")
log = structlog.get_logger()


class ChangeWatch(Generic[State]):
    """Wakes coroutines when a job or venue reaches the state that they wait for, by one polling query for all.

    `read` returns states by name; `interval_s`: time between two queries; `patience_s`: all waiters are released after
    nothing could be read for so long.
    """

    def __init__(
        self,
        read: Callable[[Collection[str]], Mapping[str, State]],
        interval_s: float = INTERVAL_S,
        patience_s: float = inf,
    ) -> None:
        self._read = read
        self._interval_s = interval_s
        self._patience_s = patience_s
        self._unread_since: float | None = None
        self._waiting: dict[asyncio.Future[State | None], tuple[str, Callable[[State], bool]]] = {}
        self._has_waiters = asyncio.Event()
        self._closed = False

    @property
    def closed(self) -> bool:
        """True once the service is going down, so that nobody should wait again."""
        return self._closed

    async def until(self, name: str, reached: Callable[[State], bool], timeout_s: float) -> State | None:
        """Return the state of a job or venue once `reached` returns true for it.

        Return None after `timeout_s`, when the service goes down, or when nothing could be read for long.
        """
        if self._closed:
            return None
        future: asyncio.Future[State | None] = asyncio.get_running_loop().create_future()
        self._waiting[future] = (name, reached)
        self._has_waiters.set()
        try:
            with suppress(TimeoutError):
                return await asyncio.wait_for(future, timeout_s)
            return None
        finally:
            del self._waiting[future]

    async def run(self) -> None:
        """Poll for the states that are waited for, until cancelled."""
        while True:
            await self._has_waiters.wait()
            try:
                states = await run_in_threadpool(self._read, {name for name, _ in self._waiting.values()})
                self._unread_since = None
            except Exception:  # the database is away for a moment: they keep waiting, up to their time
                log.warning("cannot read what is waited for", exc_info=True)
                states = {}
                now = asyncio.get_running_loop().time()
                self._unread_since = self._unread_since or now
                if now - self._unread_since > self._patience_s:
                    self._release_all()
            for future, (name, reached) in self._waiting.items():
                state = states.get(name)
                if state is not None and reached(state) and not future.done():
                    future.set_result(state)
            if not self._waiting:
                self._has_waiters.clear()
                # Nobody looks from now on: an outage that goes on is not known to.
                self._unread_since = None
            await asyncio.sleep(self._interval_s)

    def close(self) -> None:
        """Release all waiters, now and later."""
        self._closed = True
        self._release_all()

    def _release_all(self) -> None:
        for future in self._waiting:
            if not future.done():
                future.set_result(None)


class ClientSlots:
    """Limits how many clients wait for an answer (long polls, event streams) at once. To be called in the event loop.

    `what` they do, and the `setting` that says how many, are told to the next one.
    """

    def __init__(self, count: int, what: str, setting: str) -> None:
        self._count = self._free = count
        self._what, self._setting = what, setting

    @contextmanager
    def taken(self) -> Iterator[None]:
        """Take a slot for as long as the block lasts; raises a `Problem` (503) if all are taken."""
        if not self._free:
            raise Problem(
                "unavailable",
                f"{self._count} {self._what} here already, and more may not at once ({self._setting}).",
                headers={"Retry-After": str(AGAIN_S)},
            )
        self._free -= 1
        try:
            yield
        finally:
            self._free += 1
