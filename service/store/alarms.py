"""Alarms of venues: which ring, since when, and whom that is told. All SQL about them.

They are looked at in each transaction that can make one begin or end; that a time has passed is looked at when it has.
"""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime, timedelta
from typing import Any

import sqlalchemy as sa

from service.store import tables
from service.store.counts import tallies
from service.store.counts.courses import Course, courses_of
from service.store.counts.figures import note
from service.store.engine import clock
from service.store.revisions import TAKEN, newest_revision, revision_at
from service.store.schedules import schedule_of
from service.store.told.deliveries import add_event_delivery
from service.store.told.events import add_event
from service.store.trends import trends_of
from service.wire.health import Alarm, AlarmRule, Alarms, CameraHealth, VenueAlarm, VenueHealth
from service.wire.history import Revision, RevisionCamera
from service.wire.venue import Venue

BEGUN = "alarms_begun"
MINUTE = "%Y-%m-%d %H:%M"
# Rule and camera, which is empty where the alarm is of the whole venue.
Key = tuple[AlarmRule, str]
a = tables.alarms.c
q = tables.venue_quality.c


def settle_alarms(connection: sa.Connection, venue: Venue) -> None:
    """Let those begin and end that do, and have them told, inside the caller's serialised transaction."""
    now = clock(connection)
    rings, due_at = _rings(connection, venue, now)
    known = {(alarm.rule, alarm.camera or ""): alarm for alarm in alarms_of(connection, venue.id)}
    for (rule, camera), why in rings.items():
        if (rule, camera) not in known:
            _begin(connection, venue, Alarm(rule=rule, camera=camera or None, since=now, why=why))
        elif known[rule, camera].why != why:
            connection.execute(sa.update(tables.alarms).where(*_is(venue.id, (rule, camera))).values(why=why))
    for key in known.keys() - rings.keys():
        connection.execute(sa.delete(tables.alarms).where(*_is(venue.id, key)))
        _tell(connection, venue, "alarm.ended", known[key], now)
    note(connection, venue.id, alarm_due_at=due_at)


def alarms_of(connection: sa.Connection, venue_id: str) -> list[Alarm]:
    """Those that ring, the oldest first."""
    query = sa.select(tables.alarms).where(a.venue == venue_id).order_by(a.since, a.rule, a.camera)
    return [
        Alarm(rule=row.rule, camera=row.camera or None, since=row.since, why=row.why)
        for row in connection.execute(query)
    ]


def health_of(connection: sa.Connection, venue_id: str) -> VenueHealth | None:
    """How a venue is doing, None if there is none."""
    newest = newest_revision(connection, venue_id)
    if newest is None:
        return None
    quality = connection.execute(sa.select(tables.venue_quality).where(q.venue == venue_id)).one_or_none()
    alarms = alarms_of(connection, venue_id)
    courses = courses_of(connection, venue_id)
    return VenueHealth(
        state="alarm" if alarms else "ok",
        alarms=alarms,
        revision=newest.revision,
        cameras=[_doing(camera, courses.get(camera.id, Course())) for camera in newest.cameras],
        stitch_error_px=quality.stitch_error_px if quality else None,
        accepted_at=quality.accepted_at if quality else None,
        rejected_in_a_row=quality.rejected_in_a_row if quality else 0,
        schedule=schedule_of(connection, venue_id),
    )


def _doing(camera: RevisionCamera, course: Course) -> CameraHealth:
    return CameraHealth(**dict(camera), accepted_at=course.accepted_at, rejected_in_a_row=course.rejected_in_a_row)


def _rings(connection: sa.Connection, venue: Venue, now: datetime) -> tuple[dict[Key, str], datetime | None]:
    """What rings now and why, and when to look again if nothing happens before.

    What is so of the whole venue rings once, and not for each of its cameras.
    """
    newest = newest_revision(connection, venue.id)
    if venue.alarms is None or newest is None:
        return {}, None
    quality = connection.execute(sa.select(tables.venue_quality).where(q.venue == venue.id)).one_or_none()
    known = courses_of(connection, venue.id)
    courses = {camera.id: known.get(camera.id, Course()) for camera in newest.cameras}
    overdue, due_at = _overdue(connection, venue, newest, quality, courses, now)
    moved = _moved(venue.alarms, newest) | _drifting(connection, venue)
    return moved | _rejected(venue.alarms, quality, courses) | overdue, due_at


