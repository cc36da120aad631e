"""The end of a job: load what it depends on, fold the end into it, write what changes, in one transaction."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from datetime import datetime
from typing import Any

import sqlalchemy as sa

from service.schemas.actor import Actor
from service.schemas.base import TOLERANTLY
from service.schemas.events.webhooks import Webhook
from service.schemas.history import Cause
from service.schemas.job import JobError, Progress
from service.schemas.names import OPEN_STATUSES, JobKind, JobStatus
from service.schemas.options import Handling, Options
from service.schemas.results import AnyResult, Result
from service.schemas.venue import Venue
from service.store import tables
from service.store.database import lock_venue
from service.store.documents import Document, to_document
from service.store.events.event_log import NewEvent
from service.store.events.outbox import add_delivery
from service.store.jobs.task import stored_options
from service.store.memories import Memories, newest_memories
from service.store.statistics.counters import total
from service.store.statistics.job_outcome import JobOutcome
from service.store.unreadable import UnreadableRow, read_or
from service.store.venue_fold import (
    with_calibration,
    with_calibration_end,
    with_calibration_missed,
    with_misses,
    with_result_in_use,
)
from service.store.venue_state import Changes, StoredVenue, load, read_venue, write_changes

# Conditions that a row must still meet when it is written.
RowConditions = list[sa.ColumnElement[bool]]
DONE = Progress(stage="preview", fraction=1.0)
j = tables.jobs.c
v = tables.venues.c


@dataclass(frozen=True)
class End:
    """An end of a job: its status, and its `result` with the names of its pictures or its `error`.

    `began_with`: the venue as the calibration began with it. `memories`: those of its cameras that the result brings.
    `submitter`: who had it calibrated; `by`: who ended it, None: it ended by itself.
    """

    status: JobStatus
    result: AnyResult | None = None
    error: JobError | None = None
    pictures: Sequence[str] = ()
    began_with: Venue | None = None
    memories: Memories = field(default_factory=dict)
    submitter: Actor | None = None
    by: Actor | None = None


@dataclass(frozen=True)
class JobState:
    """A job that is open and locked, with its venue.

    `document`: the venue as it is stored, None if it is not. `memories`: those in use, where the end may bring others.
    """

    id: str
    kind: JobKind
    options: Handling
    created_at: datetime
    started_at: datetime | None
    attempt: int
    document: Document | None
    memories: Memories
    unchanged: Changes


def end_job(connection: sa.Connection, job_id: str, conditions: RowConditions, end: End) -> bool:
    """End a job inside the caller's transaction; False, and nothing is done, unless its row meets the conditions."""
    state = _load(connection, job_id, conditions, end)
    if state is not None:
        _write(connection, state, end, *fold(state, end))
    return state is not None


def _load(connection: sa.Connection, job_id: str, conditions: RowConditions, end: End) -> JobState | None:
    """Lock a job and its venue, and read them: a cancellation comes before an end or after it, not within."""
    venue_id = connection.scalar(sa.select(j.venue).where(j.id == job_id))
    if venue_id is not None:
        lock_venue(connection, venue_id)
    columns = (j.kind, j.options, j.created_at, j.started_at, j.attempt)
    row = connection.execute(sa.select(*columns).where(*conditions).with_for_update()).one_or_none()
    if row is None:
        return None
    accepted = end.result.accepted_cameras if isinstance(end.result, Result) else []
    return JobState(
        job_id,
        row.kind,
        stored_options(row.kind, row.options),
        row.created_at,
        row.started_at,
        row.attempt,
        connection.scalar(sa.select(v.document).where(v.id == venue_id)),
        newest_memories(connection, venue_id) if venue_id is not None and accepted else {},
        load(connection, venue_id, accepted),
    )


