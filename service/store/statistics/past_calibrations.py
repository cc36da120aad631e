"""Ended calibrations of a venue, for pages and charts of hundreds of jobs."""

from collections.abc import Collection
from dataclasses import dataclass
from datetime import datetime
from typing import Any

import sqlalchemy as sa

from service.schemas.geometry import Moved
from service.schemas.history import Cause
from service.schemas.names import OPEN_STATUSES, JobStatus, Verdict
from service.store import tables
from service.store.database import Repository, reading
from service.store.revisions import CALIBRATION_CAUSES
from service.store.unreadable import read_each, reading_row

j = tables.jobs.c
r = tables.revisions.c
# Members that a past calibration has from its result.
OF_RESULTS = (
    *("verdict", "accepted", "rejected_because"),
    *("stitch_error_px", "stitch_error_before_px", "stitch_error_limit_px"),
)


@dataclass(frozen=True)
class PastCalibration:
    """A calibration that has ended; what needs a result is None, or empty, without one.

    `verdict`: the gate's; `accepted`: of all cameras. `moved` by camera, from the stored pose to the new one.
    """

    job: str
    status: JobStatus
    finished_at: datetime
    verdict: Verdict | None
    accepted: bool | None
    rejected_because: str | None
    error: str | None
    stitch_error_px: float | None
    stitch_error_before_px: float | None
    stitch_error_limit_px: float | None
    moved: dict[str, Moved]
    dry_run: bool

    @property
    def moved_px(self) -> float | None:
        """Largest movement of a camera, px."""
        return max((moved.pixels for moved in self.moved.values() if moved.pixels is not None), default=None)


class PastCalibrationRepository(Repository):
    """The calibrations in the database that have ended, and which have not."""

    def of(self, venue: str, limit: int) -> list[PastCalibration]:
        """Return the last `limit` calibrations of a venue that have ended, newest first."""
        columns = (j.id, j.status, j.finished_at, j.result, j.error, j.options)
        query = _newest_calibrations(venue, *columns).where(j.finished_at.is_not(None)).limit(limit)
        with reading(self._engine) as connection:
            return read_each(connection.execute(query), _past)[0]

    def newest_result(self, venue: str) -> str | None:
        """Return the id of the newest calibration of a venue that has a result, accepted or not."""
        query = _newest_calibrations(venue, j.id).where(j.result.is_not(None)).limit(1)
        with reading(self._engine) as connection:
            job: str | None = connection.scalar(query)
            return job

    def last_taken(self, venue: str) -> str | None:
        """Return the last job whose poses a venue took, whose frames and pictures do not expire."""
        query = (
            sa.select(r.job).where(r.venue == venue, r.cause.in_(CALIBRATION_CAUSES)).order_by(r.number.desc()).limit(1)
        )
        with reading(self._engine) as connection:
            return connection.scalar(query)

    def active(self, venues: Collection[str]) -> dict[str, str]:
        """Return the queued or running calibrations, by venue."""
        query = sa.select(j.venue, j.id).where(
            j.status.in_(OPEN_STATUSES), j.kind == "calibration", j.venue.in_(venues)
        )
        with reading(self._engine) as connection:
            return {row.venue: row.id for row in connection.execute(query)}

    def decided(self, venues: Collection[str]) -> dict[str, tuple[Cause, datetime]]:
        """Return how and when the poses in use came, by venue, where somebody has accepted or undone a calibration."""
        others = sa.alias(tables.revisions)
        newest = sa.select(sa.func.max(others.c.number)).where(others.c.venue == r.venue).scalar_subquery()
        by_hand = r.cause.in_(("accepted", "restored"))
        query = sa.select(r.venue, r.cause, r.at).where(
            r.venue.in_(venues), r.number == newest, by_hand, r.job.is_not(None)
        )
        with reading(self._engine) as connection:
            return {row.venue: (row.cause, row.at) for row in connection.execute(query)}


def _newest_calibrations(venue: str, *columns: Any) -> sa.Select[Any]:
    calibrations = sa.select(*columns).where(j.venue == venue, j.kind == "calibration")
    return calibrations.with_hint(*tables.BY_VENUE).order_by(j.id.desc())


def _past(row: Any) -> PastCalibration:
    with reading_row("job", row.id):
        result = row.result or {}
        return PastCalibration(
            job=row.id,
            status=row.status,
            finished_at=row.finished_at,
            error=(row.error or {}).get("detail"),
            moved={camera["id"]: Moved.model_construct(**camera["moved"]) for camera in result.get("cameras", [])},
            dry_run=row.options["dry_run"],
            **{name: result.get(name) for name in OF_RESULTS},
        )
