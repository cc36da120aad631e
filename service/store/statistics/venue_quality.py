"""Quality of a venue from its results: the row of each venue in `venue_quality`."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from functools import partial
from typing import Any

import sqlalchemy as sa
from pydantic import Field

from service.schemas.base import TOLERANTLY, Schema
from service.schemas.health import CalibrationEnd
from service.schemas.results import View
from service.store import tables
from service.store.documents import to_document
from service.store.unreadable import read_or, read_values

# The stitch errors of a venue that its summary keeps.
IN_CURVE = 40
q = tables.venue_quality.c
PLAIN_COLUMNS = ("stitch_error_px", "moved_px", "accepted_at", "drift_px", "rejected_in_a_row", "alarm_due_at")


class CameraHistory(Schema):
    """Calibration history of a camera: its last accepted pose, the rejections since then, and the view at that time.

    `accepted_at`: None if never. Calibrations that failed count, dry runs and cancelled ones do not. `view`: of frames
    that could be used.
    """

    accepted_at: datetime | None = None
    rejected_in_a_row: int = 0
    view: View | None = None


class CalibrationSummary(Schema):
    """The end of a venue's last calibration, and recent stitch errors, oldest first, with the gate's limit.

    It is put together when a calibration ends: a list of fifty venues would else read two thousand results.
    """

    last: CalibrationEnd
    errors: list[float | None] = Field([])
    limit_px: float | None = None


@dataclass(frozen=True)
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
    cameras: Mapping[str, CameraHistory] = field(default_factory=dict)
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


def read_quality(connection: sa.Connection, venue_id: str) -> QualityRow | None:
    """Return the quality of a venue, None if nothing is known of it."""
    row = connection.execute(sa.select(tables.venue_quality).where(q.venue == venue_id)).one_or_none()
    if row is None:
        return None
    cameras = read_values(CameraHistory, row.cameras, "statistics", row.venue)
    return QualityRow(**{name: getattr(row, name) for name in PLAIN_COLUMNS}, cameras=cameras, glance=summary_in(row))


def summary_in(row: Any) -> CalibrationSummary | None:
    """Return the summary in a row of `venue_quality`; None: there is none, or it cannot be read and begins anew."""
    if row.glance is None:
        return None
    read = partial(CalibrationSummary.model_validate, row.glance, **TOLERANTLY)
    return read_or(None, "statistics", row.venue, read)


def last_accepted_views(connection: sa.Connection, venue_id: str) -> dict[str, View]:
    """Return the view conditions of the frames from which each camera's pose was accepted last, by camera."""
    row = read_quality(connection, venue_id) or QualityRow()
    return {camera: history.view for camera, history in row.cameras.items() if history.view is not None}
