"""Alarms of venues: which are active, since when, and the events of their beginning and end. All SQL about them.

They are looked at in each transaction that can make one begin or end; that a time has passed is looked at when it has.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from datetime import datetime, timedelta
from typing import Any, get_args

import sqlalchemy as sa

from service.schemas.health import Alarm, AlarmRule, Alarms, CameraHealth, VenueAlarm, VenueHealth
from service.schemas.history import Revision, RevisionCamera
from service.schemas.venue import Venue
from service.store import live_alarms, tables
from service.store.events.event_log import add_event
from service.store.events.outbox import add_delivery
from service.store.live_alarms import AlarmKey
from service.store.revisions import CALIBRATION_CAUSES, newest_known, newest_revision, revision_at
from service.store.schedules import schedule_of
from service.store.statistics import counters
from service.store.statistics.venue_quality import CameraHistory, QualityRow, VenueQuality, read_quality
from service.store.statistics.venue_summary import active_alarms
from service.store.trends import trends_of

BEGUN = "alarms_begun"
MINUTE = "%Y-%m-%d %H:%M"
a = tables.alarms.c


def update_alarms(connection: sa.Connection, quality: VenueQuality, venue: Venue) -> None:
    """Begin and end the alarms of a venue, with an event for each, inside the caller's serialised transaction."""
    active = alarms_of(connection, venue.id)
    rings, due_at = _broken_rules(connection, quality, venue, active)
    # Alarms by rules of a newer version are that one's to end.
    known = {(alarm.rule, alarm.camera or ""): alarm for alarm in active if alarm.rule in get_args(AlarmRule)}
    begun: Counter[counters.CounterKey] = Counter()
    for (rule, camera), why in rings.items():
        if (rule, camera) not in known:
            if _is_covered_by_venue_alarm((rule, camera), rings):
                continue
            _begin_alarm(connection, venue, Alarm(rule=rule, camera=camera or None, since=quality.now, why=why))
            begun[BEGUN, (rule,)] += 1
        elif known[rule, camera].why != why:
            connection.execute(sa.update(tables.alarms).where(*_alarm_row(venue.id, (rule, camera))).values(why=why))
    # Counted together: each tally by itself, in the order of the cameras, two venues would lock in different orders.
    counters.add(connection, begun)
    for key in known.keys() - rings.keys():
        connection.execute(sa.delete(tables.alarms).where(*_alarm_row(venue.id, key)))
        _add_alarm_event(connection, venue, "alarm.ended", known[key], quality.now)
    quality.row.alarm_due_at = due_at


def _is_covered_by_venue_alarm(key: AlarmKey, rings: Mapping[AlarmKey, str]) -> bool:
    """True for the alarm of a camera while the same rule is broken for the whole venue: it does not begin.

    An alarm that is active already goes on, for its camera is no better.
    """
    rule, camera = key
    return camera != "" and (rule, "") in rings


def alarms_of(connection: sa.Connection, venue_id: str) -> list[Alarm]:
    """Return the active alarms of a venue, the oldest first."""
    return active_alarms(connection, [venue_id]).get(venue_id, [])


def health_of(connection: sa.Connection, venue_id: str) -> VenueHealth | None:
    """Return the health of a venue, None if there is no such venue."""
    newest = newest_revision(connection, venue_id)
    if newest is None:
        return None
    quality = read_quality(connection, venue_id) or QualityRow()
    alarms = alarms_of(connection, venue_id)
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


def _broken_rules(
    connection: sa.Connection, quality: VenueQuality, venue: Venue, active: Sequence[Alarm]
) -> tuple[dict[AlarmKey, str], datetime | None]:
    """Return the rules that are broken now with their reasons, and when time alone breaks the next one."""
    newest = newest_known(connection, quality)
    if venue.alarms is None or newest is None:
        return {}, None
    histories = {camera.id: quality.row.history(camera.id) for camera in newest.cameras}
    overdue, due_at = _overdue(connection, venue, newest, quality, histories)
    moved = _moved(venue.alarms, newest) | _drifting(connection, venue)
    knocked = _knocked(active, quality, newest) if venue.alarms.knocked else {}
    rejected = _rejected(venue.alarms, quality.row.rejected_in_a_row, histories)
    return moved | knocked | rejected | overdue | _live(connection, quality, venue), due_at


def _live(connection: sa.Connection, quality: VenueQuality, venue: Venue) -> dict[AlarmKey, str]:
    """Return the rules that the live poses of a venue break, with their reasons, as far as their process has told."""
    if venue.alarms is None or not venue.alarms.live:
        return {}
    watch = live_alarms.watch_of(connection, venue.id)
    return {} if watch is None else watch.broken(quality.now)


