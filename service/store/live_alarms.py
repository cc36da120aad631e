"""Alarms of live poses: what of them is not as it should be, since when, and when a rule is broken by it.

The process that sends the poses only reports; what rings is decided by the service, which also notices its silence. All
SQL about when that is next to be looked at.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

import sqlalchemy as sa

from service.schemas.base import Schema
from service.schemas.health import AlarmRule
from service.schemas.live import LiveCameraIn, LiveReport
from service.store import tables
from service.store.documents import to_document
from service.store.unreadable import read_or, read_values

NOT_MEASURED_FOR, LATE_FOR, SILENT_FOR = timedelta(seconds=10), timedelta(minutes=1), timedelta(seconds=30)
LATE_MS = 1000.0
SECOND = "%Y-%m-%d %H:%M:%S"
# Rule and camera, which is empty where the alarm is of the whole venue.
AlarmKey = tuple[AlarmRule, str]
r = tables.live_reports.c


class WatchedCamera(Schema):
    """Since when a tracked camera is not measured, and since when its poses are late; None: it is as it should be."""

    not_measured_since: datetime | None = None
    late_since: datetime | None = None

    def after(self, camera: LiveCameraIn, now: datetime) -> WatchedCamera:
        """Return what is watched of the camera after a report."""
        # A camera that is measured in every tenth picture is measured, whatever the last picture was.
        is_measured = camera.status == "measured" or camera.measured > 0
        is_late = camera.latency_ms is not None and camera.latency_ms.p99 > LATE_MS
        return WatchedCamera(
            not_measured_since=None if is_measured else self.not_measured_since or now,
            late_since=(self.late_since or now) if is_late else None,
        )


@dataclass(frozen=True)
class LiveWatch:
    """What the alarms of a venue's live poses go by: the last report, and what was wrong with each tracked camera."""

    host: str
    reported_at: datetime
    stopped: bool
    cameras: dict[str, WatchedCamera]

    def broken(self, now: datetime) -> dict[AlarmKey, str]:
        """The rules that are broken at a time, with their reasons."""
        return {key: why for key, (at, why) in self._deadlines().items() if at <= now}

    def next_deadline(self, now: datetime) -> datetime | None:
        """When the next rule is broken, unless a better report comes before."""
        return min((at for at, _ in self._deadlines().values() if at > now), default=None)

    def _deadlines(self) -> dict[AlarmKey, tuple[datetime, str]]:
        if self.stopped:
            return {}
        silent = (
            f"The process on {self.host} that sends live poses has not reported since {self.reported_at:{SECOND}} UTC."
        )
        found: dict[AlarmKey, tuple[datetime, str]] = {("live-silent", ""): (self.reported_at + SILENT_FOR, silent)}
        for camera, watched in self.cameras.items():
            if (since := watched.not_measured_since) is not None:
                why = f"Camera {camera} was not measured in its stream since {since:{SECOND}} UTC."
                found["live-not-measured", camera] = since + NOT_MEASURED_FOR, why
            if (since := watched.late_since) is not None:
                why = f"Poses of camera {camera} are sent over 1 s after their pictures since {since:{SECOND}} UTC."
                found["live-late", camera] = since + LATE_FOR, why
        return found


def watch_of(connection: sa.Connection, venue_id: str) -> LiveWatch | None:
    """Return what is watched of a venue, None if it never had live poses."""
    row = connection.execute(sa.select(tables.live_reports).where(r.venue == venue_id)).one_or_none()
    return None if row is None else watch_in(row)


def watch_in(row: Any) -> LiveWatch:
    """Return what is watched of a venue by its row of `live_reports`."""
    cameras = read_values(WatchedCamera, row.watched, "live", row.venue)
    host, stopped = read_or(("", True), "live", row.venue, lambda: _sender(row.document))
    return LiveWatch(host, row.reported_at, stopped, cameras)


def _sender(document: Any) -> tuple[str, bool]:
    """Return the host of the process that sends live poses, and whether it has stopped."""
    return document["host"], document.get("stopped", False)


def watch_after(before: LiveWatch | None, report: LiveReport, now: datetime) -> LiveWatch:
    """Return what is watched of a venue after a report that arrives `now`."""
    known = {} if before is None else before.cameras
    tracked = [camera for camera in report.cameras if camera.stream is not None]
    cameras = {camera.id: known.get(camera.id, WatchedCamera()).after(camera, now) for camera in tracked}
    return LiveWatch(report.host, now, report.stopped, cameras)


def watched_column(watch: LiveWatch) -> dict[str, Any]:
    """Return the column `watched` of a row of `live_reports`."""
    return {camera: to_document(one) for camera, one in watch.cameras.items()}


def due_after(before: LiveWatch | None, due_at: datetime | None, after: LiveWatch, now: datetime) -> datetime | None:
    """When the alarms are to be looked at, after a report; `due_at`: when they were to be before it."""
    if due_at is not None and due_at <= now:
        return due_at
    is_news = before is not None and before.broken(now).keys() != after.broken(now).keys()
    return now if is_news else after.next_deadline(now)


def due(connection: sa.Connection, now: datetime, limit: int) -> Sequence[str]:
    """Up to `limit` venues whose alarms of live poses are to be looked at."""
    query = sa.select(r.venue).where(r.alarm_due_at <= now).order_by(r.alarm_due_at).limit(limit)
    return connection.scalars(query).all()


def plan_next(connection: sa.Connection, venue_id: str, now: datetime) -> None:
    """Have the alarms of a venue looked at again when the next rule may be broken: those of `now` are settled."""
    watch = watch_of(connection, venue_id)
    if watch is not None:
        next_at = watch.next_deadline(now)
        connection.execute(sa.update(tables.live_reports).where(r.venue == venue_id).values(alarm_due_at=next_at))
