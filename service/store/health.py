"""Health of venues: their poses in use, the outcome of their calibrations, and their active alarms."""

from __future__ import annotations

import sqlalchemy as sa

from service.schemas.health import CameraHealth, VenueHealth
from service.schemas.history import RevisionCamera
from service.store.revisions import newest_revision
from service.store.schedules import schedule_of
from service.store.statistics.venue_quality import CameraHistory, QualityRow, read_quality
from service.store.venue_state import active_alarms


def health_of(connection: sa.Connection, venue_id: str) -> VenueHealth | None:
    """Return the health of a venue, None if there is no such venue."""
    newest = newest_revision(connection, venue_id)
    if newest is None:
        return None
    quality = read_quality(connection, venue_id) or QualityRow()
    alarms = active_alarms(connection, [venue_id]).get(venue_id, [])
    return VenueHealth(
        state="alarm" if alarms else "ok",
        alarms=alarms,
        revision=newest.revision,
        cameras=[_camera_health(camera, quality.history(camera.id)) for camera in newest.cameras],
        stitch_error_px=quality.stitch_error_px,
        accepted_at=quality.accepted_at,
        rejected_in_a_row=quality.rejected_in_a_row,
        schedule=schedule_of(connection, venue_id),
    )


def _camera_health(camera: RevisionCamera, history: CameraHistory) -> CameraHealth:
    return CameraHealth(**dict(camera), accepted_at=history.accepted_at, rejected_in_a_row=history.rejected_in_a_row)
