"""Waiting for jobs and venues: one small query of each, a few times a second, for everybody who waits."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import Generic, TypeVar

import structlog
from starlette.concurrency import run_in_threadpool

INTERVAL_S = 0.25
State = TypeVar("State")
log = structlog.get_logger()


class Watch(Generic[State]):
    """Tells coroutines when the state of a thing is the one they wait for."""

    def __init__(self, read: Callable[[Collection[str]], Mapping[str, State]]) -> None:
        self._read = read
        self._waiting: dict[asyncio.Future[None], tuple[str, Callable[[State], bool]]] = {}
        self._someone = asyncio.Event()
        self._closed = False

    @property
    def closed(self) -> bool:
        """Whether the service is going down, so that nobody should wait again."""
        return self._closed

    async def until(self, name: str, reached: Callable[[State], bool], timeout_s: float) -> None:
        """Return when `reached` holds of what has this name, after `timeout_s`, or when the service goes down."""
        if self._closed:
            return
        future: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._waiting[future] = (name, reached)
        self._someone.set()
        try:
            with suppress(TimeoutError):
                await asyncio.wait_for(future, timeout_s)
        finally:
            del self._waiting[future]

    async def run(self) -> None:
        """Look after the waiting ones, for as long as the service runs."""
        while True:
            await self._someone.wait()
            try:
                states = await run_in_threadpool(self._read, {name for name, _ in self._waiting.values()})
            except Exception:  # the database is away for a moment: they keep waiting, up to their time
                log.warning("cannot read what is waited for", exc_info=True)
                states = {}
            for future, (name, reached) in self._waiting.items():
                state = states.get(name)
                if state is not None and reached(state) and not future.done():
                    future.set_result(None)
            if not self._waiting:
                self._someone.clear()
            await asyncio.sleep(INTERVAL_S)

    def close(self) -> None:
        """Let everybody go, at once."""
        self._closed = True
        for future in self._waiting:
            if not future.done():
                future.set_result(None)


class Places:
    """So many may be somewhere at once. To be asked in the event loop."""

    def __init__(self, count: int) -> None:
        self._free = count

    @contextmanager
    def taken(self, refusal: Callable[[], Exception]) -> Iterator[None]:
        """One of them, if there is one left; raises the refusal if there is none."""
        if not self._free:
            raise refusal()
        self._free -= 1
        try:
            yield
        finally:
            self._free += 1
