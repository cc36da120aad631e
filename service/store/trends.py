"""Movement of each camera of a venue since its anchor, job by job. All SQL about it.

A job's worker compares a camera with the anchor that it was given; what it says is kept where that anchor still is the
camera's. Undoing takes it back: who restores a revision forgets the anchors and the rows that came after it.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import datetime
from typing import Any

import sqlalchemy as sa

from service.control_charts import Baseline
from service.schemas.geometry import PosedCamera
from service.schemas.results import CameraResult
from service.schemas.trend import Anchor, Displacement, Trend, TrendState
from service.schemas.venue import Venue
from service.store import tables
from service.store.database import Repository, reading
from service.store.documents import to_document
from service.store.trend_charts import ALARM_M, CameraCharts, state_of
from service.store.unreadable import read_or, read_values

# The rows of each camera: three years of nights.
KEPT_ROWS = 1100
c = tables.camera_anchors.c
t = tables.camera_trend.c


@dataclass(frozen=True)
class CameraTrend:
    """Control charts of a camera after its last night; `moved_m` and `cusum` are None before the first."""

    venue: str
    camera: str
    beyond: bool
    moved_m: float | None
    cusum: float | None
    words: str

    def state(self, alarm_m: float) -> TrendState:
        """Return the state of the camera, where so many metres at the far touchline are an alarm."""
        return state_of(beyond=self.beyond, moved_m=self.moved_m or 0.0, alarm_m=alarm_m)


class TrendRepository(Repository):
    """The trends of the cameras in the database."""

    def of(self, venue: Venue, camera: str, since: datetime | None = None) -> Trend:
        """Return the trend of one camera since its anchor; `since`: points before it are left out, yet charted."""
        with reading(self._engine) as connection:
            anchor = _newest_anchors(connection, venue.id).get(camera)
            rows = _rows(connection, venue.id, [camera])[camera]
        return _trend(venue, camera, anchor, rows, since)


def alarm_m_of(venue: Venue) -> float:
    """Return the shift at the far touchline that is an alarm, m, by the rules of a venue or the default."""
    limit = venue.alarms.trend_m if venue.alarms else None
    return ALARM_M if limit is None else limit


def anchors_of(connection: sa.Connection, venue_id: str) -> dict[str, Anchor]:
    """Return the anchors of cameras, by camera, of those that have had a pose accepted since they were put."""
    newest = _newest_anchors(connection, venue_id)
    posed = {camera: row.posed for camera, row in newest.items() if row.posed is not None}
    return {
        camera: Anchor(revision=newest[camera].revision, posed=anchor)
        for camera, anchor in read_values(PosedCamera, posed, "trend", venue_id).items()
    }


def trends_of(connection: sa.Connection, venue_id: str) -> dict[str, CameraTrend]:
    """Return the newest trends of a venue, by camera, inside the caller's transaction."""
    return {camera: _trend_in(row) for camera, row in _newest_anchors(connection, venue_id).items()}


def most_moved(connection: sa.Connection, most: int) -> list[CameraTrend]:
    """Return the trends of the cameras that have moved farthest, inside the caller's transaction."""
    query = sa.select(tables.camera_anchors).where(c.moved_m.is_not(None)).order_by(c.moved_m.desc()).limit(most)
    return [_trend_in(row) for row in connection.execute(query)]


def _trend_in(row: Any) -> CameraTrend:
    return CameraTrend(row.venue, row.camera, row.beyond, row.moved_m, row.cusum, row.words)


def begin_anchors(connection: sa.Connection, venue: Venue, changed: Collection[str], revision: int) -> None:
    """Begin new anchors of changed cameras: the first pose that is accepted from now on becomes the anchor."""
    for table in (tables.camera_anchors, tables.camera_trend):
        gone = table.c.camera.not_in([camera.id for camera in venue.cameras])
        connection.execute(sa.delete(table).where(table.c.venue == venue.id, gone))
    for camera in changed:
        _add_anchor(connection, venue.id, camera, revision)


def forget_trends(connection: sa.Connection, venue_id: str) -> None:
    """Drop the trends of a venue: on another field, cameras stand elsewhere without having moved."""
    connection.execute(sa.delete(tables.camera_anchors).where(c.venue == venue_id))
    connection.execute(sa.delete(tables.camera_trend).where(t.venue == venue_id))


