"""Alarms of live poses: what of them is not as it should be, since when, and when a rule is broken by it.

The process that sends the poses only reports; what rings is decided by the service, which also notices its silence. All
SQL about when that is next to be looked at.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

import sqlalchemy as sa

from service.schemas.base import TOLERANTLY, Schema
from service.schemas.health import AlarmRule
from service.schemas.live import LiveCameraIn, LiveReport
from service.store import tables
from service.store.unreadable import read_or

NOT_MEASURED_FOR, LATE_FOR, SILENT_FOR = timedelta(seconds=10), timedelta(minutes=1), timedelta(seconds=30)
LATE_MS = 1000.0
# Limits of the processes that are watched for one venue: one that is missing for a day is no longer expected, and a
# fleet of renderers has two or three.
FORGOTTEN_AFTER, MOST_OTHERS = timedelta(days=1), 8
OTHERS = "others"
SECOND = "%Y-%m-%d %H:%M:%S"
# Rule and camera, which is empty where the alarm is of the whole venue.
AlarmKey = tuple[AlarmRule, str]
r = tables.live_reports.c


class WatchedCamera(Schema):
    """Since when a tracked camera is not measured, and since when its poses are late; None: it is as it should be."""

    not_measured_since: datetime | None = None
    late_since: datetime | None = None

    def after(self, camera: LiveCameraIn, now: datetime) -> "WatchedCamera":
        """Return what is watched of the camera after a report."""
        # A camera that is measured in every tenth picture is measured, whatever the last picture was.
        is_measured = camera.status == "measured" or camera.measured > 0
        is_late = camera.latency_ms is not None and camera.latency_ms.p99 > LATE_MS
        return WatchedCamera(
            not_measured_since=None if is_measured else self.not_measured_since or now,
            late_since=(self.late_since or now) if is_late else None,
        )


class WatchedSender(Schema):
    """A process that sends live poses: when it reported first and last, and what was wrong with its tracked cameras."""

    host: str
    pid: int | None = None
    started_at: datetime
    first_at: datetime
    reported_at: datetime
    stopped: bool = False
    cameras: dict[str, WatchedCamera]

    def made(self, report: LiveReport) -> bool:
        """Tell whether it made a report; the start alone tells apart what has one host and pid in two containers."""
        return (self.host, self.pid, self.started_at) == (report.host, report.pid, report.started_at)

    def deadlines(self) -> Iterator[tuple[AlarmKey, datetime, str]]:
        """Yield the rules that will be broken unless a better report comes before: which, when, and the reason."""
        silent = (
            f"The process on {self.host} that sends live poses has not reported since {self.reported_at:{SECOND}} UTC."
        )
        yield ("live-silent", ""), self.reported_at + SILENT_FOR, silent
        for camera, watched in self.cameras.items():
            if (since := watched.not_measured_since) is not None:
                why = f"Camera {camera} was not measured in its stream since {since:{SECOND}} UTC."
                yield ("live-not-measured", camera), since + NOT_MEASURED_FOR, why
            if (since := watched.late_since) is not None:
                why = f"Poses of camera {camera} are sent over 1 s after their pictures since {since:{SECOND}} UTC."
                yield ("live-late", camera), since + LATE_FOR, why


@dataclass(frozen=True)
class LiveWatch:
    """State behind the alarms of a venue's live poses: the processes that send them, the last to report first."""

    senders: list[WatchedSender]

    def broken(self, now: datetime) -> dict[AlarmKey, str]:
        """Return the rules that are broken at a time, with their reasons."""
        return {key: why for key, (at, why) in self._deadlines().items() if at <= now}

    def next_deadline(self, now: datetime) -> datetime | None:
        """Return when the next rule is broken, unless a better report comes before."""
        return min((at for at, _ in self._deadlines().values() if at > now), default=None)

    def missed(self) -> list[WatchedSender]:
        """Return the processes that are missed when they are silent.

        One that was told to end is not, nor one whose place another took: that began when it had reported for the last
        time, as does what is started again after a crash.
        """
        return [
            one
            for one in self.senders
            if not one.stopped and not any(other.first_at > one.reported_at for other in self.senders)
        ]

    def _deadlines(self) -> dict[AlarmKey, tuple[datetime, str]]:
        found: dict[AlarmKey, tuple[datetime, str]] = {}
        for sender in self.missed():
            for key, at, why in sender.deadlines():
                if key not in found or at < found[key][0]:
                    found[key] = at, why
        return found


