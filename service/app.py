"""The HTTP front end: checks, stores, queues and answers. It computes nothing."""

from __future__ import annotations

import asyncio
import errno
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from importlib.metadata import version

import structlog
from fastapi import FastAPI, Request
from starlette.responses import Response

from service.api import problems
from service.api.access import QUIET, Access
from service.api.body_limit import BodyLimit
from service.api.context import Context
from service.api.http_defaults import HttpDefaults
from service.pages import ROUTERS as PAGES
from service.routes import docs, following, health, jobs, pictures, snapshot, stitch, venues
from service.routes.contract import documented
from service.routes.submissions import again, frames, intrinsics, locate
from service.settings import Settings
from service.store.blobs import AWAY as BLOBS_AWAY
from service.store.engine import AWAY as DATABASE_AWAY
from service.wire.problems import Problem

DISK_FULL = (errno.ENOSPC, errno.EDQUOT)
log = structlog.get_logger()


def create_app(settings: Settings) -> FastAPI:
    """The application; brings the database up to date first."""
    context = Context(settings)
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
    documented.document_events(app)
    problems.install(app)
    _answer_outages(app)
    for routes in (
        venues,
        following,
        snapshot,
        stitch,
        frames,
        intrinsics,
        locate,
        jobs,
        again,
        pictures,
        health,
        docs,
    ):
        app.include_router(routes.router)
    for router in PAGES:
        app.include_router(router)
    return app


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    context: Context = app.state.context
    duties = (context.watch.run, context.watch_venues.run, context.gate.run)
    beside = [asyncio.create_task(duty()) for duty in duties]
    yield
    for task in beside:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task
    await context.gate.write_uses()
    context.close()


def _answer_outages(app: FastAPI) -> None:
    """A database or a bucket that is away, or a full disk, is no mistake of the service: 503, try again."""

    async def away(_: Request, error: Exception) -> Response:
        log.error("storage is away", exc_info=error)
        return problems.answer(Problem("unavailable", "Its storage does not answer.", headers={"Retry-After": "5"}))

    async def no_room(request: Request, error: Exception) -> Response:
        # Where an upload is spooled.
        if isinstance(error, OSError) and error.errno in DISK_FULL:
            return await away(request, error)
        raise error

    for error in (*DATABASE_AWAY, *BLOBS_AWAY):
        app.add_exception_handler(error, away)
    app.add_exception_handler(OSError, no_room)
