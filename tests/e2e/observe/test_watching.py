"""What the service tells those who watch it: readiness, metrics, logs."""

import json
import subprocess
import sys
import time

import pytest
from prometheus_client.parser import text_string_to_metric_families

from service.store.counts.endings import STAGES
from tests.e2e.running import wait_for
from tests.homes import in_both_homes

# What a caller may not make longer, however hard they try.
LABELS_OF_CALLERS = ("method", "route", "status")


def families(service):
    answer = service.http.get("/metrics")
    assert answer.status_code == 200
    return {family.name: family for family in text_string_to_metric_families(answer.text)}


def figures(service):
    """Every sample: its name and its labels, and its value."""
    return {
        (sample.name, *sorted(sample.labels.items())): sample.value
        for family in families(service).values()
        for sample in family.samples
    }


def ended(service, **labels):
    labels = {"status": "", "verdict": "", "error": ""} | labels
    return figures(service)["esc_jobs_ended_total", *sorted(labels.items())]


def log(service):
    return [json.loads(line) for line in (service.data / "log").read_text().splitlines() if line.startswith("{")]


@in_both_homes
def test_the_ends_of_jobs_are_counted_once_whoever_computed_them(start):
    service = start("up").ready()
    for name, behaviour in (("good", "accept"), ("bad", "reject"), ("ugly", "crash"), ("black", "fail")):
        service.end(service.submit(service.venue(name, behaviour)).json()["id"])
    cancelled = service.submit(service.venue("slow", "hang")).json()["id"]
    service.http.post(f"/jobs/{cancelled}/cancel")
    again = start("serve").ready()
    for one in (service, again):
        assert ended(one, status="succeeded", verdict="accepted") == 1
        assert ended(one, status="succeeded", verdict="rejected") == 1
        assert ended(one, status="failed", error="job-crashed") == 1
        assert ended(one, status="failed", error="no-markings-in-view") == 1
        assert ended(one, status="cancelled") == 1
    # A restart forgets nothing.
    assert service.stop() == 0
    service.start()
    assert ended(service, status="succeeded", verdict="accepted") == 1


@in_both_homes
def test_how_long_jobs_took_is_a_histogram_of_all_workers(start):
    service = start("up").ready()
    for name in ("a", "b"):
        service.end(service.submit(service.venue(name)).json()["id"])
    found = figures(service)
    assert found["esc_job_stage_duration_seconds_count", ("stage", "decode")] == 2
    assert found["esc_job_stage_duration_seconds_sum", ("stage", "decode")] == pytest.approx(0.2)
    below = found["esc_job_stage_duration_seconds_bucket", ("le", "0.1"), ("stage", "decode")]
    assert (below, found["esc_job_wait_seconds_count",], found["esc_job_duration_seconds_count",]) == (2, 2, 2)
    assert found["esc_job_stitch_error_pixels_bucket", ("le", "0.2")] == 2
    assert {dict(key[1:])["stage"] for key in found if key[0] == "esc_job_stage_duration_seconds_count"} == set(STAGES)


@in_both_homes
def test_a_venue_has_the_stitch_error_of_the_poses_that_hold(start):
    service = start("up").ready()
    service.end(service.submit(service.venue("moved")).json()["id"])
    service.end(service.submit(service.venue("kept", "reject")).json()["id"])
    service.end(service.submit(service.venue("tried"), dry_run=True).json()["id"])
    found = figures(service)
    stitch = {
        dict(key[1:])["venue"]: value for key, value in found.items() if key[0] == "esc_venue_stitch_error_pixels"
    }
    assert stitch == {"moved": 0.2, "kept": 10.0, "tried": 10.0}
    accepted = found["esc_venue_accepted_timestamp_seconds", ("venue", "moved")]
    assert time.time() - 60 < accepted <= time.time() + 1
    assert ("esc_venue_accepted_timestamp_seconds", ("venue", "kept")) not in found
    assert found["esc_venue_moved_pixels", ("venue", "kept")] == 1.0
    service.http.delete("/venues/kept").raise_for_status()
    assert ("esc_venue_stitch_error_pixels", ("venue", "kept")) not in figures(service)


@in_both_homes
def test_of_many_venues_only_the_worst_have_figures_of_their_own(start):
    service = start("up", ESC_METRICS_VENUES="2").ready()
    for name, behaviour in (("a", "accept"), ("b", "reject"), ("c", "reject"), ("d", "accept")):
        service.end(service.submit(service.venue(name, behaviour)).json()["id"])
    shown = {dict(key[1:]).get("venue") for key in figures(service)} - {None}
    assert shown == {"b", "c"}


