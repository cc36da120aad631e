"""Hands: a few threads for what may take long, so that the duty that gives them work goes on meanwhile."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait

import structlog

log = structlog.get_logger()


class Hands:
    """So many of them, each busy with one thing. To be used from one thread."""

    def __init__(self, count: int, name: str) -> None:
        self._count = count
        self._pool = ThreadPoolExecutor(count, thread_name_prefix=name)
        self._busy: dict[Future[None], str] = {}

    @property
    def free(self) -> int:
        """How many have nothing to do."""
        return self._count - sum(self.busy_with.values())

    @property
    def busy_with(self) -> Counter[str]:
        """How many are busy for whom."""
        self._busy = {doing: whom for doing, whom in self._busy.items() if not doing.done()}
        return Counter(self._busy.values())

    def begin(self, work: Callable[[], None], whom: str) -> None:
        """Have one of the free do it."""
        self._busy[self._pool.submit(_done, work, whom)] = whom

    def until_one_is_free(self, at_most_s: float) -> None:
        """Wait for the first to be done."""
        wait(self._busy, at_most_s, FIRST_COMPLETED)

    def rest(self) -> None:
        """Wait until all are done."""
        wait(self._busy)


def _done(work: Callable[[], None], whom: str) -> None:
    try:
        work()
    except Exception:  # the database or the store is away: what was not done is due again
        log.warning("put off", whom=whom, exc_info=True)
