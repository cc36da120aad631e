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

from service.schemas.base import Schema
from service.schemas.health import CalibrationEnd
from service.schemas.names import JobStatus
from service.schemas.results import AnyResult, Result, View
from service.store import tables
from service.store.database import clock
from service.store.documents import to_document
from service.store.statistics.venue_summary import IN_CURVE, CalibrationSummary, summary_in
from service.store.unreadable import read_values

q = tables.venue_quality.c
v = tables.venues.c
PLAIN_COLUMNS = ("stitch_error_px", "moved_px", "accepted_at", "drift_px", "rejected_in_a_row", "alarm_due_at")


class CameraHistory(Schema):
    """Calibration history of a camera: its last accepted pose, the rejections since then, and the view at that time.

    `accepted_at`: None if never. Calibrations that failed count, dry runs and cancelled ones do not. `view`: of frames
    that could be used.
    """

    accepted_at: datetime | None = None
    rejected_in_a_row: int = 0
    view: View | None = None

    def missed(self) -> CameraHistory:
        """Return the history after one more calibration that brought no pose."""
        return self.model_copy(update={"rejected_in_a_row": self.rejected_in_a_row + 1})


@dataclass
class QualityRow:
    """The row of a venue in `venue_quality`; its columns are explained in `service.store.tables`.

    `cameras` may have some that the venue no longer has.
    """

    stitch_error_px: float | None = None
    moved_px: float | None = None
    accepted_at: datetime | None = None
    drift_px: float | None = None
    rejected_in_a_row: int = 0
    alarm_due_at: datetime | None = None
    cameras: dict[str, CameraHistory] = field(default_factory=dict)
    glance: CalibrationSummary | None = None

    def history(self, camera: str) -> CameraHistory:
        """Return the history of a camera, an empty one if it was never calibrated."""
        return self.cameras.get(camera, CameraHistory())

    def columns(self) -> dict[str, Any]:
        """Return the columns of the row."""
        return {name: getattr(self, name) for name in PLAIN_COLUMNS} | {
            "cameras": {camera: to_document(history) for camera, history in self.cameras.items()} or None,
            "glance": None if self.glance is None else to_document(self.glance),
        }


class VenueQuality:
    """The quality of a venue at one moment, `now`; `row` is changed by whatever happens to the venue.

    `newest_revision`: the row of its newest revision, once that was read or written; None before. `knocked`: by camera
    why the calibration that has just ended proposes its pose; None: none has just ended.
    """

    def __init__(self, venue_id: str | None, row: QualityRow, now: datetime) -> None:
        self.venue_id = venue_id
        self.row = row
        self.now = now
        self.newest_revision: Any = None
        self.knocked: dict[str, str] | None = None

    def calibrated(self, result: Result, *, moved: bool) -> None:
        """Fold in the result of a calibration; `moved`: some of its poses are in use from now on."""
        self.row.stitch_error_px = result.stitch_error_px if moved else result.stitch_error_before_px
        self.row.moved_px = _largest_movement_px(result)
        self.knocked = {
            camera.id: camera.rejected_because or "" for camera in result.cameras if camera.proposed is not None
        }

    def missed(self, cameras: Collection[str]) -> None:
        """Fold in that a calibration brought no pose for some cameras."""
        self.row.cameras.update({camera: self.row.history(camera).missed() for camera in cameras})

    def brought_none(self, cameras: Collection[str]) -> None:
        """Fold in that a calibration brought no pose for any camera."""
        self.missed(cameras)
        self.row.rejected_in_a_row += 1

    def hold(self, result: Result, cameras: Collection[str]) -> None:
        """Fold in that the poses of some cameras of a result are in use from now on."""
        usable = {camera.id: camera.view for camera in result.cameras if camera.view is not None and camera.view.usable}
        for camera in cameras:
            view = usable.get(camera) or self.row.history(camera).view
            self.row.cameras[camera] = CameraHistory(accepted_at=self.now, view=view)
        self.row.accepted_at, self.row.rejected_in_a_row = self.now, 0
        self.knocked = {camera: why for camera, why in (self.knocked or {}).items() if camera not in cameras}

    def ended(self, status: JobStatus, result: AnyResult | None, *, dry_run: bool) -> None:
        """Fold the end of a calibration, whatever it is, into the summary."""
        last = CalibrationEnd(status=status, finished_at=self.now, dry_run=dry_run)
        before = self.row.glance or CalibrationSummary(last=last)
        errors, limit_px = before.errors, before.limit_px
        if isinstance(result, Result):
            found = {"verdict": result.verdict, "stitch_error_px": result.stitch_error_px}
            last = last.model_copy(update={**found, "moved_px": _largest_movement_px(result)})
            errors, limit_px = [*errors, result.stitch_error_px][-IN_CURVE:], result.stitch_error_limit_px
        self.row.glance = CalibrationSummary(last=last, errors=errors, limit_px=limit_px)


def _largest_movement_px(result: Result) -> float | None:
    return max((camera.moved.pixels for camera in result.cameras if camera.moved.pixels is not None), default=None)


def read_quality(connection: sa.Connection, venue_id: str | None) -> QualityRow | None:
    """Return the quality of a venue, None if nothing is known of it."""
    row = connection.execute(sa.select(tables.venue_quality).where(q.venue == venue_id)).one_or_none()
    if row is None:
        return None
    cameras = read_values(CameraHistory, row.cameras, "statistics", row.venue)
    return QualityRow(**{name: getattr(row, name) for name in PLAIN_COLUMNS}, cameras=cameras, glance=summary_in(row))


def last_accepted_views(connection: sa.Connection, venue_id: str) -> dict[str, View]:
    """Return the view conditions of the frames from which each camera's pose was accepted last, by camera."""
    row = read_quality(connection, venue_id) or QualityRow()
    return {camera: history.view for camera, history in row.cameras.items() if history.view is not None}


@contextmanager
def update_quality(connection: sa.Connection, venue_id: str | None) -> Iterator[VenueQuality]:
    """Load the quality of a venue, and store it when the block is left; of a job without a venue nothing is stored."""
    stored = read_quality(connection, venue_id)
    quality = VenueQuality(venue_id, stored or QualityRow(), clock(connection))
    before = replace(quality.row, cameras=dict(quality.row.cameras))
    yield quality
    if quality.row == before:
        return
    values = quality.row.columns()
    if stored is not None:
        connection.execute(sa.update(tables.venue_quality).where(q.venue == venue_id).values(**values))
    elif connection.scalar(sa.select(v.id).where(v.id == venue_id)) is not None:
        # Nothing is stored of a venue that was deleted meanwhile.
        connection.execute(sa.insert(tables.venue_quality).values(venue=venue_id, **values))
