"""Is it alive, is it ready, how is it doing, and what do its problems mean."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Path, Response
from prometheus_client import generate_latest
from prometheus_client.exposition import CONTENT_TYPE_PLAIN_0_0_4

from service.api.context import InContext
from service.routes.contract.documented import FOR_ALL, needs, problems
from service.routes.contract.guarded import Guarded
from service.wire.health import Health
from service.wire.problems import DOCUMENT, KINDS, REASONS, Problem, refusal_of, type_of

router = APIRouter(tags=["health"], route_class=Guarded)


@router.get("/livez", openapi_extra=FOR_ALL)
async def livez() -> Health:
    """The process answers."""
    return Health(status="ok")


@router.get("/readyz", openapi_extra=FOR_ALL, responses={503: {"model": Health}})
async def readyz(context: InContext, response: Response) -> Health:
    """All that a job needs is there: database, files, room, a worker that gives signs of life, its network."""
    parts = await context.readiness.look()
    ready = all(part.ok for part in parts.values())
    response.status_code = 200 if ready else 503
    return Health(status="ok" if ready else "unavailable", parts={name: part.says for name, part in parts.items()})


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


@router.get("/refusals/{reason}", openapi_extra=FOR_ALL, responses=problems(404))
async def explain_refusal(reason: Annotated[str, Path(max_length=64)]) -> dict[str, str]:
    """What the `refusal` of a camera means: what it looks like, and what to do."""
    if reason not in REASONS:
        raise Problem("not-found", f"The reasons of refusals are {', '.join(REASONS)}.")
    known = REASONS[reason]
    return {
        "refusal": refusal_of(reason),
        "title": known.title,
        "looks_like": known.looks_like,
        "do": known.do,
        "document": f"{DOCUMENT}#{known.anchor}",
    }
