"""A worker that is asked to stop, and two that have one name."""

import socket
import time

import pytest

from service.queue import BEGINS_AGAIN
from service.store.database import connect
from service.store.workers import WorkerRepository
from testbed.homes import in_one_home_first
from testbed.running import alive, wait_for
from tests.e2e.commands import esc_process
from tests.e2e.observe.figures import figures
from tests.e2e.worker.test_crashes import poses

# Far below ESC_DRAIN_S as it is unless set, far above what a process needs to end.
AT_ONCE_S = 15


@in_one_home_first
def test_a_worker_that_is_stopped_lets_its_job_end_and_takes_no_other(start, worker_beside):
    service = start("serve")
    worker = worker_beside(service, "w")
    with service.jobs_held("v"):
        running = service.submitted(service.venue("v"))
        service.running(running)
        waiting = service.submitted(service.venue("w"))
        worker.terminate()
        wait_for(lambda: "worker stops" in (service.data / "log").read_text())
    assert worker.wait(60) == 0
    ended = service.job(running)
    assert (ended["status"], ended["attempt"]) == ("succeeded", 1)
    assert service.job(waiting)["status"] == "queued"


@in_one_home_first
def test_stops_in_the_middle_of_a_job_do_not_count_as_its_attempts(start, worker_beside):
    service = start("serve", ESC_DRAIN_S="0")
    job = service.submitted(service.venue("v"))
    # As often as the queue begins a job whose worker has died.
    with service.jobs_held("v"):
        for _ in range(1 + BEGINS_AGAIN):
            worker = worker_beside(service, "w")
            service.running(job)
            (computing,) = [process for process in service.begun(job) if alive(process)]
            worker.terminate()
            assert worker.wait(60) == 0
            state = service.job(job)
            assert (state["status"], state["attempt"], state["started_at"]) == ("queued", 0, None)
            wait_for(lambda process=computing: not alive(process))
    worker_beside(service, "w")
    ended = service.end(job)
    assert (ended["status"], ended["attempt"]) == ("succeeded", 1)
    assert poses(service, "v") == [-0.875, -0.875]
    assert figures(service)["esc_job_restarts_total",] == 0


def test_a_worker_that_is_asked_twice_to_stop_does_not_wait_for_its_job(start, worker_beside):
    service = start("serve")
    worker = worker_beside(service, "w")
    job = service.submitted(service.venue("v", "hang"))
    service.running(job)
    worker.terminate()
    wait_for(lambda: "worker stops" in (service.data / "log").read_text())
    assert worker.poll() is None
    begun = time.monotonic()
    worker.terminate()
    assert worker.wait(60) == 0
    assert time.monotonic() - begun < AT_ONCE_S
    assert service.job(job)["status"] == "queued"


def test_poses_that_were_found_hold_though_their_pictures_cannot_be_stored(start):
    service = start().ready()
    (service.data / "blobs" / "pictures").write_bytes(b"no folder")
    job = service.calibrated(service.venue("v"))
    assert (job["status"], job["venue_revision"]) == ("succeeded", 2)
    assert job["result"]["warnings"][0].startswith("Its pictures cannot be stored: ")
    assert poses(service, "v") == [-0.875, -0.875]
    assert service.http.get(f"/jobs/{job['id']}/preview.jpg").status_code == 404


@in_one_home_first
def test_two_workers_of_one_name_do_not_run_on_two_machines(start, worker_beside):
    # Before that the second one has to see a heartbeat of the first, which a busy machine delays.
    service = start("serve", ESC_TAKEOVER_AFTER_S="6")
    first = worker_beside(service, "truck", "one")
    with service.jobs_held("v"):
        job = service.submitted(service.venue("v"))
        service.running(job)
        second = worker_beside(service, "truck", "two")
        assert second.wait(60) == 2
    assert "A worker called truck already runs elsewhere" in (service.data / "log").read_text()
    ended = service.end(job)
    assert (ended["status"], ended["attempt"]) == ("succeeded", 1)
    # Once the first one is gone, whatever it died of, the name is free.
    first.kill()
    first.wait()
    worker_beside(service, "truck", "two")
    assert service.calibrated("v", 1)["status"] == "succeeded"


def test_a_worker_whose_name_was_taken_while_it_was_away_ends(start, worker_beside):
    service = start("serve")
    worker = worker_beside(service, "truck", "one")
    service.ready()
    engine = connect(service.database_url)
    WorkerRepository(engine).register("truck", None, "another", "elsewhere")
    engine.dispose()
    assert worker.wait(60) == 2
    assert "another worker of this name has started" in (service.data / "log").read_text()


@pytest.mark.parametrize("command", [("up", "--port", "0"), ("worker", "--name", socket.gethostname())])
def test_a_second_worker_of_one_name_on_one_machine_is_told_so_and_ends(service, command):
    worker = service.worker()
    second = esc_process(service.data, *command, **service.environment)
    assert second.returncode == 2
    assert f"A worker called {socket.gethostname()} already runs on" in second.stderr
    assert "listens" not in second.stdout
    assert service.worker() == worker


@pytest.mark.long
def test_a_service_whose_worker_has_the_name_of_another_machines_ends(start, worker_beside, tmp_path):
    service = start("serve", ESC_WORKER_NAME="truck")
    worker_beside(service, "truck", "one")
    service.ready()
    home = {"ESC_DATA": str(tmp_path / "two"), "ESC_DATABASE_URL": service.database_url}
    second = esc_process(service.data, "up", "--port", "0", **service.environment | home)
    assert second.returncode == 2
    assert "A worker called truck already runs elsewhere" in second.stderr
