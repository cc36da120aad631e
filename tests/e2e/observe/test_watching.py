"""Readiness, metrics and logs of a running service."""

import json

import pytest

from testbed.homes import in_both_homes
from testbed.running import wait_for
from tests.e2e.observe.figures import families, figures

# What a caller may not make longer, however hard they try.
LABELS_OF_CALLERS = ("method", "route", "status")


def log(service):
    return [json.loads(line) for line in (service.data / "log").read_text().splitlines() if line.startswith("{")]


def test_what_a_worker_did_is_told_by_the_api(service, name):
    before = figures(service)
    service.calibrated(service.venue(name))
    found = figures(service)
    accepted = ("error", ""), ("status", "succeeded"), ("verdict", "accepted")
    assert found["esc_jobs_ended_total", *accepted] == before["esc_jobs_ended_total", *accepted] + 1
    assert found["esc_venue_stitch_error_pixels", ("venue", name)] == 0.2
    (worker,) = [dict(key[1:]) for key in found if key[0] == "esc_worker_model_info"]
    assert found["esc_worker_up", ("worker", worker["worker"])] == 1
    assert len(worker["sha256"]) == 64
    # A held answer is timed apart: the end of the job was waited for.
    routes = {dict(key[1:])["route"] for key in found if key[0] == "esc_http_request_duration_seconds_count"}
    assert "/jobs/{job_id}?wait" in routes


def test_what_callers_send_makes_no_new_series(service):
    def series():
        return {key for key in figures(service) if key[0].startswith("esc_http")}

    def odd(number):
        service.http.request(f"ODD{number}", "/livez")
        service.http.request(f"ODD{number}", f"/nowhere/{number}")
        service.http.get(f"/venues/v{number}")
        service.http.get("/livez", params={f"p{number}": "x"})

    odd(0)
    figures(service)
    before = series()
    for number in range(1, 20):
        odd(number)
    assert series() == before
    assert all({name for name, _ in key[1:]} <= {*LABELS_OF_CALLERS, "le"} for key in before)


def test_units_and_suffixes_are_those_of_prometheus(service):
    for name, family in families(service).items():
        assert not name.endswith(("_ms", "_seconds_total", "_count", "_mb")), name
        assert family.documentation, name
        if family.type == "counter":
            assert all(sample.name.endswith(("_total", "_created")) for sample in family.samples), name
        else:
            assert not name.endswith("_total"), name


@in_both_homes
def test_every_part_that_a_job_needs_is_named(service):
    answer = service.http.get("/readyz")
    parts = answer.json()["parts"]
    assert (answer.status_code, answer.json()["status"]) == (200, "ok")
    assert {name: parts[name] for name in ("database", "blobs", "disk", "worker")} == dict.fromkeys(
        ("database", "blobs", "disk", "worker"), "ok"
    )
    assert len(parts["model"]) == len("ok: ") + 64


def test_what_a_request_is_called_stays(service):
    named = service.http.get("/livez", headers={"X-Request-ID": "camera-van-3"})
    assert named.headers["x-request-id"] == "camera-van-3"
    odd = service.http.get("/livez", headers={"X-Request-ID": 'a"b\tc'}).headers["x-request-id"]
    assert len(odd) == 32
    trace = "4bf92f3577b34da6a3ce929d0e0e4736"
    traced = service.http.get("/livez", headers={"traceparent": f"00-{trace}-00f067aa0ba902b7-01"})
    assert traced.headers["x-request-id"] == trace
    invalid = service.http.get("/livez", headers={"traceparent": f"00-{'0' * 32}-00f067aa0ba902b7-01"})
    assert invalid.headers["x-request-id"] != "0" * 32


def test_the_worker_calls_a_job_what_its_request_was_called(service, name):
    trace = "4bf92f3577b34da6a3ce929d0e0e4736"
    names = {"X-Request-ID": "night-run-7", "traceparent": f"00-{trace}-00f067aa0ba902b7-01"}
    job = service.submitted(service.venue(name), headers=names)
    service.end(job)
    lines = wait_for(
        lambda: (
            (of := [line for line in log(service) if line.get("job") == job])
            and {"job begins", "job ends"} <= {line["event"] for line in of}
            and of
        )
    )
    assert {(line["request"], line["trace"]) for line in lines} == {("night-run-7", trace)}
    (end,) = [line for line in lines if line["event"] == "job ends"]
    assert [end.get(part) for part in ("verdict", "why", "cameras")] == ["accepted", None, None]
    assert {line["venue"] for line in lines} == {name}
    (asked,) = [line for line in log(service) if line.get("path") == f"/venues/{name}/calibrate"]
    assert (asked["request"], asked["trace"], asked["status"]) == ("night-run-7", trace, 202)


@pytest.mark.parametrize(
    ("behaviour", "outcome"),
    [
        ("reject", {"verdict": "rejected", "why": "the lines do not fit", "cameras": ["left", "right"]}),
        ("partly", {"verdict": "partly", "why": "the lines do not fit", "cameras": ["right"]}),
        ("fail", {"verdict": "no-markings-in-view", "why": "It is black.", "cameras": ["left"]}),
    ],
)
def test_the_end_of_a_job_is_logged_with_its_venue_and_why(service, name, behaviour, outcome):
    job = service.calibrated(service.venue(name, behaviour))["id"]
    of = {"event": "job ends", "job": job}
    line = wait_for(lambda: next((line for line in log(service) if of.items() <= line.items()), None))
    assert {"venue": line["venue"], "kind": line["kind"]} == {"venue": name, "kind": "calibration"}
    assert {part: line.get(part) for part in outcome} == outcome
