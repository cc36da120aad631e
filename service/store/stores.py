"""Everything that has SQL, on one database."""

from __future__ import annotations

from service.store.counts.glances import Glances
from service.store.counts.past_calibrations import PastCalibrations
from service.store.engine import connect, migrate
from service.store.expiry import Expiry
from service.store.jobs.attempts import Attempts
from service.store.jobs.decisions import Decisions
from service.store.jobs.reading import Jobs
from service.store.jobs.submission import Submissions
from service.store.keys import Keys
from service.store.refined import RefinedPoses
from service.store.schedules import Schedules
from service.store.sessions import Sessions
from service.store.told.deliveries import Deliveries
from service.store.told.following import Following
from service.store.trends import Trends
from service.store.venues import Venues
from service.store.workers import Workers


class Stores:
    """What is kept in a database, which is brought up to date first, by what it is about."""

    def __init__(self, url: str) -> None:
        self.engine = engine = connect(url)
        migrate(engine)
        self.venues = Venues(engine)
        self.trends = Trends(engine)
        self.schedules = Schedules(engine)
        self.refined = RefinedPoses(engine)
        self.submissions = Submissions(engine)
        self.jobs = Jobs(engine)
        self.attempts = Attempts(engine)
        self.decisions = Decisions(engine)
        self.glances = Glances(engine)
        self.past_calibrations = PastCalibrations(engine)
        self.deliveries = Deliveries(engine)
        self.following = Following(engine)
        self.expiry = Expiry(engine)
        self.workers = Workers(engine)
        self.keys = Keys(engine)
        self.sessions = Sessions(engine)
