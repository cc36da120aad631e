"""HTTP application: checks, stores, queues and answers. It computes nothing."""

import asyncio
import errno
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager, suppress
from functools import cache
from importlib.metadata import version

import structlog
from fastapi import APIRouter, FastAPI, Request
from starlette.responses import Response
from starlette.routing import BaseRoute

from service.api import problems
from service.api.body_limit import BodyLimit
from service.api.context import Context
from service.api.http_defaults import HttpDefaults
from service.api.request_log import RequestLog, is_quiet
from service.api.root_path import RootPath
from service.pages import FOR_BROWSERS, show_browsers_what_is_missing
from service.pages import ROUTERS as PAGES
from service.routes import docs, event_streams, health, jobs, keys, live, pictures, plan, snapshot, stitch, venues
from service.routes.contract import document
from service.routes.contract.introduction import DESCRIPTION, TAGS
from service.routes.contract.problem_docs import OF_ANY_ROUTE
from service.routes.submissions import check, find, frames, intrinsics, locate, resubmit
from service.schemas.problems import Problem
from service.settings import Settings
from service.store.blobs import BLOB_OUTAGES
from service.store.database import DATABASE_OUTAGES, outage_reason

DISK_FULL = (errno.ENOSPC, errno.EDQUOT)
log = structlog.get_logger()


def create_app(settings: Settings) -> FastAPI:
    """Return the application, after the schema of the database was brought up to date."""
    context = Context(settings)
    app = document.DocumentedApp(
        title="ESC",
        summary="Keeps fixed multi-camera installations on sports fields calibrated.",
        description=DESCRIPTION,
        openapi_tags=TAGS,
        servers=[{"url": settings.root_path or "/"}],
        contact={"name": "The ESC maintainers"},
        license_info={"name": "Apache License 2.0", "identifier": "Apache-2.0"},
        version=version("esc-calibration"),
        lifespan=_lifespan,
        # FastAPI's own pages load their scripts from the internet.
        docs_url=None,
        redoc_url=None,
        # Spans, if tracing.configure() found out where to send them; figures and logs have ways of their own.
        telemetry={"metrics": False, "logs": False, "exclude": is_quiet},
    )
    app.state.context = context
    app.add_middleware(BodyLimit, largest_form=int(settings.max_body_mb * 1e6))
    app.add_middleware(RequestLog, metrics=context.metrics)
    app.add_middleware(HttpDefaults)
    app.add_middleware(RootPath, root_path=settings.root_path)
    document.document_webhooks(app)
    problems.install_handlers(app)
    show_browsers_what_is_missing(app)
    _answer_outages(app)
    app.router.routes.extend(all_routes())
    return app


@cache
def all_routes() -> Sequence[BaseRoute]:
    """Return all routes, put together once for all applications of a process: a tenth of a second of work."""
    # Generated clients call their functions by the id.
    router = APIRouter(responses=OF_ANY_ROUTE, generate_unique_id_function=lambda route: route.name)
    router.include_router(FOR_BROWSERS)
    for routes in (
        venues,
        event_streams,
        live,
        snapshot,
        stitch,
        frames,
        intrinsics,
        locate,
        find,
        plan,
        check,
        jobs,
        resubmit,
        pictures,
        keys,
        health,
        docs,
    ):
        router.include_router(routes.router)
    for pages in PAGES:
        router.include_router(pages)
    return router.routes


@asynccontextmanager
async def _lifespan(app: FastAPI) -> AsyncIterator[None]:
    context: Context = app.state.context
    duties = (context.job_watch.run, context.venue_watch.run, context.live_watch.run, context.authenticator.run)
    tasks = [asyncio.create_task(duty()) for duty in duties]
    yield
    for task in tasks:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task
    await context.authenticator.write_uses()
    context.close()


def _answer_outages(app: FastAPI) -> None:
    """Answer 503 while the database or the blob store is unavailable, or the disk is full."""

    async def unavailable(_: Request, error: Exception) -> Response:
        log.error("storage unavailable", exc_info=error)
        return problems.problem_response(Problem("unavailable", outage_reason(error), headers={"Retry-After": "5"}))

    async def no_room(request: Request, error: Exception) -> Response:
        # The file system on which an upload is spooled is full.
        if isinstance(error, OSError) and error.errno in DISK_FULL:
            return await unavailable(request, error)
        raise error

    for error in (*DATABASE_OUTAGES, *BLOB_OUTAGES):
        app.add_exception_handler(error, unavailable)
    app.add_exception_handler(OSError, no_room)
