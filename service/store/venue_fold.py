"""Changes of a venue by what happens to it, decided without a database.

A step takes the changes so far and returns them with its own; `with_alarms` comes last. What happens to a venue is a
few steps: see `with_result_in_use` for an accepted calibration, `with_venue_put` for a PUT.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

from pydantic import ValidationError

from service.schemas.actor import Actor
from service.schemas.base import TOLERANTLY
from service.schemas.events.venue_event import Poses
from service.schemas.field import FieldOfPlay
from service.schemas.findings import describe_errors
from service.schemas.geometry import Movement, PictureMotion, PosedCamera
from service.schemas.health import CalibrationEnd
from service.schemas.history import Cause, Revision
from service.schemas.names import JobStatus
from service.schemas.problems import Problem
from service.schemas.results import AnyResult, CameraResult, Result
from service.schemas.trend import Displacement
from service.schemas.venue import Camera, Venue, VenueIn
from service.store.actors import columns_of
from service.store.alarms import with_alarms
from service.store.documents import to_document
from service.store.events.event_log import NewEvent, venue_event
from service.store.memories import Memories, without_those_that_changed
from service.store.revisions import FIELD_NUMBERS, PLACED_CAUSES
from service.store.statistics.venue_quality import IN_CURVE, CalibrationSummary, CameraHistory
from service.store.trend_charts import chart_columns, no_chart_columns
from service.store.unreadable import MOST_FAULTS
from service.store.venue_state import AnchorRow, Changes, NightRow, RevisionRow, StoredVenue, VenueState

# Parts of a camera that a calibration finds, if not all of them.
CAMERA_PARTS = ("pose", "intrinsics", "light")
# The nights of each camera that are kept: three years of them.
KEPT_NIGHTS = 1100


# Calibrations


def with_calibration(changes: Changes, result: Result, *, moved: bool) -> Changes:
    """Fold in the result of a calibration; `moved`: some of its poses are in use from now on."""
    error_px = result.stitch_error_px if moved else result.stitch_error_before_px
    knocked = {camera.id: camera.rejected_because or "" for camera in result.cameras if camera.proposed is not None}
    changes = changes.with_quality(stitch_error_px=error_px, moved_px=_largest_movement_px(result))
    return replace(changes, knocked=knocked)


def with_result_in_use(
    changes: Changes,
    stored: StoredVenue,
    result: Result,
    cameras: Collection[str],
    cause: Cause,
    job_id: str,
    memories: Memories,
    by: Actor | None,
) -> Changes:
    """Replace some cameras of a venue by what a calibration found; `memories`: those of the venue from then on."""
    venue = with_result(stored.venue, result, cameras)
    changes = with_venue(changes, stored, venue)
    changes = _with_accepted(changes, result, cameras)
    changes = with_revision(changes, venue, cause, memories, job_id, by, stitch_error_px=result.stitch_error_px)
    changes = with_night(changes, venue, result, cameras, job_id, by_hand=cause == "accepted")
    return with_alarms(changes, venue)


def with_result(venue: Venue, result: Result, cameras: Collection[str] | None = None) -> Venue:
    """Return a venue with the poses, lenses, light and ridge that a calibration found.

    `cameras`: only theirs; None: those of all.
    """
    found = {
        camera.id: {part: value for part in CAMERA_PARTS if (value := getattr(camera, part)) is not None}
        for camera in result.cameras
        if cameras is None or camera.id in cameras
    }
    field = venue.field if result.ridge is None else venue.field.model_copy(update={"ridge": result.ridge})
    return venue.with_cameras(found, field=field)


def with_misses(changes: Changes, cameras: Collection[str]) -> Changes:
    """Fold in that a calibration brought no pose for some cameras."""
    quality = changes.after.quality
    missed = {
        camera: history.model_copy(update={"rejected_in_a_row": history.rejected_in_a_row + 1})
        for camera in cameras
        for history in [quality.history(camera)]
    }
    return changes.with_quality(cameras={**quality.cameras, **missed})


def with_calibration_missed(changes: Changes, venue: Venue) -> Changes:
    """Fold in that a calibration that was to bring poses brought none."""
    in_a_row = changes.after.quality.rejected_in_a_row + 1
    changes = with_misses(changes, venue.poses.keys()).with_quality(rejected_in_a_row=in_a_row)
    return with_alarms(changes, venue)


def with_calibration_end(changes: Changes, status: JobStatus, result: AnyResult | None, *, dry_run: bool) -> Changes:
    """Fold the end of a calibration, whatever it is, into the summary of the venue."""
    last = CalibrationEnd(status=status, finished_at=changes.after.now, dry_run=dry_run)
    before = changes.after.quality.glance or CalibrationSummary(last=last)
    errors, limit_px = before.errors, before.limit_px
    if isinstance(result, Result):
        found = {"verdict": result.verdict, "stitch_error_px": result.stitch_error_px}
        last = last.model_copy(update={**found, "moved_px": _largest_movement_px(result)})
        errors, limit_px = [*errors, result.stitch_error_px][-IN_CURVE:], result.stitch_error_limit_px
    return changes.with_quality(glance=CalibrationSummary(last=last, errors=errors, limit_px=limit_px))


def _with_accepted(changes: Changes, result: Result, cameras: Collection[str]) -> Changes:
    """Fold in that the poses of some cameras of a result are in use from now on."""
    now, quality = changes.after.now, changes.after.quality
    usable = {camera.id: camera.view for camera in result.cameras if camera.view is not None and camera.view.usable}
    histories = {
        camera: CameraHistory(accepted_at=now, view=usable.get(camera) or quality.history(camera).view)
        for camera in cameras
    }
    knocked = {camera: why for camera, why in (changes.knocked or {}).items() if camera not in cameras}
    changes = changes.with_quality(cameras={**quality.cameras, **histories}, accepted_at=now, rejected_in_a_row=0)
    return replace(changes, knocked=knocked)


def _largest_movement_px(result: Result) -> float | None:
    return max((camera.moved.pixels for camera in result.cameras if camera.moved.pixels is not None), default=None)


# Changes by hand


def with_venue_put(
    changes: Changes,
    stored: StoredVenue | None,
    venue: Venue,
    memories: Memories,
    cause: Cause,
    by: Actor | None,
    job_id: str | None = None,
) -> Changes:
    """Create or replace a venue, with a revision if a pose or a lens changes; `memories`: those so far.

    A camera that was put elsewhere, or has another lens, begins anew, and on another field all of them do: cameras
    stand elsewhere without having moved.
    """
    before = None if stored is None else stored.venue
    changes = with_venue(changes, stored, venue)
    if before is None:
        changes = changes.with_events(venue_event(venue, "venue.created", [], changes.after.now, by))
    elif changed := venue.changed_parts(before):
        changes = changes.with_events(venue_event(venue, "venue.changed", changed, changes.after.now, by))
    if before is not None and before.field != venue.field:
        changes = replace(changes.with_state(anchors={}), forgets_memories=True)
        memories = {}
    is_adopted = cause == "adopted"
    if stored is None or before is None or stored.unreadable or is_adopted or not venue.has_same_poses_as(before):
        kept = {} if before is None else without_those_that_changed(memories, before, venue)
        field_before = before.field if before is not None and is_adopted else None
        changes = with_revision(changes, venue, cause, kept, job_id, by, field_before=field_before)
    return with_alarms(changes, venue)


def with_revision_restored(
    changes: Changes,
    stored: StoredVenue,
    then: Venue,
    revision: Revision,
    memories: Memories,
    by: Actor | None,
    rejected_job: str | None = None,
) -> Changes:
    """Replace a venue by what it was `then`, at a revision; `memories`: those that came with it."""
    before = stored.venue
    if stored.unreadable or not then.has_same_calibration_input_as(before):
        changes = with_venue(changes, stored, then)
        if then.field.size != before.field.size:
            changes = changes.with_events(venue_event(then, "venue.changed", ["field"], changes.after.now, by))
        changes = with_revision(
            changes,
            then,
            "restored",
            memories,
            rejected_job,
            by,
            stitch_error_px=revision.stitch_error_px,
            restored=revision,
            field_before=before.field,
        )
        changes = changes.with_quality(stitch_error_px=revision.stitch_error_px)
    return with_alarms(changes, then)


def with_venue(changes: Changes, stored: StoredVenue | None, venue: Venue) -> Changes:
    """Create or replace a venue; `stored`: as it is stored.

    Raises the problem `poses-refused` for a venue that a client could not send, as its reader could not send it back.
    """
    faults = faults_of(venue)
    if faults and stored is not None:
        # Faults that another release has let pass do not keep this one from changing the rest.
        old_faults = faults_of(stored.venue)
        faults = [fault for fault in faults if fault not in old_faults]
    if faults:
        why = "; ".join(faults[:MOST_FAULTS])
        raise Problem(
            "poses-refused", f"{why}. Nothing was changed. Calibrate again; if it is the ridge, without fit_ridge."
        )
    return replace(changes, stored=stored, venue=venue)


def faults_of(venue: Venue) -> list[str]:
    """Return in words why a client could not send a venue: a stored one must be fit to be sent back as it is."""
    document = venue.model_dump(mode="json")
    try:
        # Words of newer versions are no faults.
        VenueIn.model_validate(document, **TOLERANTLY)
    except ValidationError as error:
        return describe_errors(error.errors(), None, document)
    return []


# Revisions


def with_revision(
    changes: Changes,
    venue: Venue,
    cause: Cause,
    memories: Memories,
    job: str | None = None,
    by: Actor | None = None,
    *,
    stitch_error_px: float | None = None,
    restored: Revision | None = None,
    field_before: FieldOfPlay | None = None,
) -> Changes:
    """Add the new state of a venue as a revision, with how far each camera moved, and with its memories.

    `field_before`: the field before a revision that changes its numbers, so that undoing the revision restores them.
    """
    state = changes.after
    number = 1 if state.newest is None else state.newest.number + 1
    last = {} if state.newest is None else state.newest.posed_or_none()
    movements = _movements(state, venue, number, last, cause, restored)
    changed = [camera.id for camera in venue.cameras if _is_replaced(camera, last)]
    row = RevisionRow(
        venue=venue.id,
        number=number,
        at=state.now,
        cause=cause,
        job=job,
        restored_from=None if restored is None else restored.revision,
        stitch_error_px=stitch_error_px,
        cameras=[to_document(camera.posed) for camera in venue.cameras],
        ridge=venue.field.ridge,
        field_numbers=_number_changes(field_before or venue.field, venue.field) or None,
        movements={camera: movement.model_dump() for camera, movement in movements.items()},
        **columns_of(by),
    )
    poses = Poses(
        venue=venue.id,
        revision=number,
        cause=cause,
        job=job,
        stitch_error_px=stitch_error_px,
        ridge=venue.field.ridge,
        cameras=[camera.posed for camera in venue.cameras],
        changed=changed,
        picture_motions={} if state.newest is None else _picture_motions(state.newest.number, last, venue, changed),
    )
    drifts = [movement.drift.pixels for movement in movements.values() if movement.drift]
    changes = replace(changes.with_state(newest=row), memories=memories)
    changes = changes.with_quality(drift_px=max((drift for drift in drifts if drift is not None), default=None))
    changes = changes.with_events(NewEvent("poses.changed", poses, state.now, by).to(venue.webhooks))
    if restored is not None:
        return _with_trends_until(changes, venue, restored.revision)
    if cause in (*PLACED_CAUSES, "adopted"):
        return _with_anchors_begun(_with_anchors_of(changes, venue), changed)
    return changes


def _is_replaced(camera: Camera, last: Mapping[str, PosedCamera]) -> bool:
    """True if a camera has another pose or lens than it had last."""
    return camera.id not in last or last[camera.id].pose_and_lens != camera.posed.pose_and_lens


def _picture_motions(
    since: int, last: Mapping[str, PosedCamera], venue: Venue, changed: Collection[str]
) -> dict[str, PictureMotion]:
    """Return how the pictures of `changed` cameras moved in the revision after `since`, whose cameras are `last`."""
    # Loads OpenCV, for which neither a command nor the start of a service waits.
    from service.store.movement import picture_motion

    moved = [camera for camera in venue.cameras if camera.id in changed and camera.id in last]
    return {camera.id: picture_motion(venue.field, (since, last[camera.id]), (since + 1, camera)) for camera in moved}


def _number_changes(before: FieldOfPlay, after: FieldOfPlay) -> dict[str, dict[str, float]]:
    """Return the numbers of a field that differ from those before, as `schemas.history.NumberChange` by name."""
    numbers = {name: {"before": before.number(name), "after": after.number(name)} for name in FIELD_NUMBERS}
    return {name: number for name, number in numbers.items() if number["before"] != number["after"]}


def _movements(
    state: VenueState,
    venue: Venue,
    number: int,
    last: Mapping[str, PosedCamera],
    cause: Cause,
    restored: Revision | None,
) -> dict[str, Movement]:
    """Return by camera how far it moved, since its last pose and since its first."""
    # Loads OpenCV, for which neither a command nor the start of a service waits.
    from service.store.movement import moved

    def from_there(then: PosedCamera | None, camera: Camera) -> Any:
        return None if then is None else moved(venue.field, then, camera)

    since = {} if state.newest is None else state.newest.drift_since()
    if restored is not None:
        since = {camera.id: camera.drift_since for camera in restored.cameras}
    for camera in venue.cameras:
        if camera.id not in since or (cause in PLACED_CAUSES and _is_replaced(camera, last)):
            since[camera.id] = number
    firsts = {first: state.posed_at(first) for first in set(since.values())}
    return {
        camera.id: Movement(
            moved=from_there(last.get(camera.id), camera),
            drift=from_there(firsts[since[camera.id]].get(camera.id, camera), camera),
            drift_since=since[camera.id],
        )
        for camera in venue.cameras
    }


# Trends. A job's worker compares a camera with the anchor that it was given; its displacement counts where that anchor
# still is the camera's.


def with_night(
    changes: Changes, venue: Venue, result: Result, cameras: Collection[str], job_id: str, *, by_hand: bool
) -> Changes:
    """Add how far some cameras of a result are from their anchors, and chart it.

    `venue`: as it is with their poses. What a person accepted `by_hand` is right by that person's word: it is the new
    anchor. So is where a knocked camera was found.
    """
    posed = {camera.id: camera.posed for camera in venue.cameras}
    results = [camera for camera in result.cameras if camera.id in cameras]
    for camera in results:
        changes = _with_displacement(changes, camera, posed[camera.id], job_id, is_anchor=by_hand or camera.knocked)
    return _with_charts(changes, [camera.id for camera in results])


def _with_displacement(
    changes: Changes, camera: CameraResult, posed: PosedCamera, job_id: str, *, is_anchor: bool
) -> Changes:
    """Add the displacement of a camera; `is_anchor`: its pose is the new anchor, unless its anchor is as new."""
    newest, moved = changes.after.newest, camera.displacement
    assert newest is not None
    anchor = changes.after.newest_anchors().get(camera.id)
    anew = is_anchor and anchor is not None and anchor.revision != newest.number
    if anew or (anchor is None and moved is not None):
        changes = _with_anchors_begun(changes, [camera.id])
        anchor = changes.after.anchors[camera.id, newest.number]
    if moved is None or anchor is None or (anchor.posed is not None and moved.anchor != anchor.revision):
        # It was compared with another anchor than the camera now has, if with any.
        return changes
    if anew:
        # A change of focal length since the anchor before says nothing about the lens in use now.
        moved = moved.model_copy(update={"focal_length": None, "sigma_focal_length": None})
    if anchor.posed is None:
        moved = moved.as_anchor()
        anchor = replace(anchor, at=changes.after.now, posed=to_document(posed))
    night = _night(camera, moved, anchor, newest.number, job_id, changes.after)
    # A person may accept by hand what a job has brought already.
    before = changes.after.nights.get(camera.id, ())
    kept = [one for one in before if one.job != job_id]
    dropped = [one.id for one in before if one.job == job_id]
    return replace(changes, dropped=[*changes.dropped, *dropped]).with_state(
        anchors={**changes.after.anchors, (camera.id, anchor.revision): anchor},
        nights={**changes.after.nights, camera.id: [*kept, night]},
    )


def _night(
    camera: CameraResult, moved: Displacement, anchor: AnchorRow, revision: int, job_id: str, state: VenueState
) -> NightRow:
    sigma = camera.sigma
    return NightRow(
        venue=anchor.venue,
        camera=camera.id,
        anchor=anchor.revision,
        revision=revision,
        job=job_id,
        at=state.now,
        sigma_rotation_deg=sigma.rotation_deg if sigma else None,
        sigma_position_m=sigma.position_m if sigma else None,
        **moved.model_dump(exclude={"anchor", "at"}),
    )


def _with_anchors_begun(changes: Changes, cameras: Collection[str]) -> Changes:
    """Begin new anchors of cameras: the first pose that is accepted from now on becomes the anchor."""
    state = changes.after
    assert state.newest is not None
    anchors = {
        key: replace(anchor, moved_m=None) if anchor.camera in cameras else anchor
        for key, anchor in state.anchors.items()
    }
    for camera in cameras:
        empty = no_chart_columns(camera)
        key = (camera, state.newest.number)
        anchors[key] = AnchorRow(venue=state.newest.venue, camera=camera, revision=state.newest.number, **empty)
    return changes.with_state(anchors=anchors)


def _with_anchors_of(changes: Changes, venue: Venue) -> Changes:
    """End the anchors of cameras that a venue has no more."""
    cameras = {camera.id for camera in venue.cameras}
    anchors = {key: anchor for key, anchor in changes.after.anchors.items() if anchor.camera in cameras}
    return changes.with_state(anchors=anchors)


def _with_trends_until(changes: Changes, venue: Venue, revision: int) -> Changes:
    """Rewind the trends of a venue to a revision: what came after it ends."""
    state = changes.after
    anchors = {key: anchor for key, anchor in state.anchors.items() if anchor.revision <= revision}
    nights = {camera: [one for one in rows if one.revision <= revision] for camera, rows in state.nights.items()}
    changes = replace(changes.with_state(anchors=anchors, nights=nights), last_night=revision)
    return _with_charts(changes, [camera.id for camera in venue.cameras])


def _with_charts(changes: Changes, cameras: Collection[str]) -> Changes:
    """Write into the anchors of cameras what their charts say now, and drop the nights that are too many."""
    anchors, dropped = dict(changes.after.anchors), list(changes.dropped)
    for camera, anchor in changes.after.newest_anchors().items():
        if camera in cameras:
            nights = changes.after.nights.get(camera, ())
            since = [night for night in nights if night.anchor == anchor.revision]
            anchors[camera, anchor.revision] = replace(anchor, **chart_columns(camera, since, anchor))
            dropped += [night.id for night in _too_many(nights)]
    return replace(changes.with_state(anchors=anchors), dropped=dropped)


def _too_many(nights: Sequence[Any]) -> list[Any]:
    """Return the nights beyond `KEPT_NIGHTS`: earlier ones of a day with several jobs first, then the oldest days."""
    last_of_days = set({night.at.date(): number for number, night in enumerate(nights)}.values())
    by_worth = sorted(range(len(nights)), key=lambda number: (number in last_of_days, number))
    return [nights[number] for number in by_worth[: max(0, len(nights) - KEPT_NIGHTS)]]