def watch_of(connection: sa.Connection, venue_id: str) -> LiveWatch | None:
    """Return what is watched of a venue, None if it never had live poses."""
    row = connection.execute(sa.select(tables.live_reports).where(r.venue == venue_id)).one_or_none()
    return None if row is None else watch_in(row)


def watch_in(row: Any) -> LiveWatch:
    """Return what is watched of a venue by its row of `live_reports`."""
    unknown = WatchedSender(
        host="",
        started_at=row.reported_at,
        first_at=row.reported_at,
        reported_at=row.reported_at,
        stopped=True,
        cameras={},
    )
    return read_or(LiveWatch([unknown]), "live", row.venue, lambda: LiveWatch(_senders(row)))


def _senders(row: Any) -> list[WatchedSender]:
    newest = {"first_at": row.reported_at, **row.document, "reported_at": row.reported_at, "cameras": row.watched}
    return [WatchedSender.model_validate(one, **TOLERANTLY) for one in (newest, *row.document.get(OTHERS, []))]


def watch_after(before: LiveWatch | None, report: LiveReport, now: datetime) -> LiveWatch:
    """Return what is watched of a venue after a report that arrives `now`."""
    senders = [] if before is None else before.senders
    known = next((one for one in senders if one.made(report)), None)
    # One that is new goes on from what was known by the last that reported, whose place it may take.
    watched = (known or senders[0]).cameras if senders else {}
    tracked = [camera for camera in report.cameras if camera.stream is not None]
    sender = WatchedSender(
        host=report.host,
        pid=report.pid,
        started_at=report.started_at,
        first_at=now if known is None else known.first_at,
        reported_at=now,
        stopped=report.stopped,
        cameras={camera.id: watched.get(camera.id, WatchedCamera()).after(camera, now) for camera in tracked},
    )
    others = [one for one in senders if one is not known and _is_to_be_kept(one, sender)]
    return LiveWatch([sender, *others[:MOST_OTHERS]])


def _is_to_be_kept(other: WatchedSender, newest: WatchedSender) -> bool:
    if other.stopped:
        return False
    silent_for = newest.reported_at - other.reported_at
    # It may run as well and only report after one that has just begun, or may have ended before that.
    overlaps = other.reported_at >= newest.first_at
    return silent_for < (FORGOTTEN_AFTER if overlaps else SILENT_FOR)


def due_after(before: LiveWatch | None, due_at: datetime | None, after: LiveWatch, now: datetime) -> datetime | None:
    """Return when the alarms are to be evaluated after a report; `due_at`: when they were to be before it."""
    if due_at is not None and due_at <= now:
        return due_at
    is_news = before is not None and before.broken(now).keys() != after.broken(now).keys()
    return now if is_news else after.next_deadline(now)


def due(connection: sa.Connection, now: datetime, limit: int) -> Sequence[str]:
    """Return up to `limit` venues whose alarms of live poses are to be evaluated."""
    query = sa.select(r.venue).where(r.alarm_due_at <= now).order_by(r.alarm_due_at).limit(limit)
    return connection.scalars(query).all()


def plan_next(connection: sa.Connection, venue_id: str, now: datetime) -> None:
    """Have the alarms of a venue looked at again when the next rule may be broken: those of `now` are settled."""
    watch = watch_of(connection, venue_id)
    if watch is not None:
        next_at = watch.next_deadline(now)
        connection.execute(sa.update(tables.live_reports).where(r.venue == venue_id).values(alarm_due_at=next_at))
