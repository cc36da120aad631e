"""Live poses: the newest report of each venue's process, and its reports by the minute. All SQL about them.

They are copied and backed up with all other tables: by the minutes it is seen what happened before, and the newest
report says since when the process is missed.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from functools import partial
from typing import Any

import sqlalchemy as sa

from service.schemas.base import TOLERANTLY
from service.schemas.live import LiveCamera, LiveMinute, LiveMinuteCamera, LiveReport, LiveSender, LiveState
from service.schemas.problems import Problem
from service.schemas.venue import Venue
from service.store import live_alarms, tables
from service.store.database import Repository, clock, lock_venue, reading, writing
from service.store.documents import to_document
from service.store.statistics.counters import INSERT
from service.store.unreadable import read_or, read_values
from service.store.venues import existing_venue

RUNNING_WITHIN, LATELY = timedelta(seconds=5), timedelta(days=1)
# The share of measured pictures in /metrics is over the current minute and the one before it.
SHARE_OVER = timedelta(minutes=2)
r = tables.live_reports.c
m = tables.live_minutes.c


@dataclass(frozen=True)
class LiveGauges:
    """Figures of the live poses of a venue for /metrics; None where no camera is tracked or had a picture lately."""

    venue: str
    running: bool
    measured_share: float | None
    latency_p99_s: float | None


class LiveRepository(Repository):
    """The reports in the database."""

    def report(self, venue_id: str, report: LiveReport) -> None:
        """Keep a report as the newest and add it to its minute.

        Raises the problems `venue-not-found`, and `unknown-camera` for a camera that the venue does not have.
        """
        with writing(self._engine) as connection:
            lock_venue(connection, venue_id)
            _require_known_cameras(existing_venue(connection, venue_id), report)
            now = clock(connection)
            _keep_newest(connection, venue_id, report, now)
            _add_to_minute(connection, venue_id, report, now)

    def state(self, venue_id: str) -> LiveState:
        """Return the newest report of a venue, or an empty state."""
        return self.newest([venue_id]).get(venue_id, LiveState())

    def newest(self, venue_ids: Collection[str]) -> Mapping[str, LiveState]:
        """Return the newest report of each of these venues that exists."""
        v = tables.venues.c
        query = (
            sa.select(v.id.label("venue"), r.reported_at, r.document, r.watched)
            .select_from(tables.venues.outerjoin(tables.live_reports, r.venue == v.id))
            .where(v.id.in_(venue_ids))
        )
        with reading(self._engine) as connection:
            now = clock(connection)
            return {row.venue: _state(row, now) for row in connection.execute(query)}

    def reported_lately(self, venue_id: str) -> LiveState | None:
        """Return the newest report of a venue, or None if it is older than a day."""
        state = self.state(venue_id)
        return state if state.reported_at is not None and self.now() - state.reported_at <= LATELY else None

    def history(self, venue_id: str, minutes: int) -> list[LiveMinute]:
        """Return the reports of the last so many minutes by the minute, oldest first."""
        with reading(self._engine) as connection:
            since = clock(connection) - timedelta(minutes=minutes)
            query = sa.select(tables.live_minutes).where(m.venue == venue_id, m.minute >= since).order_by(m.minute)
            return [_minute(row) for row in connection.execute(query)]


def _require_known_cameras(venue: Venue, report: LiveReport) -> None:
    ids = [camera.id for camera in venue.cameras]
    for camera in report.cameras:
        if camera.id not in ids:
            raise Problem("unknown-camera", f"Report {', '.join(ids)}.", camera=camera.id, expected=ids)


def live_gauges(connection: sa.Connection, most: int, now: datetime) -> list[LiveGauges]:
    """Return the figures of up to `most` venues that have reported within a day, those that reported last."""
    query = sa.select(tables.live_reports).where(r.reported_at >= now - LATELY)
    rows = connection.execute(query.order_by(r.reported_at.desc()).limit(most)).all()
    lately = sa.select(tables.live_minutes).where(
        m.venue.in_([row.venue for row in rows]), m.minute >= now - SHARE_OVER
    )
    minutes: dict[str, list[LiveMinute]] = {}
    for row in connection.execute(lately):
        minutes.setdefault(row.venue, []).append(_minute(row))
    return [_gauges(row, minutes.get(row.venue, []), now) for row in rows]


def _keep_newest(connection: sa.Connection, venue_id: str, report: LiveReport, now: datetime) -> None:
    row = connection.execute(sa.select(tables.live_reports).where(r.venue == venue_id)).one_or_none()
    before = None if row is None else live_alarms.watch_in(row)
    watch = live_alarms.watch_after(before, report, now)
    cameras = [LiveCamera.from_input(camera) for camera in report.cameras]
    newest, *others = watch.senders
    values = {
        "reported_at": now,
        "document": {
            **to_document(report),
            "cameras": [to_document(camera) for camera in cameras],
            "first_at": to_document(newest)["first_at"],
            live_alarms.OTHERS: [to_document(one) for one in others],
        },
        "watched": {camera: to_document(one) for camera, one in newest.cameras.items()},
        "alarm_due_at": live_alarms.due_after(before, None if row is None else row.alarm_due_at, watch, now),
    }
    if row is None:
        connection.execute(sa.insert(tables.live_reports).values(venue=venue_id, **values))
    else:
        connection.execute(sa.update(tables.live_reports).where(r.venue == venue_id).values(**values))


def _add_to_minute(connection: sa.Connection, venue_id: str, report: LiveReport, now: datetime) -> None:
    minute = now.replace(second=0, microsecond=0)
    stored = connection.scalar(sa.select(m.cameras).where(m.venue == venue_id, m.minute == minute))
    cameras = dict(stored) if isinstance(stored, dict) else {}
    known = read_values(LiveMinuteCamera, cameras, "live", venue_id)
    for camera in report.cameras:
        before = known.get(camera.id, LiveMinuteCamera())
        cameras[camera.id] = to_document(before.with_report(camera))
    insert = INSERT[connection.dialect.name](tables.live_minutes)
    values = insert.values(venue=venue_id, minute=minute, cameras=cameras)
    connection.execute(values.on_conflict_do_update(index_elements=["venue", "minute"], set_={"cameras": cameras}))


def _state(row: Any, now: datetime) -> LiveState:
    if row.reported_at is None:
        return LiveState()
    # The next report replaces one that cannot be read.
    return read_or(LiveState(), "live", row.venue, partial(_reported, row, now))


def _reported(row: Any, now: datetime) -> LiveState:
    watch = live_alarms.watch_in(row)
    newest, *_ = watch.senders
    others = [
        LiveSender.model_validate(one.model_dump() | {"running": _is_running(one, now)}, **TOLERANTLY)
        for one in watch.missed()
        if one is not newest
    ]
    values = row.document | {"reported_at": row.reported_at, "running": _is_running(newest, now), "others": others}
    return LiveState.model_validate(values, **TOLERANTLY)


def _is_running(sender: live_alarms.WatchedSender, now: datetime) -> bool:
    return now - sender.reported_at <= RUNNING_WITHIN and not sender.stopped


def _minute(row: Any) -> LiveMinute:
    return LiveMinute(at=row.minute, cameras=read_values(LiveMinuteCamera, row.cameras, "live", row.venue))


def _gauges(row: Any, minutes: list[LiveMinute], now: datetime) -> LiveGauges:
    state = _state(row, now)
    tracked = [camera for minute in minutes for camera in minute.cameras.values()]
    pictures = sum(camera.pictures for camera in tracked)
    latencies = [camera.latency_ms.p99 for camera in state.cameras if camera.latency_ms is not None]
    return LiveGauges(
        venue=row.venue,
        running=state.running,
        measured_share=sum(camera.measured for camera in tracked) / pictures if pictures else None,
        latency_p99_s=max(latencies) / 1000 if latencies and state.running else None,
    )
