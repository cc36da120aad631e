"""Traces, as a collector gets them: OTLP over HTTP, from real processes."""

import gzip
import subprocess
import sys
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from itertools import pairwise

import pytest
from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest

from testbed.running import Service, wait_for

TRACE = "4bf92f3577b34da6a3ce929d0e0e4736"
PARENT = "00f067aa0ba902b7"
# Nothing of what sends spans.
LIGHT = """
import sys
import service.app, service.serving, worker.supervisor
from service.observability import tracing
tracing.configure("esc", "here")
tracing.flush()
loaded = [name for name in sys.modules if name.startswith(("opentelemetry.sdk", "opentelemetry.exporter"))]
assert loaded == [], loaded
"""
WITHOUT_THE_EXTRA = """
import sys
from importlib.abc import MetaPathFinder
class Hidden(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.startswith(("opentelemetry.sdk", "opentelemetry.exporter")):
            raise ModuleNotFoundError(name)
sys.meta_path.insert(0, Hidden())
"""


class Collector:
    """An OpenTelemetry collector that keeps spans in memory."""

    def __init__(self):
        self.spans = []
        collected = self.spans

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self):
                body = self.rfile.read(int(self.headers["Content-Length"]))
                if self.headers.get("Content-Encoding") == "gzip":
                    body = gzip.decompress(body)
                for resource in ExportTraceServiceRequest.FromString(body).resource_spans:
                    names = {a.key: a.value.string_value for a in resource.resource.attributes}
                    collected.extend(
                        (names["service.name"], span) for scope in resource.scope_spans for span in scope.spans
                    )
                self.send_response(200)
                self.send_header("Content-Length", "0")
                self.end_headers()

            def log_message(self, *_):
                pass

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.server.server_port}"
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def of(self, service):
        return [span for name, span in list(self.spans) if name == service]


@pytest.fixture(scope="module")
def traced(tmp_path_factory):
    """Spans of a service that ran a job for a caller with a trace, and a job that crashed.

    Yields a function from the name of a service to its spans, and the first job.
    """
    collector = Collector()
    sent = {"OTEL_EXPORTER_OTLP_ENDPOINT": collector.url, "OTEL_BSP_SCHEDULE_DELAY": "100"}
    service = Service(tmp_path_factory.mktemp("traced"), **sent).ready()
    job = service.submitted(service.venue("v"), headers={"traceparent": f"00-{TRACE}-{PARENT}-01"})
    service.end(job)
    service.calibrated(service.venue("w", "crash"))
    assert service.stop() == 0
    wait_for(lambda: len([span for span in collector.of("esc-worker") if span.name == "job"]) == 2)
    yield collector.of, job
    collector.server.shutdown()
    collector.server.server_close()


def attributes(span):
    return {a.key: a.value.string_value or a.value.int_value for a in span.attributes}


def test_a_trace_goes_from_the_caller_through_the_request_to_the_stages_of_the_job(traced):
    spans_of, job = traced
    ours = [span for span in spans_of("esc-worker") if span.trace_id.hex() == TRACE]
    (request,) = [
        span for span in spans_of("esc-api") if span.trace_id.hex() == TRACE and span.parent_span_id.hex() == PARENT
    ]
    assert request.name == "POST /venues/{venue_id}/calibrate"
    (whole,) = [span for span in ours if span.name == "job"]
    assert whole.parent_span_id == request.span_id
    assert attributes(whole) == {
        "esc.job": job,
        "esc.kind": "calibration",
        "esc.venue": "v",
        "esc.attempt": 1,
        "esc.outcome": "accepted",
    }
    stages = sorted(
        (span for span in ours if span.parent_span_id == whole.span_id), key=lambda s: s.start_time_unix_nano
    )
    assert [span.name for span in stages] == ["start", "segmentation"]
    for before, after in pairwise(stages):
        assert before.end_time_unix_nano <= after.start_time_unix_nano
    assert whole.start_time_unix_nano <= stages[0].start_time_unix_nano
    assert stages[-1].end_time_unix_nano <= whole.end_time_unix_nano
    # Looks of machines are no spans.
    assert not {"GET /readyz", "GET /metrics", "GET /livez"} & {span.name for span in spans_of("esc-api")}


def test_a_job_that_fails_is_a_span_that_failed(traced):
    spans_of, _ = traced
    (whole,) = [span for span in spans_of("esc-worker") if span.name == "job" and attributes(span)["esc.venue"] == "w"]
    assert (whole.status.code, attributes(whole)["error.type"]) == (2, "/problems/job-crashed")


@pytest.mark.long
def test_a_collector_that_is_away_holds_nothing_up(start):
    away = {"OTEL_EXPORTER_OTLP_ENDPOINT": "http://127.0.0.1:9", "OTEL_EXPORTER_OTLP_TIMEOUT": "1"}
    service = start("up", OTEL_BSP_SCHEDULE_DELAY="100", **away).ready()
    assert service.calibrated(service.venue("v"))["status"] == "succeeded"
    assert service.stop() == 0


def python(program, **environment):
    return subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, env={"PATH": "/usr/bin"} | environment
    )


@pytest.mark.long
def test_without_an_endpoint_nothing_that_sends_is_loaded():
    light = python(LIGHT)
    assert light.returncode == 0, light.stderr


@pytest.mark.long
def test_with_an_endpoint_and_without_the_extra_a_line_says_what_is_missing():
    without = python(WITHOUT_THE_EXTRA + LIGHT, OTEL_EXPORTER_OTLP_ENDPOINT="http://127.0.0.1:9")
    assert without.returncode == 0, without.stderr
    assert "no traces: OpenTelemetry is configured but not installed" in without.stdout + without.stderr
    assert "-m pip install 'opentelemetry-sdk" in without.stdout + without.stderr
