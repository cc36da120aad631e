"""Quality of a venue from its results: read once in a transaction, folded here, and written once.

Whatever happens to a venue goes through it: a job that ended, poses that hold, a revision that was put back, alarms.
The caller's transaction is serialised about the venue.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import Any

import sqlalchemy as sa

from service.schemas.health import CalibrationEnd
from service.schemas.names import JobStatus
from service.schemas.results import AnyResult, Result
from service.store import tables
from service.store.database import clock
from service.store.documents import to_document
from service.store.statistics.camera_history import CameraHistory
from service.store.statistics.venue_summary import IN_CURVE, CalibrationSummary, summary_in
from service.store.unreadable import read_values

q = tables.venue_quality.c
v = tables.venues.c


@dataclass
class QualityRow:
    """The row of a venue in `venue_quality`; its columns are explained in `service.store.tables`."""

    stitch_error_px: float | None = None
    moved_px: float | None = None
    accepted_at: datetime | None = None
    drift_px: float | None = None
    rejected_in_a_row: int = 0
    courses: dict[str, CameraHistory] = field(default_factory=dict)
    glance: CalibrationSummary | None = None
    alarm_due_at: datetime | None = None

    def columns(self) -> dict[str, Any]:
        """Return the columns of the row."""
        return {
            "stitch_error_px": self.stitch_error_px,
            "moved_px": self.moved_px,
            "accepted_at": self.accepted_at,
            "drift_px": self.drift_px,
            "rejected_in_a_row": self.rejected_in_a_row,
            "cameras": {camera: to_document(course) for camera, course in self.courses.items()} or None,
            "glance": None if self.glance is None else to_document(self.glance),
            "alarm_due_at": self.alarm_due_at,
        }


class VenueQuality:
    """The quality of a venue at one moment, `now`; `row` is changed by whatever happens to the venue.

    `newest_revision`: the row of its newest revision, once that was read or written; None before. `knocked`: by camera
    why the calibration that has just ended proposes its pose; None: none has just ended.
    """

    def __init__(self, venue_id: str, row: QualityRow, now: datetime) -> None:
        self.venue_id = venue_id
        self.row = row
        self.now = now
        self.newest_revision: Any = None
        self.knocked: dict[str, str] | None = None

    def calibrated(self, result: Result, *, moved: bool) -> None:
        """Fold in the result of a calibration; `moved`: some of its poses are in use from now on."""
        shifts = [camera.moved.pixels for camera in result.cameras if camera.moved.pixels is not None]
        self.row.stitch_error_px = result.stitch_error_px if moved else result.stitch_error_before_px
        self.row.moved_px = max(shifts, default=None)
        self.knocked = {
            camera.id: camera.rejected_because or "" for camera in result.cameras if camera.proposed is not None
        }

    def missed(self, cameras: Collection[str]) -> None:
        """Fold in that a calibration brought no pose for some cameras."""
        courses = self.row.courses
        courses.update({camera: courses.get(camera, CameraHistory()).missed() for camera in cameras})

    def brought_none(self, cameras: Collection[str]) -> None:
        """Fold in that a calibration brought no pose for any camera."""
        self.missed(cameras)
        self.row.rejected_in_a_row += 1

    def hold(self, result: Result, cameras: Collection[str]) -> None:
        """Fold in that the poses of some cameras of a result are in use from now on."""
        usable = {camera.id: camera.view for camera in result.cameras if camera.view is not None and camera.view.usable}
        courses = self.row.courses
        for camera in cameras:
            view = usable.get(camera) or courses.get(camera, CameraHistory()).view
            courses[camera] = CameraHistory(accepted_at=self.now, view=view)
        self.row.accepted_at, self.row.rejected_in_a_row = self.now, 0
        self.knocked = {camera: why for camera, why in (self.knocked or {}).items() if camera not in cameras}

    def ended(self, status: JobStatus, result: AnyResult | None, *, dry_run: bool) -> None:
        """Fold the end of a calibration, whatever it is, into the summary."""
        before = self.row.glance or CalibrationSummary(
            last=CalibrationEnd(status=status, finished_at=self.now, dry_run=dry_run)
        )
        last = CalibrationEnd(status=status, finished_at=self.now, dry_run=dry_run)
        errors, limit_px = before.errors, before.limit_px
        if isinstance(result, Result):
            moved = [camera.moved.pixels for camera in result.cameras if camera.moved.pixels is not None]
            found = {"verdict": result.verdict, "stitch_error_px": result.stitch_error_px}
            last = last.model_copy(update={**found, "moved_px": max(moved, default=None)})
            errors, limit_px = [*errors, result.stitch_error_px][-IN_CURVE:], result.stitch_error_limit_px
        self.row.glance = CalibrationSummary(last=last, errors=errors, limit_px=limit_px)


@contextmanager
def update_quality(connection: sa.Connection, venue_id: str) -> Iterator[VenueQuality]:
    """Read what is known of a venue, and write down what has been changed of it when the block is left."""
    row = connection.execute(sa.select(tables.venue_quality).where(q.venue == venue_id)).one_or_none()
    quality = VenueQuality(venue_id, QualityRow() if row is None else _known(row), clock(connection))
    before = replace(quality.row, courses=dict(quality.row.courses))
    yield quality
    if quality.row == before:
        return
    values = quality.row.columns()
    if row is not None:
        connection.execute(sa.update(tables.venue_quality).where(q.venue == venue_id).values(**values))
    elif connection.scalar(sa.select(v.id).where(v.id == venue_id)) is not None:
        # Of a venue that was deleted meanwhile nothing is to be known.
        connection.execute(sa.insert(tables.venue_quality).values(venue=venue_id, **values))


def _known(row: Any) -> QualityRow:
    return QualityRow(
        stitch_error_px=row.stitch_error_px,
        moved_px=row.moved_px,
        accepted_at=row.accepted_at,
        drift_px=row.drift_px,
        rejected_in_a_row=row.rejected_in_a_row,
        courses=read_values(CameraHistory, row.cameras, "statistics", row.venue),
        glance=summary_in(row),
        alarm_due_at=row.alarm_due_at,
    )
