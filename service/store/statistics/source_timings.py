"""Histogram of the times that sources of cameras take to give a frame."""

from collections.abc import Collection

import structlog

from service.schemas.programs.sources import SourceAnswer
from service.store.database import DATABASE_OUTAGES, Repository, writing
from service.store.statistics import counters
from service.store.statistics.counters import HistogramBuckets

FETCH = HistogramBuckets("source_fetch", (0.1, 0.25, 0.5, 1, 2, 4, 8, 15, 30, 60, 120))
# The outcomes of a fetch.
FRAME, NONE = "frame", "none"
log = structlog.get_logger()


class SourceTimingRepository(Repository):
    """The fetches that the database has counted."""

    def count(self, fetches: Collection[SourceAnswer]) -> None:
        """Count some, each of a source of its own."""
        amounts = counters.total(FETCH.of(fetch.seconds, FRAME if fetch.why is None else NONE) for fetch in fetches)
        try:
            with writing(self._engine) as connection:
                counters.add(connection, amounts)
        except DATABASE_OUTAGES:  # the frames are there all the same
            log.warning("fetches are not counted", exc_info=True)