@in_both_homes
def test_the_queue_is_as_deep_and_as_old_as_it_is(start):
    service = start("serve")
    for number, priority in enumerate(("live", "routine", "routine")):
        service.submit(service.venue(f"v{number}"), priority=priority).raise_for_status()
    found = wait_for(
        lambda: (seen := figures(service))["esc_queue_oldest_age_seconds", ("priority", "live")] > 0.2 and seen
    )
    assert found["esc_queue_jobs", ("priority", "live")] == 1
    assert found["esc_queue_jobs", ("priority", "routine")] == 2
    assert (found["esc_jobs_running",], found["esc_workers",]) == (0, 0)


@in_both_homes
def test_each_worker_is_up_until_it_is_silent(start):
    service = start("serve", ESC_TAKEOVER_AFTER_S="3")
    workers = [
        subprocess.Popen([sys.executable, "-m", "service.cli", "worker", "--name", name], env=service.environment)
        for name in ("one", "two")
    ]
    try:
        found = wait_for(lambda: (seen := figures(service))["esc_workers",] == 2 and seen)
        for name in ("one", "two"):
            assert found["esc_worker_up", ("worker", name)] == 1
            assert 0 <= found["esc_worker_heartbeat_age_seconds", ("worker", name)] < 3
            (model,) = [dict(key[1:]) for key in found if key[0] == "esc_worker_model_info" and ("worker", name) in key]
            assert len(model["sha256"]) == 64
        workers[0].kill()
        wait_for(lambda: figures(service).get(("esc_worker_up", ("worker", "one"))) in (0, None))
        assert figures(service)["esc_worker_up", ("worker", "two")] == 1
    finally:
        for worker in workers:
            worker.kill()
            worker.wait()


def test_an_attempt_after_the_first_is_counted(start):
    service = start("up").ready()
    job = service.submit(service.venue("v", "kill-worker")).json()["id"]
    assert service.end(job)["attempt"] == 3
    found = figures(service)
    assert found["esc_job_restarts_total",] == 2
    assert ended(service, status="failed", error="job-abandoned") == 1


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


def test_a_held_answer_is_timed_apart(service, name):
    service.end(service.submit(service.venue(name)).json()["id"])
    routes = {dict(key[1:])["route"] for key in figures(service) if key[0] == "esc_http_request_duration_seconds_count"}
    assert "/jobs/{job_id}?wait" in routes


def test_units_and_suffixes_are_those_of_prometheus(service):
    for name, family in families(service).items():
        assert not name.endswith(("_ms", "_seconds_total", "_count", "_mb")), name
        assert family.documentation, name
        if family.type == "counter":
            assert all(sample.name.endswith(("_total", "_created")) for sample in family.samples), name
        else:
            assert not name.endswith("_total"), name


@in_both_homes
def test_without_its_database_the_service_still_says_so(start, home):
    # Otherwise it could not tell whether the caller may know.
    service = start("up", ESC_AUTH="off").ready()
    with home.database_away(service.data):
        assert figures(service)["esc_database_up",] == 0
        parts = wait_for(
            lambda: (seen := service.http.get("/readyz").json()["parts"])["database"].startswith("cannot") and seen
        )
        assert set(parts) == {"database", "blobs", "disk", "worker", "model"}
        assert service.http.get("/livez").status_code == 200
    wait_for(lambda: figures(service)["esc_database_up",] == 1)
    service.ready()


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


@in_both_homes
def test_the_worker_calls_a_job_what_its_request_was_called(start):
    service = start("up").ready()
    trace = "4bf92f3577b34da6a3ce929d0e0e4736"
    names = {"X-Request-ID": "night-run-7", "traceparent": f"00-{trace}-00f067aa0ba902b7-01"}
    job = service.submit(service.venue("v"), headers=names).json()["id"]
    service.end(job)
    lines = wait_for(
        lambda: (
            (of := [line for line in log(service) if line.get("job") == job])
            and {"job begins", "job ends"} <= {line["event"] for line in of}
            and of
        )
    )
    assert {(line["request"], line["trace"]) for line in lines} == {("night-run-7", trace)}
    (asked,) = [line for line in log(service) if line.get("method") == "POST" and "calibrate" in line["path"]]
    assert (asked["request"], asked["trace"], asked["status"]) == ("night-run-7", trace, 202)
