"""Summary of a venue for the list of all venues: its last calibration and its recent stitch errors.

It is put together when a calibration ends: a list of fifty venues would else read two thousand results.
"""

from __future__ import annotations

from collections.abc import Collection
from functools import partial
from typing import Any

import sqlalchemy as sa
from pydantic import Field

from service.schemas.base import TOLERANTLY, Schema
from service.schemas.health import Alarm, CalibrationEnd
from service.store import tables
from service.store.database import Repository, reading
from service.store.documents import stored_alarm
from service.store.unreadable import read_or

IN_CURVE = 40
q = tables.venue_quality.c
a = tables.alarms.c


class CalibrationSummary(Schema):
    """The end of a venue's last calibration, and recent stitch errors, oldest first, with the gate's limit."""

    last: CalibrationEnd
    errors: list[float | None] = Field([])
    limit_px: float | None = None


def summary_in(row: Any) -> CalibrationSummary | None:
    """Return the summary in a row of `venue_quality`; None: there is none, or it cannot be read and begins anew."""
    if row.glance is None:
        return None
    read = partial(CalibrationSummary.model_validate, row.glance, **TOLERANTLY)
    return read_or(None, "statistics", row.venue, read)


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


def active_alarms(connection: sa.Connection, venues: Collection[str]) -> dict[str, list[Alarm]]:
    """Return the active alarms of venues, the oldest first, by venue, inside the caller's transaction."""
    query = sa.select(tables.alarms).where(a.venue.in_(venues)).order_by(a.since, a.rule, a.camera)
    alarms: dict[str, list[Alarm]] = {}
    for row in connection.execute(query):
        alarms.setdefault(row.venue, []).append(stored_alarm(row))
    return alarms
