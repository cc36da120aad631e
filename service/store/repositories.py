"""All repositories on one database."""

from contextlib import AbstractContextManager

from service.store.adoption import AdoptionRepository
from service.store.database import connect, migrate, snapshot
from service.store.events.feed import EventRepository
from service.store.events.outbox import OutboxRepository
from service.store.expiry import ExpiryRepository
from service.store.jobs.attempts import AttemptRepository
from service.store.jobs.decisions import DecisionRepository
from service.store.jobs.queries import JobRepository
from service.store.jobs.submission import SubmissionRepository
from service.store.keys import KeyRepository
from service.store.live import LiveRepository
from service.store.schedules import ScheduleRepository
from service.store.sessions import SessionRepository
from service.store.statistics.past_calibrations import PastCalibrationRepository
from service.store.statistics.source_timings import SourceTimingRepository
from service.store.trends import TrendRepository
from service.store.venues import VenueRepository
from service.store.workers import WorkerRepository


class Repositories:
    """All repositories of one database, whose schema is brought up to date first."""

    def __init__(self, url: str) -> None:
        self.engine = engine = connect(url)
        migrate(engine)
        self.venues = VenueRepository(engine)
        self.trends = TrendRepository(engine)
        self.live = LiveRepository(engine)
        self.schedules = ScheduleRepository(engine)
        self.adoption = AdoptionRepository(engine)
        self.submissions = SubmissionRepository(engine)
        self.jobs = JobRepository(engine)
        self.attempts = AttemptRepository(engine)
        self.decisions = DecisionRepository(engine)
        self.past_calibrations = PastCalibrationRepository(engine)
        self.source_timings = SourceTimingRepository(engine)
        self.outbox = OutboxRepository(engine)
        self.events = EventRepository(engine)
        self.expiry = ExpiryRepository(engine)
        self.workers = WorkerRepository(engine)
        self.keys = KeyRepository(engine)
        self.sessions = SessionRepository(engine)

    def snapshot(self) -> AbstractContextManager[None]:
        """Let everything that is read in a `with` block see the same state of the database, in one transaction."""
        return snapshot(self.engine)
