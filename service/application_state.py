"""State of a service: database, blob store, queue, intake of frames."""

from service import queue
from service.intake.from_sources import FromSources
from service.intake.snapshots import Snapshots
from service.intake.submit import Intake
from service.observability.disk import Disk
from service.settings import Settings
from service.store.blobs import Blobs
from service.store.repositories import Repositories

# A client waits for the store, and can come again, or the other folders of a round of deletions wait.
BLOB_PATIENCE_S = 10.0


class ApplicationState(Repositories):
    """Repositories, queue, blob store and intake, one of each in every API process and worker."""

    def __init__(self, settings: Settings) -> None:
        super().__init__(settings.home_database_url)
        queue.migrate(settings.home_database_url)
        self.settings = settings
        self.queue = queue.Queue(settings.home_database_url)
        self.blobs = Blobs(settings.home_blob_url, BLOB_PATIENCE_S)
        self.disk = Disk(settings)
        self.snapshots = Snapshots(settings, self.source_timings.count)
        self.intake = Intake(settings, self, self.blobs, self.queue.enqueue)
        self.from_sources = FromSources(self, self.snapshots, self.blobs, self.intake)

    def close(self) -> None:
        """Close the connections to the database."""
        self.queue.close()
        self.engine.dispose()
