"""The end of a job, whoever brings it: row, event, callback and tallies in one transaction.

Whoever ends a job of a venue is serialised about the venue from the beginning.
"""

from __future__ import annotations

from datetime import datetime
from typing import Any

import sqlalchemy as sa

from service.store import tables
from service.store.counts import tallies
from service.store.counts.endings import Ending
from service.store.counts.glances import note_end
from service.store.engine import clock
from service.store.jobs.task import OPTIONS
from service.store.told.deliveries import add_delivery
from service.store.told.events import add_job_event
from service.wire.job import JobError
from service.wire.names import OPEN, Status
from service.wire.options import Options
from service.wire.results import AnyResult
from service.wire.told.webhooks import Webhook

# What must still hold of a row when it is written.
Still = list[sa.ColumnElement[bool]]
j = tables.jobs.c
v = tables.venues.c


def end(
    connection: sa.Connection,
    job_id: str,
    still: Still,
    status: Status,
    *,
    result: AnyResult | None = None,
    error: JobError | None = None,
    **values: Any,
) -> bool:
    """End a job, have it told and counted; False, and nothing is done, if the row is not `still` so."""
    now = clock(connection)
    for name, document in (("result", result), ("error", error)):
        if document is not None:
            values[name] = document.model_dump(mode="json")
    ended = sa.update(tables.jobs).where(*still).values(status=status, finished_at=now, **values, **changed(now))
    if connection.execute(ended).rowcount == 0:
        return False
    # Of the venue only what is needed of it here.
    webhooks = v.document["webhooks"].label("webhooks")
    query = sa.select(j.kind, j.venue, j.options, j.created_at, j.started_at, j.attempt, webhooks)
    of_venue = tables.jobs.outerjoin(tables.venues, v.id == j.venue)
    row = connection.execute(query.select_from(of_venue).where(j.id == job_id)).one()
    options = OPTIONS[row.kind].model_validate(row.options)
    if isinstance(options, Options):
        note_end(connection, row.venue, status, result, now, dry_run=options.dry_run)
    if row.venue is not None:
        told = [Webhook.model_validate(webhook) for webhook in row.webhooks or ()]
        add_job_event(connection, row.venue, told, f"job.{status}", job_id, now)
    if options.callback_url is not None:
        add_delivery(connection, job_id, options.callback_url, now)
    ending = Ending(row.kind, status, result, error, row.created_at, row.started_at, now, row.attempt)
    tallies.add(connection, ending.tallies())
    return True


def still_open(job_id: str) -> Still:
    """It waits or runs."""
    return [j.id == job_id, j.status.in_(OPEN)]


def changed(now: datetime) -> dict[str, Any]:
    """What every change of a row that clients see writes beside it."""
    return {"revision": j.revision + 1, "updated_at": now}
