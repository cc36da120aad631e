"""Health, readiness and metrics of the service, and the meaning of its problems."""

from typing import Annotated

from fastapi import APIRouter, Path, Response
from prometheus_client import generate_latest
from prometheus_client.exposition import CONTENT_TYPE_PLAIN_0_0_4
from starlette.concurrency import run_in_threadpool

from service.api.context import InContext
from service.observability.readiness import DECIDES
from service.routes.contract.documented import FOR_ALL, needs_scope
from service.routes.contract.guarded import Guarded
from service.routes.contract.problem_docs import problem_responses
from service.schemas.health import Health
from service.schemas.names import problem_uri, refusal_uri
from service.schemas.problems import PROBLEM_TYPES, REFUSAL_REASONS, REFUSALS_DOCUMENT, Problem

# The same addresses are pages for browsers.
OF_PROGRAMS = {"Vary": "Accept"}
router = APIRouter(tags=["health"], route_class=Guarded)


@router.get("/livez", openapi_extra=FOR_ALL)
async def check_liveness() -> Health:
    """Answer while the process is alive."""
    return Health(status="ok")


@router.get("/readyz", openapi_extra=FOR_ALL, responses={503: {"model": Health}})
async def check_readiness(context: InContext, response: Response) -> Health:
    """Tell whether this process can answer: its database does. `warnings` has what else a job needs and is missing.

    That is told within 3 s, whatever hangs.
    """
    parts = await context.readiness.look()
    ready = parts[DECIDES].ok
    response.status_code = 200 if ready else 503
    return Health(
        status="ok" if ready else "unavailable",
        parts={name: part.says for name, part in parts.items()},
        warnings={name: part.says for name, part in parts.items() if not part.ok and name != DECIDES},
    )


@router.get(
    "/metrics",
    openapi_extra=needs_scope("read"),
    response_class=Response,
    responses={200: {"content": {"text/plain": {}}}},
)
async def get_metrics(context: InContext) -> Response:
    """Return the figures of the service for Prometheus."""
    for name, part in (await context.readiness.look()).items():
        context.metrics.parts.labels(name).set(part.ok)
    figures = await run_in_threadpool(generate_latest, context.metrics.registry)
    return Response(figures, media_type=CONTENT_TYPE_PLAIN_0_0_4)


@router.get("/problems/{kind}", openapi_extra=FOR_ALL, responses=problem_responses("not-found"))
async def explain_problem(
    kind: Annotated[str, Path(max_length=64, description="Last part of the `type`.")], response: Response
) -> dict[str, str | int]:
    """Return title and status of a type of problem; browsers (`Accept: text/html`) get a page with advice."""
    response.headers.update(OF_PROGRAMS)
    if kind not in PROBLEM_TYPES:
        raise Problem("not-found", f"The kinds of problems are {', '.join(PROBLEM_TYPES)}.")
    return {"type": problem_uri(kind), "title": PROBLEM_TYPES[kind].title, "status": PROBLEM_TYPES[kind].status}


@router.get("/refusals/{reason}", openapi_extra=FOR_ALL, responses=problem_responses("not-found"))
async def explain_refusal(
    reason: Annotated[str, Path(max_length=64, description="Last part of the `refusal`.")], response: Response
) -> dict[str, str]:
    """Explain what the `refusal` of a camera means: what it looks like, and what to do. Browsers get a page."""
    response.headers.update(OF_PROGRAMS)
    if reason not in REFUSAL_REASONS:
        raise Problem("not-found", f"The reasons of refusals are {', '.join(REFUSAL_REASONS)}.")
    known = REFUSAL_REASONS[reason]
    return {
        "refusal": refusal_uri(reason),
        "title": known.title,
        "looks_like": known.looks_like,
        "do": known.do,
        "document": f"{REFUSALS_DOCUMENT}#{known.anchor}",
    }