def go_back(connection: sa.Connection, venue: Venue, revision: int) -> None:
    """Rewind the trends of a venue to a revision; what came after it is deleted."""
    connection.execute(sa.delete(tables.camera_anchors).where(c.venue == venue.id, c.revision > revision))
    connection.execute(sa.delete(tables.camera_trend).where(t.venue == venue.id, t.revision > revision))
    cameras = [camera.id for camera in venue.cameras]
    _chart(connection, venue.id, cameras, _newest_anchors(connection, venue.id))


def note_night(
    connection: sa.Connection,
    venue: Venue,
    results: Sequence[CameraResult],
    job_id: str,
    revision: int,
    at: datetime,
    *,
    by_hand: bool,
) -> None:
    """Keep how far the cameras of an accepted result are from their anchors, inside the caller's transaction.

    `venue`: as it is with them; `revision`: what it became by them, `at` now. What a person accepted `by_hand` is right
    by that person's word: it is the new anchor. So is where a knocked camera was found.
    """
    posed = {camera.id: camera.posed for camera in venue.cameras}
    anchors = _newest_anchors(connection, venue.id)
    is_another = False
    rows: list[dict[str, Any]] = []
    for result in results:
        moved, anchor = result.displacement, anchors.get(result.id)
        anew = (by_hand or result.knocked) and anchor is not None and anchor.revision != revision
        if moved is None:
            if anew:
                _add_anchor(connection, venue.id, result.id, revision)
                is_another = True
            continue
        if anew:
            # A change of focal length since the anchor before says nothing about the lens in use now.
            moved = moved.model_copy(update={"focal_length": None, "sigma_focal_length": None})
        if anchor is None or anew:
            _add_anchor(connection, venue.id, result.id, revision)
            number, is_new = revision, True
        else:
            number, is_new = anchor.revision, anchor.posed is None
        if is_new:
            is_another = True
            moved = moved.as_anchor()
            _set_anchor(connection, venue.id, posed[result.id], number, at)
        elif moved.anchor != number:
            # It was compared with another one than the camera now has.
            continue
        rows.append(_row(result, moved, number))
    _add_rows(connection, rows, {"venue": venue.id, "revision": revision, "job": job_id, "at": at})
    anchors = _newest_anchors(connection, venue.id) if is_another else anchors
    _chart(connection, venue.id, [result.id for result in results], anchors)


def _add_anchor(connection: sa.Connection, venue_id: str, camera: str, revision: int) -> None:
    key = {"venue": venue_id, "camera": camera, "revision": revision}
    those_before = sa.update(tables.camera_anchors).where(c.venue == venue_id, c.camera == camera)
    connection.execute(those_before.values(moved_m=None))
    connection.execute(sa.insert(tables.camera_anchors).values(**key, **_empty_columns(camera)))


def _empty_columns(camera: str) -> dict[str, Any]:
    """Return the columns of an anchor without an accepted pose."""
    words = f"Camera {camera} has had no pose accepted since it was put."
    return dict.fromkeys(("at", "posed", "moved_m", "cusum")) | {"baselines": {}, "beyond": False, "words": words}


def _set_anchor(connection: sa.Connection, venue_id: str, camera: PosedCamera, revision: int, at: datetime) -> None:
    is_anchor = (c.venue == venue_id, c.camera == camera.id, c.revision == revision)
    anchor = sa.update(tables.camera_anchors).where(*is_anchor)
    connection.execute(anchor.values(at=at, posed=to_document(camera)))


def _row(result: CameraResult, moved: Displacement, anchor: int) -> dict[str, Any]:
    """Return the values of the row of a camera for one night."""
    sigma = result.sigma
    return {
        "camera": result.id,
        "anchor": anchor,
        "sigma_rotation_deg": sigma.rotation_deg if sigma else None,
        "sigma_position_m": sigma.position_m if sigma else None,
        **moved.model_dump(exclude={"anchor", "at"}),
    }