def _drifting(connection: sa.Connection, venue: Venue) -> dict[AlarmKey, str]:
    """Return the cameras whose control charts show a movement beyond the limit of the rule, with what they say."""
    limit_m = venue.alarms.trend_m if venue.alarms else None
    if limit_m is None:
        return {}
    trends = trends_of(connection, venue.id)
    return {("trend", camera): trend.words for camera, trend in trends.items() if trend.state(limit_m) == "alarm"}


def _knocked(active: Sequence[Alarm], quality: VenueQuality, newest: Revision) -> dict[AlarmKey, str]:
    """Return the cameras that the last calibration found elsewhere, as long as the poses are those from before it."""
    if quality.knocked is not None:
        return {("knocked", camera): f"Camera {camera} was {why}." for camera, why in quality.knocked.items()}
    return {
        ("knocked", alarm.camera or ""): alarm.why
        for alarm in active
        if alarm.rule == "knocked" and newest.at <= alarm.since
    }


def _rejected(rules: Alarms, in_a_row: int, histories: Mapping[str, CameraHistory]) -> dict[AlarmKey, str]:
    limit = rules.rejected_in_a_row
    if limit is None:
        return {}
    rings: dict[AlarmKey, str] = {
        ("rejected-in-a-row", camera): f"The last {count} calibrations brought no pose of camera {camera}."
        for camera, history in histories.items()
        if (count := history.rejected_in_a_row) >= limit
    }
    if in_a_row >= limit:
        rings["rejected-in-a-row", ""] = f"The last {in_a_row} calibrations were rejected or failed."
    return rings


def _overdue(
    connection: sa.Connection,
    venue: Venue,
    newest: Revision,
    quality: VenueQuality,
    histories: Mapping[str, CameraHistory],
) -> tuple[dict[AlarmKey, str], datetime | None]:
    if venue.alarms is None or venue.alarms.not_calibrated_for_h is None:
        return {}, None
    patience = timedelta(hours=venue.alarms.not_calibrated_for_h)
    now, last = quality.now, quality.row.accepted_at or revision_at(connection, venue.id, 1)
    since = {
        camera.id: histories[camera.id].accepted_at or revision_at(connection, venue.id, camera.drift_since)
        for camera in newest.cameras
    }
    rings: dict[AlarmKey, str] = {
        ("not-calibrated", camera): f"No pose of camera {camera} was accepted since {at:{MINUTE}} UTC."
        for camera, at in since.items()
        if at + patience <= now
    }
    if last + patience <= now:
        rings["not-calibrated", ""] = f"No poses were accepted since {last:{MINUTE}} UTC."
    return rings, min((at + patience for at in (last, *since.values()) if at + patience > now), default=None)


def _moved(rules: Alarms, newest: Revision) -> dict[AlarmKey, str]:
    rings: dict[AlarmKey, str] = {}
    for camera in newest.cameras:
        # A camera that a person put or restored is where that person wants it.
        if newest.cause in CALIBRATION_CAUSES and _exceeds(camera.moved, rules.moved_since_last_px):
            found = " and was found again" if newest.cause == "recovered" else ""
            moved = _movement_in_words(camera, "moved")
            rings["moved-since-last", camera.id] = f"Camera {camera.id} moved {moved}{found}."
        if _exceeds(camera.drift, rules.moved_since_first_px):
            since = f"since revision {camera.drift_since}"
            rings["moved-since-first", camera.id] = (
                f"Camera {camera.id} moved {_movement_in_words(camera, 'drift')} {since}."
            )
    return rings


def _exceeds(moved: Any, limit_px: float | None) -> bool:
    return limit_px is not None and moved is not None and moved.pixels is not None and moved.pixels > limit_px


def _movement_in_words(camera: RevisionCamera, what: str) -> str:
    moved = getattr(camera, what)
    return f"by {moved.pixels:.1f} px ({moved.rotation_deg:.2f} degrees, {moved.position_m:.3f} m)"


def _begin_alarm(connection: sa.Connection, venue: Venue, alarm: Alarm) -> None:
    values = alarm.model_dump(exclude={"setting"}) | {"camera": alarm.camera or ""}
    connection.execute(sa.insert(tables.alarms).values(venue=venue.id, **values))
    _add_alarm_event(connection, venue, "alarm.began", alarm, alarm.since)


def _add_alarm_event(connection: sa.Connection, venue: Venue, what: str, alarm: Alarm, at: datetime) -> None:
    data = VenueAlarm(venue=venue.id, **alarm.model_dump())
    event = add_event(connection, venue.id, venue.webhooks, what, data, at)
    if venue.alarms is not None and venue.alarms.callback_url is not None:
        add_delivery(connection, venue.alarms.callback_url, at, event=event)


def _alarm_row(venue_id: str, key: AlarmKey) -> list[sa.ColumnElement[bool]]:
    rule, camera = key
    return [a.venue == venue_id, a.rule == rule, a.camera == camera]
