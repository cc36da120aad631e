"""Alarms of venues: which ring, since when, and whom that is told. All SQL about them.

They are looked at in each transaction that can make one begin or end; that a time has passed is looked at when it has.
"""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import Any

import sqlalchemy as sa

from service.store import tables
from service.store.counts import tallies
from service.store.counts.figures import note
from service.store.deliveries import add_alarm_delivery
from service.store.engine import clock
from service.store.revisions import TAKEN, first_revision_at, newest_revision
from service.store.schedules import schedule_of
from service.wire.health import Alarm, AlarmEvent, AlarmRule, Alarms, VenueAlarm, VenueHealth
from service.wire.history import Revision, RevisionCamera
from service.wire.venue import Venue

BEGUN = "alarms_begun"
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
    return VenueHealth(
        state="alarm" if alarms else "ok",
        alarms=alarms,
        revision=newest.revision,
        cameras=newest.cameras,
        stitch_error_px=quality.stitch_error_px if quality else None,
        accepted_at=quality.accepted_at if quality else None,
        rejected_in_a_row=quality.rejected_in_a_row if quality else 0,
        schedule=schedule_of(connection, venue_id),
    )


def _rings(connection: sa.Connection, venue: Venue, now: datetime) -> tuple[dict[Key, str], datetime | None]:
    """What rings now and why, and when to look again if nothing happens before."""
    rules, newest = venue.alarms, newest_revision(connection, venue.id)
    if rules is None or newest is None:
        return {}, None
    quality = connection.execute(sa.select(tables.venue_quality).where(q.venue == venue.id)).one_or_none()
    rings = _moved(rules, newest)
    rejected = quality.rejected_in_a_row if quality else 0
    if rules.rejected_in_a_row is not None and rejected >= rules.rejected_in_a_row:
        rings["rejected-in-a-row", ""] = f"The last {rejected} calibrations were rejected or failed."
    if rules.not_calibrated_for_h is None:
        return rings, None
    last = (quality.accepted_at if quality else None) or first_revision_at(connection, venue.id)
    due_at = last + timedelta(hours=rules.not_calibrated_for_h)
    if now < due_at:
        return rings, due_at
    rings["not-calibrated", ""] = f"No poses were accepted since {last:%Y-%m-%d %H:%M} UTC."
    return rings, None


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
    if venue.alarms is not None and venue.alarms.callback_url is not None:
        data = VenueAlarm(venue=venue.id, **alarm.model_dump())
        event = AlarmEvent.model_validate({"type": what, "timestamp": at, "data": data})
        add_alarm_delivery(connection, event, venue.alarms.callback_url, at)


def _is(venue_id: str, key: Key) -> list[sa.ColumnElement[bool]]:
    rule, camera = key
    return [a.venue == venue_id, a.rule == rule, a.camera == camera]
