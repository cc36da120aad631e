"""Calibration history of each camera of a venue. All SQL about it."""

from __future__ import annotations

from datetime import datetime

import sqlalchemy as sa

from service.schemas.base import Schema
from service.schemas.results import View
from service.store import tables
from service.store.unreadable import read_values

q = tables.venue_quality.c


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


def camera_histories(connection: sa.Connection, venue_id: str) -> dict[str, CameraHistory]:
    """Return the history of every camera that was ever calibrated, and maybe of some that the venue no longer has."""
    courses = connection.scalar(sa.select(q.cameras).where(q.venue == venue_id)) or {}
    return read_values(CameraHistory, courses, "statistics", venue_id)


def last_accepted_views(connection: sa.Connection, venue_id: str) -> dict[str, View]:
    """Return the view conditions of the frames from which each camera's pose was accepted last, by camera."""
    courses = camera_histories(connection, venue_id)
    return {camera: course.view for camera, course in courses.items() if course.view is not None}
