"""Everything that has SQL, on one database."""

from __future__ import annotations

from dataclasses import dataclass

import sqlalchemy as sa

from service.store.counts.past_calibrations import PastCalibrations
from service.store.deliveries import Deliveries
from service.store.engine import connect, migrate
from service.store.expiry import Expiry
from service.store.jobs.attempts import Attempts
from service.store.jobs.decisions import Decisions
from service.store.jobs.reading import Jobs
from service.store.jobs.submission import Submissions
from service.store.keys import Keys
from service.store.schedules import Schedules
from service.store.sessions import Sessions
from service.store.venues import Venues
from service.store.workers import Workers


@dataclass(frozen=True)
class Stores:
    """What is kept in a database, by what it is about."""

    engine: sa.Engine
    venues: Venues
    schedules: Schedules
    jobs: Jobs
    submissions: Submissions
    attempts: Attempts
    decisions: Decisions
    past_calibrations: PastCalibrations
    deliveries: Deliveries
    expiry: Expiry
    workers: Workers
    keys: Keys
    sessions: Sessions


def open_stores(url: str) -> Stores:
    """Those of a database, which is brought up to date first."""
    engine = connect(url)
    migrate(engine)
    return Stores(
        engine=engine,
        venues=Venues(engine),
        schedules=Schedules(engine),
        jobs=Jobs(engine),
        submissions=Submissions(engine),
        attempts=Attempts(engine),
        decisions=Decisions(engine),
        past_calibrations=PastCalibrations(engine),
        deliveries=Deliveries(engine),
        expiry=Expiry(engine),
        workers=Workers(engine),
        keys=Keys(engine),
        sessions=Sessions(engine),
    )
