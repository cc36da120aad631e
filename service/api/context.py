"""What the routes work with: built once per process, handed to each request."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, cast

from fastapi import Depends, Path, Request
from sqlalchemy import Engine

from service.api.auth import Gate
from service.api.shared_reads import SharedReads
from service.api.watch import Watch
from service.intake.from_sources import FromSources
from service.intake.snapshots import Snapshots
from service.intake.submit import Intake
from service.observe.disk import Disk
from service.observe.metrics import Metrics
from service.observe.readiness import Readiness
from service.queue import Queue
from service.settings import Settings
from service.store.blobs import Blobs
from service.store.counts.ends import Ends
from service.store.expiry import Expiry
from service.store.jobs import Jobs
from service.store.keys import Keys
from service.store.venues import Venues
from service.store.workers import Workers
from service.wire.base import ID_PATTERN, JOB_ID_PATTERN


@dataclass(frozen=True)
class Context:
    """Settings and everything that holds state."""

    settings: Settings
    engine: Engine
    queue: Queue
    blobs: Blobs
    disk: Disk
    venues: Venues
    jobs: Jobs
    ends: Ends
    expiry: Expiry
    workers: Workers
    reads: SharedReads
    watch: Watch
    metrics: Metrics
    readiness: Readiness
    keys: Keys
    gate: Gate
    snapshots: Snapshots
    intake: Intake
    from_sources: FromSources


async def _context(request: Request) -> Context:
    # FastAPI calls what is not `async` in a thread, which costs as much as reading a job does.
    return cast(Context, request.app.state.context)


InContext = Annotated[Context, Depends(_context)]
VenueIdPath = Annotated[str, Path(pattern=ID_PATTERN, examples=["tsukuba"])]
JobIdPath = Annotated[str, Path(pattern=JOB_ID_PATTERN, examples=["01KAJ3Q6WZ5T3Y8R0N4M2C7B1D"])]
