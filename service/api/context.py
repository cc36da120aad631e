"""Context of the routes: built once per process, handed to each request."""

import re
from typing import Annotated, cast

from fastapi import Depends, Path, Request
from pydantic import AfterValidator

from service.api.auth import Authenticator
from service.api.change_watch import FILE_INTERVAL_S, INTERVAL_S, ChangeWatch, ClientSlots
from service.api.programs.camera_views import CameraViews
from service.api.programs.drawings import Drawings
from service.api.programs.program_pool import ProgramPool
from service.api.programs.stitches import Stitches
from service.api.shared_reads import SharedReads
from service.api.uploads import Uploads
from service.application_state import ApplicationState
from service.observability.metrics import Metrics
from service.observability.readiness import Readiness
from service.schemas.actor import Actor
from service.schemas.names import ID_PATTERN, JOB_ID_PATTERN
from service.schemas.problems import Problem
from service.settings import Settings
from service.store.database import sqlite_file
from service.store.jobs.task import Origin
from service.store.statistics.snapshot import read_statistics

# As often as `esc live` reports.
LIVE_INTERVAL_S = 0.5
# A database that is away for longer than a restart ends streams, so that their clients know that nothing arrives.
STREAM_PATIENCE_S = 5.0


class Context(ApplicationState):
    """The application state of an API process, with what limits, caches and watches its requests."""

    def __init__(self, settings: Settings) -> None:
        super().__init__(settings)
        silence_s = settings.takeover_after_s
        self.reads = SharedReads(self.jobs.get)
        interval_s = FILE_INTERVAL_S if sqlite_file(settings.home_database_url) else INTERVAL_S
        self.job_watch = ChangeWatch(self.jobs.states, interval_s)
        self.venue_watch = ChangeWatch(self.events.newest, interval_s, STREAM_PATIENCE_S)
        self.live_watch = ChangeWatch(self.live.newest, LIVE_INTERVAL_S, STREAM_PATIENCE_S)
        self.followers = ClientSlots(settings.followers, "clients follow venues", "ESC_FOLLOWERS")
        self.waiters = ClientSlots(settings.waiters, "clients wait for jobs", "ESC_WAITERS")
        self.metrics = Metrics(lambda: read_statistics(self.engine, settings.metrics_venues), self.disk, silence_s)
        self.readiness = Readiness(settings.home_database_url, self.blobs, self.disk, silence_s)
        self.authenticator = Authenticator(self.keys, self.sessions, settings)
        self.uploads = Uploads(settings)
        native = settings.native_environment
        self.clicked_poses = ProgramPool(
            # Clicks come a second apart; a pose takes less.
            "first pose",
            settings.pose_program,
            native,
            60,
            busy="Another first pose is being made.",
            again_s=1,
        )
        # As many cameras as may be planned take half a minute of a core, which others may need as well.
        self.plans = ProgramPool("plan", settings.plan_program, native, 120, busy="Another plan is being made.")
        self.drawings = Drawings(settings, self.jobs, self.blobs)
        self.stitches = Stitches(settings)
        self.camera_views = CameraViews(self.snapshots)

    def close(self) -> None:
        """Close the connections to the database."""
        self.readiness.close()
        super().close()

    def release_waiters(self) -> None:
        """Release every client that waits for a job or follows a venue."""
        self.job_watch.close()
        self.venue_watch.close()
        self.live_watch.close()


async def _context(request: Request) -> Context:
    # FastAPI calls what is not `async` in a thread, which costs as much as reading a job does.
    return cast(Context, request.app.state.context)


async def _actor(request: Request) -> Actor | None:
    origin: Origin = request.state.origin
    return origin.actor


InContext = Annotated[Context, Depends(_context)]
# Who makes the change that a request asks for.
ByActor = Annotated[Actor | None, Depends(_actor)]
VenueIdPath = Annotated[str, Path(pattern=ID_PATTERN, description="Id of the venue.", examples=["tsukuba"])]
CameraIdPath = Annotated[str, Path(pattern=ID_PATTERN, description="Id of the camera.")]


def _check_job_id(job_id: str) -> str:
    """Validate a job id; one that no job can have is answered like one that no job has any more."""
    if not re.fullmatch(JOB_ID_PATTERN, job_id):
        raise Problem("job-not-found", "The ids of jobs are 26 letters and digits; GET /jobs lists those there are.")
    return job_id


JobIdPath = Annotated[
    str,
    AfterValidator(_check_job_id),
    Path(
        description="Id of the job.",
        json_schema_extra={"pattern": JOB_ID_PATTERN},
        examples=["01KAJ3Q6WZ5T3Y8R0N4M2C7B1D"],
    ),
]
