"""The HTTP front end: checks, stores, queues and answers. It computes nothing."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from importlib.metadata import version

import structlog
from fastapi import FastAPI, Request
from starlette.responses import Response

from service.api import problems
from service.api.access import QUIET, Access
from service.api.auth import Gate
from service.api.body_limit import BodyLimit
from service.api.context import Context
from service.api.http_defaults import HttpDefaults
from service.api.shared_reads import SharedReads
from service.api.watch import Watch
from service.intake.from_sources import FromSources
from service.intake.snapshots import Snapshots
from service.intake.submit import Intake
from service.observe.disk import Disk
from service.observe.metrics import Metrics
from service.observe.readiness import Readiness
from service.pages import ROUTERS as PAGES
from service.queue import Queue
from service.queue import migrate as migrate_queue
from service.routes import (
    again,
    calibrate,
    docs,
    documented,
    field,
    health,
    intrinsics,
    jobs,
    locate,
    pictures,
    snapshot,
    venues,
)
from service.settings import Settings
from service.store.blobs import AWAY as BLOBS_AWAY
from service.store.blobs import Blobs
from service.store.counts.ends import Ends
from service.store.counts.figures import look
from service.store.engine import AWAY as DATABASE_AWAY
from service.store.engine import connect, migrate
from service.store.expiry import Expiry
from service.store.jobs import Jobs
from service.store.keys import Keys
from service.store.sessions import Sessions
from service.store.venues import Venues
from service.store.workers import Workers
from service.wire.problems import Problem

# A client waits, and can come again.
BLOB_PATIENCE_S = 10.0
log = structlog.get_logger()


def create_app(settings: Settings) -> FastAPI:
    """The application; brings the database up to date first."""
    context = open_context(settings)
    app = documented.DocumentedApp(
        title="ESC",
        summary="Keeps fixed multi-camera installations on sports fields calibrated.",
        version=version("esc-calibration"),
        lifespan=_lifespan,
        # FastAPI's own pages load their scripts from the internet.
        docs_url=None,
        redoc_url=None,
        # Spans, if tracing.configure() found out where to send them; figures and logs have ways of their own.
        telemetry={"metrics": False, "logs": False, "exclude": lambda scope: scope.get("path") in QUIET},
        responses=documented.problems(422, 503),
        # Generated clients call their functions by it.
        generate_unique_id_function=lambda route: route.name,
    )
    app.state.context = context
    app.add_middleware(BodyLimit, largest_form=int(settings.max_body_mb * 1e6))
    app.add_middleware(Access, metrics=context.metrics)
    app.add_middleware(HttpDefaults)
    documented.document_callback(app)
    documented.document_alarms(app)
    problems.install(app)
    _answer_outages(app)
    for routes in (venues, snapshot, calibrate, intrinsics, locate, field, jobs, again, pictures, health, docs):
        app.include_router(routes.router)
    for router in PAGES:
        app.include_router(router)
    return app


def open_context(settings: Settings) -> Context:
    """Open the database, the files and the queue."""
    engine = connect(settings.home_database_url)
    migrate(engine)
    migrate_queue(settings.home_database_url)
    jobs_, workers, keys, disk = Jobs(engine), Workers(engine), Keys(engine), Disk(settings)
    blobs = Blobs(settings.home_blob_url, BLOB_PATIENCE_S)
    venues_, expiry = Venues(engine), Expiry(engine)
    snapshots, intake = Snapshots(settings), Intake(settings, jobs_, expiry, blobs)
    return Context(
        settings=settings,
        engine=engine,
        queue=Queue(settings.home_database_url),
        blobs=blobs,
        disk=disk,
        venues=venues_,
        jobs=jobs_,
        ends=Ends(engine),
        expiry=expiry,
        workers=workers,
        reads=SharedReads(jobs_.get),
        watch=Watch(jobs_.states),
        metrics=Metrics(lambda: look(engine, settings.metrics_venues), disk, settings.takeover_after_s),
        readiness=Readiness(jobs_, blobs, disk, workers, settings.takeover_after_s),
        keys=keys,
        gate=Gate(keys, Sessions(engine), settings),
        snapshots=snapshots,
        intake=intake,
        from_sources=FromSources(venues_, jobs_, snapshots, intake),
    )


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    context: Context = app.state.context
    beside = [asyncio.create_task(context.watch.run()), asyncio.create_task(context.gate.run())]
    yield
    for task in beside:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task
    await context.gate.write_uses()
    context.queue.close()
    context.engine.dispose()


def _answer_outages(app: FastAPI) -> None:
    """A database or a bucket that is away is no mistake of the service: 503, try again."""

    async def away(_: Request, error: Exception) -> Response:
        log.error("storage is away", exc_info=error)
        return problems.answer(Problem("unavailable", "Its storage does not answer.", headers={"Retry-After": "5"}))

    for error in (*DATABASE_AWAY, *BLOBS_AWAY):
        app.add_exception_handler(error, away)
