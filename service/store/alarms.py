"""Alarms of a venue: which rules its state breaks, and which alarms begin and end by that.

They are evaluated with each change that can make one begin or end; that a time has passed is noticed when it has.
"""

from collections.abc import Mapping
from dataclasses import replace
from datetime import datetime, timedelta
from typing import Any, get_args

from service.schemas.health import Alarm, AlarmRule, Alarms, VenueAlarm
from service.schemas.history import Revision, RevisionCamera
from service.schemas.venue import Venue
from service.store.events.event_log import NewEvent
from service.store.live_alarms import AlarmKey
from service.store.revisions import CALIBRATION_CAUSES
from service.store.statistics.counters import Increments, total
from service.store.venue_state import Changes, VenueState

BEGUN = "alarms_begun"
MINUTE = "%Y-%m-%d %H:%M"


def with_alarms(changes: Changes, venue: Venue) -> Changes:
    """Begin and end the alarms of a venue by its state after all other changes, with an event for each."""
    state = changes.after
    broken, due_at = _broken_rules(state, venue, changes.knocked)
    # Alarms by rules of a newer version are that one's to end.
    known = {key: alarm for key, alarm in state.alarms.items() if alarm.rule in get_args(AlarmRule)}
    begun = {
        (rule, camera): Alarm(rule=rule, camera=camera or None, since=state.now, why=why)
        for (rule, camera), why in broken.items()
        if (rule, camera) not in known and not _is_covered_by_venue_alarm((rule, camera), broken)
    }
    active = {key: alarm.model_copy(update={"why": broken.get(key, alarm.why)}) for key, alarm in state.alarms.items()}
    ended = [key for key in known if key not in broken]
    events = [
        *(_alarm_event(venue, "alarm.began", alarm, state.now) for alarm in begun.values()),
        *(_alarm_event(venue, "alarm.ended", known[key], state.now) for key in ended),
    ]
    counted: list[Increments] = [{(BEGUN, (rule,)): 1} for rule, _ in begun]
    alarms = {key: alarm for key, alarm in (active | begun).items() if key not in ended}
    changes = changes.with_state(alarms=alarms).with_quality(alarm_due_at=due_at).with_events(*events)
    return replace(changes, counted=total([changes.counted, *counted]))


def _is_covered_by_venue_alarm(key: AlarmKey, broken: Mapping[AlarmKey, str]) -> bool:
    """True for the alarm of a camera while the same rule is broken for the whole venue: it does not begin.

    An alarm that is active already goes on, for its camera is no better.
    """
    rule, camera = key
    return camera != "" and (rule, "") in broken


def _alarm_event(venue: Venue, what: str, alarm: Alarm, at: datetime) -> NewEvent:
    event = NewEvent(what, VenueAlarm(venue=venue.id, **alarm.model_dump()), at).to(venue.webhooks)
    callback = venue.alarms.callback_url if venue.alarms else None
    return event if callback is None else replace(event, urls=[*event.urls, callback])


# The rules


def _broken_rules(
    state: VenueState, venue: Venue, knocked: Mapping[str, str] | None
) -> tuple[dict[AlarmKey, str], datetime | None]:
    """Return the rules that are broken now with their reasons, and when time alone breaks the next one."""
    rules = venue.alarms
    if rules is None or state.newest is None:
        return {}, None
    newest = state.newest.revision()
    overdue, due_at = _overdue(rules, state, newest)
    broken = [
        _moved(rules, newest),
        _drifting(rules, state),
        _knocked(rules, state, newest, knocked),
        _rejected(rules, state, newest),
        overdue,
        state.live.broken(state.now) if rules.live and state.live is not None else {},
    ]
    return {key: why for part in broken for key, why in part.items()}, due_at


def _moved(rules: Alarms, newest: Revision) -> dict[AlarmKey, str]:
    broken: dict[AlarmKey, str] = {}
    for camera in newest.cameras:
        # A camera that a person put or restored is where that person wants it.
        if newest.cause in CALIBRATION_CAUSES and _exceeds(camera.moved, rules.moved_since_last_px):
            found = " and was found again" if newest.cause == "recovered" else ""
            moved = _movement_in_words(camera, "moved")
            broken["moved-since-last", camera.id] = f"Camera {camera.id} moved {moved}{found}."
        if _exceeds(camera.drift, rules.moved_since_first_px):
            since = f"since revision {camera.drift_since}"
            broken["moved-since-first", camera.id] = (
                f"Camera {camera.id} moved {_movement_in_words(camera, 'drift')} {since}."
            )
    return broken


def _drifting(rules: Alarms, state: VenueState) -> dict[AlarmKey, str]:
    """Return the cameras whose control charts show a movement beyond the limit of the rule, with what they say."""
    limit_m = rules.trend_m
    if limit_m is None:
        return {}
    return {
        ("trend", camera): anchor.words
        for camera, anchor in state.newest_anchors().items()
        if anchor.state(limit_m) == "alarm"
    }


def _knocked(
    rules: Alarms, state: VenueState, newest: Revision, knocked: Mapping[str, str] | None
) -> dict[AlarmKey, str]:
    """Return the cameras that the last calibration found elsewhere, as long as the poses are those from before it."""
    if not rules.knocked:
        return {}
    if knocked is not None:
        return {("knocked", camera): f"Camera {camera} was {why}." for camera, why in knocked.items()}
    return {
        ("knocked", alarm.camera or ""): alarm.why
        for alarm in state.alarms.values()
        if alarm.rule == "knocked" and newest.at <= alarm.since
    }


def _rejected(rules: Alarms, state: VenueState, newest: Revision) -> dict[AlarmKey, str]:
    limit, in_a_row = rules.rejected_in_a_row, state.quality.rejected_in_a_row
    if limit is None:
        return {}
    broken: dict[AlarmKey, str] = {
        ("rejected-in-a-row", camera.id): f"The last {count} calibrations brought no pose of camera {camera.id}."
        for camera in newest.cameras
        if (count := state.quality.history(camera.id).rejected_in_a_row) >= limit
    }
    if in_a_row >= limit:
        broken["rejected-in-a-row", ""] = f"The last {in_a_row} calibrations were rejected or failed."
    return broken


def _overdue(rules: Alarms, state: VenueState, newest: Revision) -> tuple[dict[AlarmKey, str], datetime | None]:
    if rules.not_calibrated_for_h is None:
        return {}, None
    patience = timedelta(hours=rules.not_calibrated_for_h)
    now, last = state.now, state.quality.accepted_at or state.revision_at(1)
    since = {
        camera.id: state.quality.history(camera.id).accepted_at or state.revision_at(camera.drift_since)
        for camera in newest.cameras
    }
    broken: dict[AlarmKey, str] = {
        ("not-calibrated", camera): f"No pose of camera {camera} was accepted since {at:{MINUTE}} UTC."
        for camera, at in since.items()
        if at + patience <= now
    }
    if last + patience <= now:
        broken["not-calibrated", ""] = f"No poses were accepted since {last:{MINUTE}} UTC."
    return broken, min((at + patience for at in (last, *since.values()) if at + patience > now), default=None)


def _exceeds(moved: Any, limit_px: float | None) -> bool:
    return limit_px is not None and moved is not None and moved.pixels is not None and moved.pixels > limit_px


def _movement_in_words(camera: RevisionCamera, what: str) -> str:
    moved = getattr(camera, what)
    return f"by {moved.pixels:.1f} px ({moved.rotation_deg:.2f} degrees, {moved.position_m:.3f} m)"
