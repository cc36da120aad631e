"""What the list of all venues shows of each: how its last calibration ended, and the curve of those before.

It is put together when a calibration ends: a list of fifty venues would else read two thousand results.
"""

from __future__ import annotations

from collections.abc import Collection
from datetime import datetime

import sqlalchemy as sa
from pydantic import Field

from service.store import tables
from service.store.engine import Repository, reading
from service.wire.base import Wire
from service.wire.health import Alarm
from service.wire.names import Status
from service.wire.results import AnyResult, Result, Verdict

IN_CURVE = 40
q = tables.venue_quality.c
a = tables.alarms.c


class Ended(Wire):
    """The last calibration of a venue that ended; what needs a result is None without one."""

    status: Status
    finished_at: datetime
    dry_run: bool
    verdict: Verdict | None = None
    stitch_error_px: float | None = None
    moved_px: float | None = None


class Glance(Wire):
    """That, and of the last results the stitch errors, oldest first, with the limit of the gate."""

    last: Ended
    errors: list[float | None] = Field([])
    limit_px: float | None = None


class Glances(Repository):
    """What is known of venues at a glance."""

    def of(self, venues: Collection[str]) -> dict[str, Glance]:
        """By venue, of those that were ever calibrated."""
        query = sa.select(q.venue, q.glance).where(q.venue.in_(venues), q.glance.is_not(None))
        with reading(self._engine) as connection:
            return {row.venue: Glance.model_validate(row.glance) for row in connection.execute(query)}

    def alarms(self, venues: Collection[str]) -> dict[str, list[Alarm]]:
        """Those that ring, the oldest first."""
        query = sa.select(tables.alarms).where(a.venue.in_(venues)).order_by(a.since, a.rule, a.camera)
        ringing: dict[str, list[Alarm]] = {}
        with reading(self._engine) as connection:
            for row in connection.execute(query):
                alarm = Alarm(rule=row.rule, camera=row.camera or None, since=row.since, why=row.why)
                ringing.setdefault(row.venue, []).append(alarm)
        return ringing


def note_end(
    connection: sa.Connection, venue_id: str, status: Status, result: AnyResult | None, at: datetime, *, dry_run: bool
) -> None:
    """A calibration of a venue has ended, inside the caller's serialised transaction."""
    known = connection.scalar(sa.select(q.glance).where(q.venue == venue_id))
    before = Glance.model_validate(known) if known else None
    errors, limit = (before.errors, before.limit_px) if before else ([], None)
    last = Ended(status=status, finished_at=at, dry_run=dry_run)
    if isinstance(result, Result):
        moved = [camera.moved.pixels for camera in result.cameras if camera.moved.pixels is not None]
        found = {"verdict": result.verdict, "stitch_error_px": result.stitch_error_px}
        last = last.model_copy(update={**found, "moved_px": max(moved, default=None)})
        errors, limit = [*errors, result.stitch_error_px][-IN_CURVE:], result.stitch_error_limit_px
    glance = Glance(last=last, errors=errors, limit_px=limit).model_dump(mode="json")
    # Of a venue that was deleted meanwhile there is nothing to be shown.
    connection.execute(sa.update(tables.venue_quality).where(q.venue == venue_id).values(glance=glance))
