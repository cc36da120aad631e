"""Silence: jobs that nothing was heard of for so long that whoever had them may be gone."""

from collections.abc import Collection
from datetime import datetime, timedelta

import sqlalchemy as sa

from service.schemas.names import OPEN_STATUSES
from service.store import tables

# A sign of life that lies further ahead was given by a clock that has been put right since.
CLOCK_TOLERANCE = timedelta(seconds=5)
# A round looks after so many.
BATCH = 100
j = tables.jobs.c


def silent_jobs(connection: sa.Connection, now: datetime, seconds: float, but: Collection[str] = ()) -> list[str]:
    """Return open jobs that nothing was heard of for a while, or only by a clock that has been put back since.

    `but`: without these.
    """
    query = sa.select(j.id).where(j.status.in_(OPEN_STATUSES), unheard_for(seconds, now), j.id.not_in(but))
    return list(connection.scalars(query.order_by(j.updated_at).limit(BATCH)))


def unheard_for(seconds: float, now: datetime) -> sa.ColumnElement[bool]:
    """Return the condition under which nothing was heard of a job for so long."""
    return sa.or_(j.updated_at < now - timedelta(seconds=seconds), j.updated_at > now + CLOCK_TOLERANCE)