def fold(state: JobState, end: End) -> tuple[Changes, AnyResult | None]:
    """Return what the end of a job changes, and its result, which is refused if the venue was changed meanwhile."""
    result, changes = end.result, state.unchanged
    if isinstance(state.options, Options):
        changes, result = _fold_calibration(changes, state, end, dry_run=state.options.dry_run)
        changes = with_calibration_end(changes, end.status, result, dry_run=state.options.dry_run)
    now = changes.after.now
    ended = NewEvent(f"job.{end.status}", None, now, end.by, state.id)
    changes = changes.with_events(ended.to(_webhooks_of(state)))
    outcome = JobOutcome(
        state.kind, end.status, result, end.error, state.created_at, state.started_at, now, state.attempt
    )
    return replace(changes, counted=total([changes.counted, outcome.tallies()])), result


def _fold_calibration(
    changes: Changes, state: JobState, end: End, *, dry_run: bool
) -> tuple[Changes, AnyResult | None]:
    result = end.result
    if isinstance(result, Result):
        stored = _stored_venue(state)
        if stored is not None and end.began_with and stored.venue.has_same_calibration_input_as(end.began_with):
            changes = _with_result(changes, state, stored, end, result, dry_run=dry_run)
        elif result.accepted_cameras:
            result = result.refuse_all("the venue was changed while the job ran", "venue-changed")
    elif end.status == "failed" and not dry_run:
        with suppress(UnreadableRow):
            stored = _stored_venue(state)
            changes = changes if stored is None else with_calibration_missed(changes, stored.venue)
    return changes, result


def _with_result(
    changes: Changes, state: JobState, stored: StoredVenue, end: End, result: Result, *, dry_run: bool
) -> Changes:
    """Fold in the result of a calibration of a venue that is as the calibration began with it."""
    cameras = [] if dry_run else result.accepted_cameras
    changes = with_calibration(changes, result, moved=bool(cameras))
    if cameras:
        changes = with_misses(changes, [camera for camera in stored.venue.poses if camera not in cameras])
        memories = {**state.memories, **{camera: one for camera, one in end.memories.items() if camera in cameras}}
        cause: Cause = "recovered" if result.recovered_cameras else "calibrated"
        return with_result_in_use(changes, stored, result, cameras, cause, state.id, memories, end.submitter)
    return changes if dry_run else with_calibration_missed(changes, stored.venue)


def _stored_venue(state: JobState) -> StoredVenue | None:
    """Return the venue as it is stored, None if it is not. Raises `UnreadableRow`."""
    return None if state.document is None else read_venue(str(state.unchanged.before.venue_id), state.document)


def _webhooks_of(state: JobState) -> list[Webhook]:
    """Return the webhooks of a venue, whatever else of it cannot be read."""

    def read() -> list[Webhook]:
        documents = (state.document or {}).get("webhooks") or ()
        return [Webhook.model_validate(webhook, **TOLERANTLY) for webhook in documents]

    return read_or([], "venue", str(state.unchanged.before.venue_id), read)


def _write(connection: sa.Connection, state: JobState, end: End, changes: Changes, result: AnyResult | None) -> None:
    now = changes.after.now
    values: dict[str, Any] = {"status": end.status, "finished_at": now, **changed(now)}
    if result is not None:
        values |= {"result": to_document(result), "pictures": list(end.pictures), "progress": DONE.model_dump()}
    if end.error is not None:
        values["error"] = to_document(end.error)
    connection.execute(sa.update(tables.jobs).where(j.id == state.id).values(**values))
    if state.options.callback_url is not None:
        add_delivery(connection, state.options.callback_url, now, job=state.id)
    write_changes(connection, changes)


def still_open(job_id: str) -> RowConditions:
    """Return the conditions under which a job is queued or running."""
    return [j.id == job_id, j.status.in_(OPEN_STATUSES)]


def changed(now: datetime) -> dict[str, Any]:
    """Return the columns that every change of a job which clients see updates: revision and time."""
    return {"revision": j.revision + 1, "updated_at": now}
