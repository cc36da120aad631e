"""Id, log line and metrics of every request."""

import re
import time
import uuid

import structlog
from starlette.datastructures import Headers, MutableHeaders, QueryParams
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from service.observability.metrics import Metrics
from service.observability.tracing import current_traceparent, trace_id_in
from service.schemas.addresses import ip_of
from service.store.jobs.task import Origin

REQUEST_ID = re.compile(r"[A-Za-z0-9._-]{1,64}")
QUIET = {"/livez", "/readyz", "/metrics"}
LIVE_REPORT = re.compile(r"/venues/[^/]+/live")
# Others are counted as `other`: a caller may call a method what they like. HEAD arrives as GET.
METHODS = {"GET", "POST", "PUT", "DELETE", "PATCH", "OPTIONS"}
log = structlog.get_logger()


class RequestLog:
    """ASGI middleware that names requests: by the caller's X-Request-ID if it is harmless, or by the id of their trace.

    Routes find it, for what goes on after the answer, as `request.state.origin`.
    """

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self._app = app
        self._metrics = metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        name, traceparent = _names(Headers(scope=scope))
        origin = Origin(name, traceparent, address=_address(scope))
        scope.setdefault("state", {})["origin"] = origin
        status, begun = 500, time.perf_counter()

        async def answer(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                MutableHeaders(scope=message)["X-Request-ID"] = name
            await send(message)

        with structlog.contextvars.bound_contextvars(**origin.names()):
            try:
                await self._app(scope, receive, answer)
            finally:
                self._record(scope, origin, status, time.perf_counter() - begun)

    def _record(self, scope: Scope, origin: Origin, status: int, seconds: float) -> None:
        # The template of the route, not the path: a metric per job would grow without end, and so would one per method.
        route = getattr(scope.get("route"), "path", "none")
        method = scope["method"] if scope["method"] in METHODS else "other"
        self._metrics.requests.labels(method, route, status).inc()
        # An answer that waits for a job's end would hide how fast the others are.
        suffix = "?wait" if route == "/jobs/{job_id}" and "wait" in QueryParams(scope["query_string"]) else ""
        self._metrics.seconds.labels(method, route + suffix).observe(seconds)
        say = log.debug if is_quiet(scope) else log.info
        asked = {"method": scope["method"], "path": scope["path"], "address": origin.address}
        say("request", **asked, status=status, seconds=round(seconds, 4))


def is_quiet(scope: Scope) -> bool:
    """True for requests that machines make every few seconds, which are worth neither a log line nor a span."""
    path: str = scope.get("path", "")
    return path in QUIET or (scope.get("method") == "PUT" and LIVE_REPORT.fullmatch(path) is not None)


def _address(scope: Scope) -> str | None:
    """Return the client's address, as a trusted proxy names it; None if it has none, as on a Unix socket."""
    client = scope.get("client")
    address = ip_of(client[0]) if client else None
    # Without the interface that a link-local address may name: it says nothing about the client.
    return None if address is None else str(address).partition("%")[0]


def _names(headers: Headers) -> tuple[str, str | None]:
    """Return the id of a request, from its caller or their trace, and its place in a trace (`traceparent`)."""
    given = headers.get("traceparent")
    traceparent = current_traceparent() or (given if trace_id_in(given) else None)
    name = headers.get("x-request-id", "")
    if not REQUEST_ID.fullmatch(name):
        name = trace_id_in(traceparent) or uuid.uuid4().hex
    return name, traceparent
