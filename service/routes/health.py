"""Is it alive, is it ready, how is it doing, and what do its problems mean."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Response
from prometheus_client import generate_latest
from prometheus_client.exposition import CONTENT_TYPE_PLAIN_0_0_4

from service.context import Context, InContext
from service.problems import KINDS, Problem, type_of
from service.routes.documented import FOR_ALL, needs, problems
from service.routes.guarded import Guarded
from service.schemas import Health

router = APIRouter(tags=["health"], route_class=Guarded)


@router.get("/livez", openapi_extra=FOR_ALL)
async def livez() -> Health:
    """The process answers."""
    return Health(status="ok")


@router.get("/readyz", openapi_extra=FOR_ALL, responses={503: {"model": Health}})
def readyz(context: InContext, response: Response) -> Health:
    """All that a job needs is there: database, files, room, a worker that gives signs of life, its network."""
    parts = {"database": _database(context), "blobs": _blobs(context), "disk": _disk(context), **_worker(context)}
    ready = all(found == "ok" for found in parts.values())
    response.status_code = 200 if ready else 503
    return Health(status="ok" if ready else "unavailable", parts=parts)


@router.get(
    "/metrics",
    openapi_extra=needs("read"),
    response_class=Response,
    responses={200: {"content": {"text/plain": {}}}},
)
def metrics(context: InContext) -> Response:
    """For Prometheus."""
    return Response(generate_latest(context.metrics.registry), media_type=CONTENT_TYPE_PLAIN_0_0_4)


@router.get("/problems/{kind}", openapi_extra=FOR_ALL, responses=problems(404))
async def explain(kind: Annotated[str, Path(max_length=64)]) -> dict[str, str | int]:
    """What the `type` of a problem means."""
    if kind not in KINDS:
        raise Problem("not-found", f"The kinds of problems are {', '.join(KINDS)}.")
    return {"type": type_of(kind), "title": KINDS[kind].title, "status": KINDS[kind].status}


def _database(context: Context) -> str:
    try:
        context.jobs.counts()
    except Exception as error:  # whatever the driver says
        return f"cannot be read: {type(error).__name__}"
    return "ok"


def _blobs(context: Context) -> str:
    try:
        context.blobs.check()
    except Exception as error:  # whatever the store says
        return f"cannot be reached: {type(error).__name__}"
    return "ok"


def _disk(context: Context) -> str:
    try:
        free = context.disk.free_bytes()
    except OSError as error:
        return f"cannot be read: {type(error).__name__}"
    if free is None or free >= context.disk.least_bytes:
        return "ok"
    return f"{free / 1e6:.0f} MB free, {context.disk.least_bytes / 1e6:.0f} needed: uploads are refused"


def _worker(context: Context) -> dict[str, str]:
    try:
        alive = context.workers.alive(context.settings.takeover_after_s)
    except Exception:  # the database is already named above
        alive = []
    if not alive:
        return {"worker": "none gave a sign of life"}
    missing = [worker.name for worker in alive if worker.model_sha256 is None]
    model = f"missing at {', '.join(missing)}" if missing else "ok"
    return {"worker": "ok", "model": model}
