"""Traces: a span per request, per job and per stage, sent to the endpoint of OpenTelemetry's environment variables.

Without `OTEL_EXPORTER_OTLP_ENDPOINT`, or without the extra `tracing`, nothing is recorded and only OpenTelemetry's API
is loaded, which FastAPI brings. The context of a caller's trace (W3C Trace Context, `traceparent`) is passed to the job
in any case.
"""

import os
import re
import sys

import structlog
from opentelemetry import trace
from opentelemetry.context import Context
from opentelemetry.trace.propagation.tracecontext import TraceContextTextMapPropagator

from service import build

# Version 00, the only one.
TRACEPARENT = re.compile(r"00-(?!0{32})([0-9a-f]{32})-(?!0{16})[0-9a-f]{16}-[0-9a-f]{2}")
ENDPOINTS = ("OTEL_EXPORTER_OTLP_ENDPOINT", "OTEL_EXPORTER_OTLP_TRACES_ENDPOINT")
# Time to send the remaining spans when a process ends.
FLUSH_S = 2.0
log = structlog.get_logger()


def configure(service: str, instance: str) -> None:
    """Send spans of this process if an endpoint is configured."""
    if not any(os.environ.get(name) for name in ENDPOINTS) or os.environ.get("OTEL_SDK_DISABLED", "").lower() == "true":
        return
    try:
        from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
        from opentelemetry.sdk.resources import Resource
        from opentelemetry.sdk.trace import TracerProvider
        from opentelemetry.sdk.trace.export import BatchSpanProcessor
    except ImportError:
        log.warning(
            "no traces: OpenTelemetry is configured but not installed",
            install=build.install_command("tracing", sys.executable),
        )
        return

    names = {
        "service.name": os.environ.get("OTEL_SERVICE_NAME", service),
        "service.version": build.version(),
        "service.instance.id": instance,
    }
    provider = TracerProvider(resource=Resource.create(names))
    provider.add_span_processor(BatchSpanProcessor(OTLPSpanExporter()))
    trace.set_tracer_provider(provider)


def flush() -> None:
    """Send the remaining spans, in a process that is about to exit."""
    provider = trace.get_tracer_provider()
    if hasattr(provider, "force_flush"):
        provider.force_flush(int(FLUSH_S * 1000))


def trace_id_in(traceparent: str | None) -> str | None:
    """Return the trace id in a `traceparent`; None if it is invalid."""
    found = TRACEPARENT.fullmatch(traceparent or "")
    return found[1] if found else None


def current_traceparent() -> str | None:
    """Return the `traceparent` of the current span; None if none is recorded."""
    carrier: dict[str, str] = {}
    TraceContextTextMapPropagator().inject(carrier)
    return carrier.get("traceparent")


def context_of(traceparent: str | None) -> Context:
    """Return the context of a `traceparent`, as the parent of a new span."""
    carrier = {} if traceparent is None else {"traceparent": traceparent}
    return TraceContextTextMapPropagator().extract(carrier, context=Context())
