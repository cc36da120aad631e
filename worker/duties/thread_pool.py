"""A bounded thread pool for work that may take long, so that the duty that submits it goes on meanwhile."""

from collections import Counter
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait

import structlog

log = structlog.get_logger()


class BoundedThreadPool:
    """A thread pool that knows how many of its threads are free, and for whom the others work.

    Its methods are called from one thread.
    """

    def __init__(self, count: int, name: str) -> None:
        self._count = count
        self._pool = ThreadPoolExecutor(count, thread_name_prefix=name)
        self._busy: dict[Future[None], str] = {}

    @property
    def free_threads(self) -> int:
        """Number of threads without work."""
        return self._count - sum(self.busy_by_owner.values())

    @property
    def busy_by_owner(self) -> Counter[str]:
        """Number of busy threads by owner."""
        self._busy = {future: owner for future, owner in self._busy.items() if not future.done()}
        return Counter(self._busy.values())

    def begin(self, work: Callable[[], None], owner: str) -> None:
        """Run the work in a free thread."""
        self._busy[self._pool.submit(_run, work, owner)] = owner

    def wait_for_free(self, at_most_s: float) -> None:
        """Wait until the first thread is free, at most so many seconds."""
        wait(self._busy, at_most_s, FIRST_COMPLETED)

    def wait_all(self, at_most_s: float | None = None) -> None:
        """Wait until all threads are free, at most so many seconds; None: without a limit."""
        wait(self._busy, at_most_s)


def _run(work: Callable[[], None], owner: str) -> None:
    try:
        work()
    except Exception:  # the database or the store is away: what was not done is due again
        log.warning("failed, it is tried again", owner=owner, exc_info=True)
