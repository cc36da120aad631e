"""Summaries of venues for the list of all venues: their last calibrations and active alarms."""

from collections.abc import Collection

import sqlalchemy as sa

from service.schemas.health import Alarm
from service.store import tables
from service.store.database import Repository, reading
from service.store.statistics.venue_quality import CalibrationSummary, summary_in
from service.store.venue_state import active_alarms

q = tables.venue_quality.c


class VenueSummaryRepository(Repository):
    """The calibration summaries and active alarms of venues."""

    def of(self, venues: Collection[str]) -> dict[str, CalibrationSummary]:
        """Return the summaries of venues that were ever calibrated, by venue."""
        query = sa.select(q.venue, q.glance).where(q.venue.in_(venues), q.glance.is_not(None))
        with reading(self._engine) as connection:
            found = {row.venue: summary_in(row) for row in connection.execute(query)}
        return {venue: summary for venue, summary in found.items() if summary is not None}

    def alarms(self, venues: Collection[str]) -> dict[str, list[Alarm]]:
        """Return the active alarms of venues, the oldest first, by venue."""
        with reading(self._engine) as connection:
            return active_alarms(connection, venues)
