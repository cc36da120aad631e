"""How the calibrations of each camera of a venue went, one after the other. All SQL about it."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from datetime import datetime

import sqlalchemy as sa

from service.store import tables
from service.store.counts.figures import note
from service.wire.base import Wire
from service.wire.results import Result, View

q = tables.venue_quality.c


class Course(Wire):
    """When a camera's pose was accepted last, how often it was not since then, and what its frames were like then.

    `accepted_at`: None if never. Calibrations that failed count, dry runs and cancelled ones do not. `view`: of frames
    that could be used.
    """

    accepted_at: datetime | None = None
    rejected_in_a_row: int = 0
    view: View | None = None

    def missed(self) -> Course:
        """After one more that brought no pose."""
        return self.model_copy(update={"rejected_in_a_row": self.rejected_in_a_row + 1})


def courses_of(connection: sa.Connection, venue_id: str) -> dict[str, Course]:
    """That of every camera that was ever calibrated, and maybe of some that the venue no longer has."""
    courses = connection.scalar(sa.select(q.cameras).where(q.venue == venue_id)) or {}
    return {camera: Course.model_validate(course) for camera, course in courses.items()}


def views_of(connection: sa.Connection, venue_id: str) -> dict[str, View]:
    """What the frames were like from which each camera's pose was accepted last."""
    courses = courses_of(connection, venue_id)
    return {camera: course.view for camera, course in courses.items() if course.view is not None}


def note_held(connection: sa.Connection, venue_id: str, result: Result, cameras: Collection[str], at: datetime) -> None:
    """The poses of some cameras of a result hold, inside the caller's serialised transaction."""
    usable = {camera.id: camera.view for camera in result.cameras if camera.view is not None and camera.view.usable}
    views = views_of(connection, venue_id) | usable
    _keep(connection, venue_id, {camera: Course(accepted_at=at, view=views.get(camera)) for camera in cameras})
    note(connection, venue_id, accepted_at=at, rejected_in_a_row=0)


def note_missed(connection: sa.Connection, venue_id: str, cameras: Collection[str]) -> None:
    """A calibration brought no pose for some cameras, inside the caller's serialised transaction."""
    known = courses_of(connection, venue_id)
    _keep(connection, venue_id, {camera: known.get(camera, Course()).missed() for camera in cameras})


def note_none_held(connection: sa.Connection, venue_id: str, cameras: Collection[str]) -> None:
    """A calibration brought no pose for any of its cameras, inside the caller's serialised transaction."""
    note_missed(connection, venue_id, cameras)
    one_more = {"rejected_in_a_row": q.rejected_in_a_row + 1}
    connection.execute(sa.update(tables.venue_quality).where(q.venue == venue_id).values(**one_more))


def _keep(connection: sa.Connection, venue_id: str, courses: Mapping[str, Course]) -> None:
    after = courses_of(connection, venue_id) | dict(courses)
    note(connection, venue_id, cameras={camera: course.model_dump(mode="json") for camera, course in after.items()})
