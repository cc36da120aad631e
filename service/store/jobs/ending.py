"""The end of a job: row, event, callback and counters in one transaction.

Whoever ends a job of a venue is serialised about the venue from the beginning.
"""

from __future__ import annotations

from datetime import datetime
from functools import partial
from typing import Any

import sqlalchemy as sa

from service.schemas.actor import Actor
from service.schemas.base import TOLERANTLY
from service.schemas.events.webhooks import Webhook
from service.schemas.job import JobError
from service.schemas.names import OPEN_STATUSES, JobStatus
from service.schemas.options import Options
from service.schemas.results import AnyResult
from service.store import tables
from service.store.documents import to_document
from service.store.events.event_log import add_event
from service.store.events.outbox import add_delivery
from service.store.jobs.task import stored_options
from service.store.statistics import counters
from service.store.statistics.job_outcome import JobOutcome
from service.store.statistics.venue_quality import VenueQuality
from service.store.unreadable import read_or

# Conditions that a row must still meet when it is written.
RowConditions = list[sa.ColumnElement[bool]]
j = tables.jobs.c
v = tables.venues.c


def end_job(
    connection: sa.Connection,
    job_id: str,
    conditions: RowConditions,
    status: JobStatus,
    quality: VenueQuality,
    *,
    result: AnyResult | None = None,
    error: JobError | None = None,
    by: Actor | None = None,
    **values: Any,
) -> bool:
    """End a job with its event, callback and counters; False, and nothing is done, unless the row meets the conditions.

    `quality`: that of its venue. `by`: who ended it; None: it ended by itself.
    """
    now = quality.now
    if result is not None:
        values["result"] = to_document(result)
    if error is not None:
        values["error"] = to_document(error)
    # Only the webhooks of the venue are read.
    of_venue = sa.select(v.document["webhooks"]).where(v.id == j.venue).scalar_subquery().label("webhooks")
    ended = sa.update(tables.jobs).where(*conditions).values(status=status, finished_at=now, **values, **changed(now))
    columns = (j.kind, j.venue, j.options, j.created_at, j.started_at, j.attempt, of_venue)
    row = connection.execute(ended.returning(*columns)).one_or_none()
    if row is None:
        return False
    options = stored_options(row.kind, row.options)
    if isinstance(options, Options):
        quality.ended(status, result, dry_run=options.dry_run)
    if row.venue is not None:
        none: list[Webhook] = []
        webhooks = read_or(none, "venue", row.venue, partial(_webhooks_in, row.webhooks))
        add_event(connection, row.venue, webhooks, f"job.{status}", None, now, by, job_id)
    if options.callback_url is not None:
        add_delivery(connection, options.callback_url, now, job=job_id)
    ending = JobOutcome(row.kind, status, result, error, row.created_at, row.started_at, now, row.attempt)
    counters.add(connection, ending.tallies())
    return True


def _webhooks_in(documents: Any) -> list[Webhook]:
    return [Webhook.model_validate(webhook, **TOLERANTLY) for webhook in documents or ()]


def still_open(job_id: str) -> RowConditions:
    """Return the conditions under which a job is queued or running."""
    return [j.id == job_id, j.status.in_(OPEN_STATUSES)]


def changed(now: datetime) -> dict[str, Any]:
    """Return the columns that every change of a job which clients see updates: revision and time."""
    return {"revision": j.revision + 1, "updated_at": now}