def _add_rows(connection: sa.Connection, rows: Sequence[dict[str, Any]], night: dict[str, Any]) -> None:
    if not rows:
        return
    # A person may accept by hand what a job has brought already.
    of_job = (t.venue == night["venue"], t.job == night["job"], t.camera.in_([row["camera"] for row in rows]))
    connection.execute(sa.delete(tables.camera_trend).where(*of_job))
    connection.execute(sa.insert(tables.camera_trend), [row | night for row in rows])


def _chart(
    connection: sa.Connection, venue_id: str, cameras: Collection[str], anchors: Mapping[str, sa.Row[Any]]
) -> None:
    """Write down what the charts of cameras say now, by their `anchors`, and forget the rows that are too many."""
    charted = sorted(anchors.keys() & cameras)
    if not charted:
        return
    rows = _rows(connection, venue_id, charted)
    with_nights: list[dict[str, Any]] = []
    without_nights: list[dict[str, Any]] = []
    for camera in charted:
        _trim(connection, rows[camera])
        anchor = anchors[camera]
        of_anchor = {"of_camera": camera, "of_revision": anchor.revision}
        since = [row for row in rows[camera] if row.anchor == anchor.revision]
        if since:
            with_nights.append(of_anchor | _chart_columns(camera, since, anchor))
        else:
            without_nights.append(of_anchor | _empty_columns(camera))
    is_anchor = (c.venue == venue_id, c.camera == sa.bindparam("of_camera"), c.revision == sa.bindparam("of_revision"))
    for values in filter(None, (with_nights, without_nights)):
        connection.execute(sa.update(tables.camera_anchors).where(*is_anchor), values)


def _chart_columns(camera: str, since: Sequence[Any], anchor: Any) -> dict[str, Any]:
    """Return the chart columns of an anchor, by the rows since it."""
    charts = CameraCharts.of(since, _baselines(anchor))
    last = len(charts.nights) - 1
    return {
        "baselines": {quantity: asdict(baseline) for quantity, baseline in charts.settled.items()},
        "beyond": bool(charts.beyond(last)),
        "moved_m": charts.moved_m(last),
        "cusum": charts.cusum(last),
        "words": charts.words(camera),
    }


def _trim(connection: sa.Connection, rows: Sequence[Any]) -> None:
    """Delete rows beyond `KEPT_ROWS`: earlier ones of a day with several jobs first, then the oldest days."""
    excess = len(rows) - KEPT_ROWS
    if excess <= 0:
        return
    last_of_days = {row.at.date(): row.id for row in rows}.values()
    by_worth = sorted(rows, key=lambda row: (row.id in last_of_days, row.id))
    connection.execute(sa.delete(tables.camera_trend).where(t.id.in_([row.id for row in by_worth[:excess]])))


def _trend(venue: Venue, camera: str, anchor: Any, rows: Sequence[Any], since: datetime | None) -> Trend:
    counted = [row for row in rows if anchor is not None and row.anchor == anchor.revision]
    alarm_m = alarm_m_of(venue)
    if counted:
        charts = CameraCharts.of(counted, _baselines(anchor))
        return charts.trend(venue.id, camera, anchor.revision, alarm_m, since)
    return Trend(
        venue=venue.id,
        camera=camera,
        anchor=None,
        since=None,
        state="too-few-nights",
        words=_empty_columns(camera)["words"],
        alarm_m=alarm_m,
        moved_m=0.0,
        baseline_nights=0,
        points=[],
    )


def _baselines(anchor: Any) -> Mapping[str, Baseline]:
    return read_or({}, "trend", anchor.venue, lambda: {key: Baseline(**one) for key, one in anchor.baselines.items()})


def _rows(connection: sa.Connection, venue_id: str, cameras: Collection[str]) -> dict[str, list[Any]]:
    """Return all rows of cameras, oldest first, by camera."""
    of_cameras = (t.venue == venue_id, t.camera.in_(cameras))
    rows: dict[str, list[Any]] = {camera: [] for camera in cameras}
    for row in connection.execute(sa.select(tables.camera_trend).where(*of_cameras).order_by(t.id)):
        rows[row.camera].append(row)
    return rows


def _newest_anchors(connection: sa.Connection, venue_id: str) -> dict[str, Any]:
    query = sa.select(tables.camera_anchors).where(c.venue == venue_id).order_by(c.revision)
    return {row.camera: row for row in connection.execute(query)}
