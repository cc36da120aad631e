"""Power cuts, killed processes and native crashes: a job that was accepted ends, once."""

import os
import signal
import time
from contextlib import ExitStack

import pytest

from service.serving import GRACE_S
from testbed.books import settle
from testbed.disks import filled
from testbed.homes import in_one_home_first, on_servers
from testbed.killing import (
    chance,
    kill_api,
    kill_kept_worker,
    moment,
    seconds_of_a_job,
    seconds_of_a_submission,
    submitted,
)
from testbed.running import Service, alive, computing, wait_for
from tests.e2e.observe.figures import figures

# Beyond the silence: until a worker looks, takes the job out of the queue and begins.
TAKING_OVER_S = 5
# What open requests get to end in, and after them the worker.
STOPPING_S = 2 * GRACE_S + 10


def poses(service, venue):
    return [camera["pose"]["position"][0] for camera in service.http.get(f"/venues/{venue}").json()["cameras"]]


def test_a_killed_worker_comes_back_and_its_job_ends_once(start):
    service = start().ready()
    with service.jobs_held("v"):
        job = service.submitted(service.venue("v"))
        service.running(job)
        worker = service.worker()
        os.kill(worker, signal.SIGKILL)
    ended = service.end(job)
    assert (ended["status"], ended["attempt"]) == ("succeeded", 2)
    # The first attempt died with its worker, and the pose moved by one step, not two.
    first, second = service.begun(job)
    assert not alive(first)
    # It says its last word before it ends.
    wait_for(lambda: not alive(second))
    assert poses(service, "v") == [-0.875, -0.875]
    assert service.worker() != worker


@in_one_home_first
def test_a_worker_on_another_machine_takes_over(start, worker_beside):
    silence_s = 3
    service = start("serve", ESC_TAKEOVER_AFTER_S=str(silence_s))
    workers = [worker_beside(service, f"worker-{number}") for number in (1, 2)]
    service.ready()
    with service.jobs_held("v"):
        job = service.submitted(service.venue("v"))
        service.running(job)
        ((doomed, process),) = ((worker, one) for worker in workers for one in computing(worker.pid))
        doomed.kill()
        killed = time.monotonic()
        wait_for(lambda: service.job(job)["attempt"] == 2)
        assert time.monotonic() - killed < silence_s + TAKING_OVER_S
    assert not alive(process)
    ended = service.end(job)
    assert (ended["status"], ended["attempt"]) == ("succeeded", 2)
    assert poses(service, "v") == [-0.875, -0.875]
    history = service.http.get("/venues/v/history").json()["revisions"]
    assert [revision["cause"] for revision in history] == ["calibrated", "put"]


@pytest.mark.long
@in_one_home_first
def test_a_worker_killed_at_any_moment_of_its_job_costs_it_an_attempt_and_nothing_else(start):
    service = start("up", ESC_TIDY_EVERY_S="0.5").ready()
    seconds = seconds_of_a_job(service, service.venue("alone", "accept 0.3"))
    ended, _ = kill_kept_worker(service, service.venue("v", "accept 0.3"), moment(chance(), seconds))
    assert ended["status"] == "succeeded"
    assert ended["attempt"] <= 2
    settle(service)


@in_one_home_first
def test_a_submission_killed_at_any_moment_is_one_job_or_none(start):
    service = start("up", ESC_TIDY_EVERY_S="0.5").ready()
    seconds = seconds_of_a_submission(service, service.venue("alone"))
    drawn = chance()
    promised = kill_api(service, service.venue("v"), "key", moment(drawn, seconds))
    job = submitted(service, "v", "key")
    assert promised in (None, job)
    assert service.end(job)["status"] == "succeeded"
    # This client does not come back.
    promised = kill_api(service, service.venue("w"), "key", moment(drawn, seconds))
    assert promised is None or service.end(promised)["status"] == "succeeded"
    settle(service)


@pytest.mark.long
def test_a_killed_service_leaves_no_process_and_goes_on_when_it_is_back(start):
    service = start(cold=True).ready()
    job = service.submitted(service.venue("v", "accept 2"))
    service.running(job)
    waiting = service.submitted(service.venue("w"))
    worker = service.worker()
    (computing,) = service.begun(job)
    service.kill()
    wait_for(lambda: not alive(worker) and not alive(computing))
    service.start()
    ended = service.end(job)
    assert (ended["status"], ended["attempt"]) == ("succeeded", 2)
    assert service.end(waiting)["status"] == "succeeded"
    assert poses(service, "v") == poses(service, "w") == [-0.875, -0.875]


def test_a_service_that_is_asked_to_stop_does_so_whoever_still_waits(start):
    service = start("up", ESC_DRAIN_S="1").ready()
    job = service.submitted(service.venue("v", "hang"))
    service.running(job)
    worker = service.worker()
    (computing,) = service.begun(job)
    with service.http.stream("GET", f"/jobs/{job}/events") as events:
        lines = events.iter_lines()
        assert next(lines) == "event: progress"
        begun = time.monotonic()
        assert service.stop() == 0
        assert time.monotonic() - begun < STOPPING_S
    wait_for(lambda: not alive(worker) and not alive(computing))


