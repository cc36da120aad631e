"""Trends of cameras: the movement of each since its anchor, job by job, as clients, workers and /metrics read it."""

from collections.abc import Sequence
from datetime import datetime
from typing import Any

import sqlalchemy as sa

from service.schemas.geometry import PosedCamera
from service.schemas.trend import Anchor, Trend
from service.schemas.venue import Venue
from service.store import tables
from service.store.database import Repository, reading
from service.store.trend_charts import ALARM_M, CameraCharts, baselines_of, no_chart_columns
from service.store.unreadable import read_values
from service.store.venue_state import AnchorRow, newest_anchors, read_anchors, read_nights

c = tables.camera_anchors.c


class TrendRepository(Repository):
    """The trends of the cameras in the database."""

    def of(self, venue: Venue, camera: str, since: datetime | None = None) -> Trend:
        """Return the trend of one camera since its anchor; `since`: points before it are left out, yet charted."""
        with reading(self._engine) as connection:
            anchor = newest_anchors(read_anchors(connection, venue.id)).get(camera)
            rows = read_nights(connection, venue.id, [camera])[camera]
        return _trend(venue, camera, anchor, rows, since)


def alarm_m_of(venue: Venue) -> float:
    """Return the shift at the far touchline that is an alarm, m, by the rules of a venue or the default."""
    limit = venue.alarms.trend_m if venue.alarms else None
    return ALARM_M if limit is None else limit


def anchors_of(connection: sa.Connection, venue_id: str) -> dict[str, Anchor]:
    """Return the anchors of cameras, by camera, of those that have had a pose accepted since they were put."""
    newest = newest_anchors(read_anchors(connection, venue_id))
    posed = {camera: row.posed for camera, row in newest.items() if row.posed is not None}
    return {
        camera: Anchor(revision=newest[camera].revision, posed=anchor)
        for camera, anchor in read_values(PosedCamera, posed, "trend", venue_id).items()
    }


def most_moved(connection: sa.Connection, most: int) -> list[AnchorRow]:
    """Return the anchors from which cameras have moved farthest, inside the caller's transaction."""
    query = sa.select(tables.camera_anchors).where(c.moved_m.is_not(None)).order_by(c.moved_m.desc()).limit(most)
    return [AnchorRow(**row) for row in connection.execute(query).mappings()]


def _trend(venue: Venue, camera: str, anchor: AnchorRow | None, rows: Sequence[Any], since: datetime | None) -> Trend:
    counted = [row for row in rows if anchor is not None and row.anchor == anchor.revision]
    alarm_m = alarm_m_of(venue)
    if anchor is not None and counted:
        charts = CameraCharts.of(counted, baselines_of(anchor))
        return charts.trend(venue.id, camera, anchor.revision, alarm_m, since)
    return Trend(
        venue=venue.id,
        camera=camera,
        anchor=None,
        since=None,
        state="too-few-nights",
        words=no_chart_columns(camera)["words"],
        alarm_m=alarm_m,
        moved_m=0.0,
        baseline_nights=0,
        points=[],
    )
