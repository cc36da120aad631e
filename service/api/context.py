"""What the routes work with: built once per process, handed to each request."""

from __future__ import annotations

from typing import Annotated, cast

from fastapi import Depends, Path, Request

from service.api.auth import Gate
from service.api.programs.clicked_pose import ClickedPoses
from service.api.programs.drawings import Drawings
from service.api.programs.stitches import Stitches
from service.api.shared_reads import SharedReads
from service.api.uploads import Uploads
from service.api.watch import Places, Watch
from service.home import Home
from service.observe.metrics import Metrics
from service.observe.readiness import Readiness
from service.settings import Settings
from service.store.counts.figures import look
from service.wire.names import ID_PATTERN, JOB_ID_PATTERN


class Context(Home):
    """The home, and what answers from it."""

    def __init__(self, settings: Settings) -> None:
        super().__init__(settings)
        silence_s = settings.takeover_after_s
        self.reads = SharedReads(self.jobs.get)
        self.watch = Watch(self.jobs.states)
        self.watch_venues = Watch(self.following.newest)
        self.followers = Places(settings.followers)
        self.metrics = Metrics(lambda: look(self.engine, settings.metrics_venues), self.disk, silence_s)
        self.readiness = Readiness(self.jobs, self.blobs, self.disk, self.workers, silence_s)
        self.gate = Gate(self.keys, self.sessions, settings)
        self.uploads = Uploads(settings)
        self.clicked_poses = ClickedPoses(settings)
        self.drawings = Drawings(settings, self.jobs, self.blobs)
        self.stitches = Stitches(settings)

    def let_go(self) -> None:
        """Let everybody go who waits for a job or follows a venue."""
        self.watch.close()
        self.watch_venues.close()


async def _context(request: Request) -> Context:
    # FastAPI calls what is not `async` in a thread, which costs as much as reading a job does.
    return cast(Context, request.app.state.context)


InContext = Annotated[Context, Depends(_context)]
VenueIdPath = Annotated[str, Path(pattern=ID_PATTERN, examples=["tsukuba"])]
JobIdPath = Annotated[str, Path(pattern=JOB_ID_PATTERN, examples=["01KAJ3Q6WZ5T3Y8R0N4M2C7B1D"])]