def test_a_crash_of_the_computation_costs_one_job(service, name):
    worker = service.worker()
    crashed = service.calibrated(service.venue(f"{name}-bad", "crash"))
    assert (crashed["status"], crashed["error"]["type"]) == ("failed", "/problems/job-crashed")
    assert "SIGSEGV" in crashed["error"]["detail"]
    assert service.calibrated(service.venue(name, "chatter"))["status"] == "succeeded"
    assert service.worker() == worker


def test_a_program_and_a_network_that_are_not_there_are_told(start):
    service = start("up", ESC_JOB_PROGRAM='["/nonexistent/program"]', ESC_MODEL="/nowhere/unet.onnx")
    job = service.calibrated(service.venue("v"))
    assert (job["status"], job["attempt"], job["error"]["type"]) == ("failed", 1, "/problems/job-crashed")
    assert "No such file or directory: '/nonexistent/program'" in job["error"]["detail"]
    wait_for(lambda: service.http.get("/readyz").json()["parts"]["model"].startswith("missing at"))


@in_one_home_first
def test_while_the_database_is_away_the_service_says_so_and_a_job_goes_on(start, home):
    # Without a key to look up: otherwise it could not tell whether the caller may know.
    service = start("up", ESC_AUTH="off").ready()
    with ExitStack() as away:
        with service.jobs_held("v"):
            job = service.submitted(service.venue("v"))
            service.running(job)
            (computing,) = service.begun(job)
            away.enter_context(home.database_away(service.data))
        wait_for(lambda: not alive(computing))
        wait_for(lambda: "the database is away, trying again" in (service.data / "log").read_text())
        assert service.http.get(f"/jobs/{job}").status_code == 503
        assert figures(service)["esc_database_up",] == 0
        parts = wait_for(
            lambda: (seen := service.http.get("/readyz").json()["parts"])["database"].startswith("cannot") and seen
        )
        assert set(parts) == {"database", "blobs", "disk", "worker", "model"}
        assert service.http.get("/livez").status_code == 200
    ended = service.end(job)
    assert (ended["status"], ended["attempt"]) == ("succeeded", 1)
    assert poses(service, "v") == [-0.875, -0.875]
    assert figures(service)["esc_database_up",] == 1
    # The queue has come back too.
    assert service.calibrated("v", 1)["status"] == "succeeded"
    service.ready()


@pytest.mark.long
@on_servers
def test_a_long_absence_of_the_database_is_no_workers_death(start, home, worker_beside):
    silence_s = 3
    service = start("up", ESC_TAKEOVER_AFTER_S=str(silence_s)).ready()
    worker_beside(service, "other")
    wait_for(lambda: '"other"' in (service.data / "log").read_text())
    job = service.submitted(service.venue("v", "accept 7"))
    service.running(job)
    with home.database_away(service.data):
        time.sleep(silence_s + 2)
    ended = service.end(job)
    assert (ended["status"], ended["attempt"]) == ("succeeded", 1)


def test_a_job_that_kills_its_worker_is_given_up_after_three_attempts(start):
    service = start().ready()
    job = service.calibrated(service.venue("v", "kill-worker"))
    assert (job["status"], job["attempt"]) == ("failed", 3)
    assert job["error"]["type"] == "/problems/job-abandoned"
    assert "begun 3 times" in job["error"]["detail"]
    service.ready()
    assert service.calibrated(service.venue("w"))["status"] == "succeeded"


@on_servers
def test_a_silent_bucket_refuses_uploads_and_ends_no_job(service, home, name):
    job = service.submitted(service.venue("beside-a-silent-bucket", "accept 1"))
    service.venue(name)
    service.running(job)
    with home.bucket_away():
        answer = service.submit(name)
        assert (answer.status_code, answer.json().get("type")) == (503, "/problems/unavailable"), answer.text
    ended = service.end(job)
    assert (ended["status"], ended["attempt"]) == ("succeeded", 1)
    assert service.calibrated(name)["status"] == "succeeded"


def test_a_disk_without_a_byte_left_stops_nobody_for_longer_than_that(small_disk):
    service = Service(small_disk / "esc", ESC_MIN_FREE_MB="0").ready()
    worker = service.worker()
    service.venue("v")
    service.venue("w")
    with ExitStack() as full:
        with service.jobs_held("v"):
            job = service.submitted("v")
            service.running(job)
            full.enter_context(filled(small_disk))
        # No room for a sign of life either.
        wait_for(lambda: service.http.get("/readyz").json()["parts"]["worker"] != "ok")
        answer = service.submit("w")
        assert (answer.status_code, answer.json().get("type")) == (503, "/problems/unavailable"), answer.text
    ended = service.end(job)
    # Its poses were found, its pictures found no room.
    assert ended["status"] == "succeeded"
    assert "pictures cannot be stored" in ended["result"]["warnings"][0]
    assert poses(service, "v") == [-0.875, -0.875]
    service.ready()
    assert service.calibrated("w")["status"] == "succeeded"
    assert service.worker() == worker
    service.kill()
