"""The home of a service: its database, its files and its queue, and what brings frames into them."""

from __future__ import annotations

from dataclasses import dataclass

from service import queue
from service.intake.from_sources import FromSources
from service.intake.snapshots import Snapshots
from service.intake.submit import Intake
from service.observe.disk import Disk
from service.queue import Queue
from service.settings import Settings
from service.store.blobs import Blobs
from service.store.stores import Stores, open_stores

# Somebody waits for the store: a client, who can come again, or the other folders of a round that deletes.
BLOB_PATIENCE_S = 10.0


@dataclass(frozen=True)
class Home(Stores):
    """What each process that serves or works holds of it."""

    settings: Settings
    blobs: Blobs
    disk: Disk
    queue: Queue
    snapshots: Snapshots
    intake: Intake
    from_sources: FromSources

    def close(self) -> None:
        """Let the database go."""
        self.queue.close()
        self.engine.dispose()


def open_home(settings: Settings) -> Home:
    """The home that the settings name, its database brought up to date."""
    stores = open_stores(settings.home_database_url)
    queue.migrate(settings.home_database_url)
    blobs, snapshots = Blobs(settings.home_blob_url, BLOB_PATIENCE_S), Snapshots(settings)
    intake = Intake(settings, stores.submissions, stores.expiry, blobs)
    return Home(
        **vars(stores),
        settings=settings,
        blobs=blobs,
        disk=Disk(settings),
        queue=Queue(settings.home_database_url),
        snapshots=snapshots,
        intake=intake,
        from_sources=FromSources(stores.venues, stores.submissions, snapshots, intake),
    )