def _drifting(connection: sa.Connection, venue: Venue) -> dict[Key, str]:
    """The cameras that move slowly: what their control charts say, where that is so far that the rule minds."""
    limit_m = venue.alarms.trend_m if venue.alarms else None
    if limit_m is None:
        return {}
    trends = trends_of(connection, venue.id)
    return {("trend", camera): trend.words for camera, trend in trends.items() if trend.state(limit_m) == "alarm"}


def _rejected(rules: Alarms, quality: Any, courses: Mapping[str, Course]) -> dict[Key, str]:
    limit = rules.rejected_in_a_row
    if limit is None or quality is None:
        return {}
    if quality.rejected_in_a_row >= limit:
        why = f"The last {quality.rejected_in_a_row} calibrations were rejected or failed."
        return {("rejected-in-a-row", ""): why}
    return {
        ("rejected-in-a-row", camera): f"The last {count} calibrations brought no pose of camera {camera}."
        for camera, course in courses.items()
        if (count := course.rejected_in_a_row) >= limit
    }


def _overdue(
    connection: sa.Connection,
    venue: Venue,
    newest: Revision,
    quality: Any,
    courses: Mapping[str, Course],
    now: datetime,
) -> tuple[dict[Key, str], datetime | None]:
    if venue.alarms is None or venue.alarms.not_calibrated_for_h is None:
        return {}, None
    patience = timedelta(hours=venue.alarms.not_calibrated_for_h)
    last = (quality.accepted_at if quality else None) or revision_at(connection, venue.id, 1)
    if last + patience <= now:
        return {("not-calibrated", ""): f"No poses were accepted since {last:{MINUTE}} UTC."}, None
    since = {
        camera.id: courses[camera.id].accepted_at or revision_at(connection, venue.id, camera.drift_since)
        for camera in newest.cameras
    }
    rings: dict[Key, str] = {
        ("not-calibrated", camera): f"No pose of camera {camera} was accepted since {at:{MINUTE}} UTC."
        for camera, at in since.items()
        if at + patience <= now
    }
    return rings, min(at + patience for at in (last, *since.values()) if at + patience > now)


def _moved(rules: Alarms, newest: Revision) -> dict[Key, str]:
    rings: dict[Key, str] = {}
    for camera in newest.cameras:
        # What somebody put or put back is where they want it.
        if newest.cause in TAKEN and _beyond(camera.moved, rules.moved_since_last_px):
            rings["moved-since-last", camera.id] = f"Camera {camera.id} moved {_by(camera, 'moved')}."
        if _beyond(camera.drift, rules.moved_since_first_px):
            since = f"since revision {camera.drift_since}"
            rings["moved-since-first", camera.id] = f"Camera {camera.id} moved {_by(camera, 'drift')} {since}."
    return rings


def _beyond(moved: Any, limit_px: float | None) -> bool:
    return limit_px is not None and moved is not None and moved.pixels is not None and moved.pixels > limit_px


def _by(camera: RevisionCamera, what: str) -> str:
    moved = getattr(camera, what)
    return f"by {moved.pixels:.1f} px ({moved.rotation_deg:.2f} degrees, {moved.position_m:.3f} m)"


def _begin(connection: sa.Connection, venue: Venue, alarm: Alarm) -> None:
    values = alarm.model_dump() | {"camera": alarm.camera or ""}
    connection.execute(sa.insert(tables.alarms).values(venue=venue.id, **values))
    tallies.add(connection, {(BEGUN, (alarm.rule,)): 1})
    _tell(connection, venue, "alarm.began", alarm, alarm.since)


def _tell(connection: sa.Connection, venue: Venue, what: str, alarm: Alarm, at: datetime) -> None:
    data = VenueAlarm(venue=venue.id, **alarm.model_dump())
    event = add_event(connection, venue.id, venue.webhooks, what, data, at)
    if venue.alarms is not None and venue.alarms.callback_url is not None:
        add_event_delivery(connection, event, venue.alarms.callback_url, at)


def _is(venue_id: str, key: Key) -> list[sa.ColumnElement[bool]]:
    rule, camera = key
    return [a.venue == venue_id, a.rule == rule, a.camera == camera]
