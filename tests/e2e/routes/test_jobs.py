import json
import socket
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from threading import Semaphore

import httpx
import sqlalchemy as sa

from service.store import tables
from testbed.homes import in_both_homes, in_one_home_first
from testbed.running import DEADLINE_S, alive, venue, wait_for
from tests.e2e.observe.figures import figures

# What a busy machine may add to what is promised.
BUSY_S = 10


@in_both_homes
def test_a_job_goes_from_frames_to_poses_and_pictures(service, name):
    answer = service.submit(service.venue(name), generations=12)
    job = answer.json()
    assert (answer.status_code, answer.headers["location"]) == (202, f"/jobs/{job['id']}")
    assert int(answer.headers["retry-after"]) > 0
    assert (job["status"], job["venue"], job["result"]) == ("queued", name, None)

    job = service.end(job["id"])
    assert (job["status"], job["attempt"], job["error"]) == ("succeeded", 1, None)
    assert job["result"]["accepted"]
    assert job["result"]["provenance"]["options"]["generations"] == 12
    assert [camera["id"] for camera in job["result"]["cameras"]] == ["left", "right"]
    for link in ("preview", "birdseye", "overlay/left", "overlay/right"):
        picture = service.http.get(job["links"][link])
        assert (picture.status_code, picture.headers["content-type"]) == (200, "image/jpeg")


def test_a_job_that_succeeded_is_wholly_done(service, name):
    job = service.calibrated(service.venue(name, "accept 0.5"))
    assert (job["status"], job["progress"]["fraction"]) == ("succeeded", 1.0)


@in_both_homes
def test_a_venue_changed_meanwhile_keeps_its_new_poses(service, name):
    job = service.submitted(service.venue(name, "accept 1"))
    service.running(job)
    changed = venue(name)
    changed["cameras"][0]["pose"]["position"] = [0, -60, 9]
    service.http.put(f"/venues/{name}", json=changed).raise_for_status()
    result = service.end(job)["result"]
    assert (result["accepted"], result["rejected_because"]) == (False, "the venue was changed while the job ran")
    assert service.http.get(f"/venues/{name}").json()["cameras"][0]["pose"]["position"] == [0, -60, 9]


# One active job per venue, and the same content once


@in_both_homes
def test_many_submissions_at_once_are_one_job(service, name):
    service.venue(name)
    with service.jobs_held(name), ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(lambda _: service.submit(name), range(8)))
    assert sorted(answer.status_code for answer in answers) == [200] * 7 + [202]
    job = {answer.json()["id"] for answer in answers}
    assert len(job) == 1
    assert len(service.files(f"frames/{next(iter(job))}")) == 2


@in_both_homes
def test_a_key_that_comes_twice_at_once_is_one_job_whatever_came_with_it(service, name):
    service.venue(name)
    key = {"Idempotency-Key": "k"}
    with service.jobs_held(name), ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(lambda number: service.submit(name, number % 2, headers=key), range(8)))
    assert sorted(answer.status_code for answer in answers) == [200] * 3 + [202] + [422] * 4
    refused = {answer.json()["type"] for answer in answers if answer.status_code == 422}
    assert refused == {"/problems/idempotency-key-reused"}
    assert len({answer.json()["id"] for answer in answers if answer.status_code < 300}) == 1


# Following a job


def test_the_answer_waits_for_the_end(service, name):
    job = service.submitted(service.venue(name, "accept 0.5"))
    assert service.job(job, wait=20)["status"] == "succeeded"


def test_but_no_longer_than_asked(service, name):
    job = service.submitted(service.venue(name, "hang"))
    begun = time.monotonic()
    assert service.job(job, wait=0.5)["status"] in ("queued", "running")
    assert 0.4 < time.monotonic() - begun < 0.5 + BUSY_S
    service.http.post(f"/jobs/{job}/cancel")


def test_progress_is_shown(service, name):
    with service.jobs_held(name):
        job = service.submitted(service.venue(name))
        progress = wait_for(lambda: (p := service.job(job)["progress"]) and p["stage"] == "evolution" and p)
    assert progress == {"stage": "evolution", "fraction": 0.5, "generation": 7, "loss": 0.3}
    service.end(job)


@in_one_home_first
def test_events_tell_the_progress_and_the_end(service, name):
    lines = []
    with ExitStack() as held:
        held.enter_context(service.jobs_held(name))
        job = service.submitted(service.venue(name))
        with service.http.stream("GET", f"/jobs/{job}/events") as answer:
            assert answer.headers["content-type"].startswith("text/event-stream")
            for line in answer.iter_lines():
                lines.append(line.partition(": "))
                if '"evolution"' in line:
                    held.close()
    events = [value for field, _, value in lines if field == "event"]
    bodies = [json.loads(value) for field, _, value in lines if field == "data"]
    assert events[-1] == "end"
    assert set(events[:-1]) == {"progress"}
    assert bodies[-1]["status"] == "succeeded"
    assert any(body["progress"] and body["progress"]["stage"] == "evolution" for body in bodies)


def test_everybody_who_listens_hears_the_end(service, name):
    job = service.submitted(service.venue(name, "hang"))
    service.running(job)
    everybody = 30
    listening = Semaphore(0)

    def listen(_):
        with httpx.stream("GET", f"{service.url}/jobs/{job}/events", timeout=DEADLINE_S) as events:
            lines = events.iter_lines()
            assert next(lines) == "event: progress"
            listening.release()
            return [line for line in lines if line.startswith("event")]

    def cancel():
        for _ in range(everybody):
            assert listening.acquire(timeout=DEADLINE_S)
        service.http.post(f"/jobs/{job}/cancel").raise_for_status()

    with ThreadPoolExecutor(everybody + 1) as pool:
        cancelled = pool.submit(cancel)
        heard = list(pool.map(listen, range(everybody)))
        cancelled.result()
    for events in heard:
        assert events.count("event: end") == 1


# Ending a job early


@in_one_home_first
def test_a_running_job_is_cancelled_within_two_seconds(service, name):
    job = service.submitted(service.venue(name, "hang"))
    service.running(job)
    (process,) = service.begun(job)
    begun = time.monotonic()
    answer = service.http.post(f"/jobs/{job}/cancel")
    assert (answer.status_code, answer.json()["status"]) == (200, "cancelled")
    wait_for(lambda: not alive(process))
    assert time.monotonic() - begun < 2 + BUSY_S
    assert service.http.post(f"/jobs/{job}/cancel").json() == service.job(job)


@in_both_homes
def test_a_queued_job_is_cancelled_at_once_and_never_begins(service, name):
    busy = service.submitted(service.venue(f"{name}-a", "hang"))
    service.running(busy)
    queued = service.submitted(service.venue(f"{name}-b"))
    assert service.http.post(f"/jobs/{queued}/cancel").json()["status"] == "cancelled"
    service.http.post(f"/jobs/{busy}/cancel")
    service.calibrated(f"{name}-b", 1)
    assert service.begun(queued) == []


def test_a_job_that_takes_too_long_is_ended(service, name):
    job = service.calibrated(service.venue(name, "hang"), timeout_s=1)
    assert (job["status"], job["error"]["type"]) == ("failed", "/problems/job-timeout")
    wait_for(lambda: not any(alive(process) for process in service.begun(job["id"])))


@in_both_homes
def test_live_jobs_go_first(service, name):
    busy = service.submitted(service.venue(f"{name}-a", "hang"))
    service.running(busy)
    routine = service.submit(service.venue(f"{name}-b")).json()
    live = service.submit(service.venue(f"{name}-c"), priority="live").json()
    assert live["queue_position"] < service.job(routine["id"])["queue_position"]
    service.http.post(f"/jobs/{busy}/cancel")
    assert service.end(live["id"])["finished_at"] < service.end(routine["id"])["started_at"]


def test_a_full_queue_says_so_and_when_to_come_again(unusual):
    answers = [unusual.submit(unusual.venue(f"venue-{number}")) for number in range(3)]
    assert [answer.status_code for answer in answers] == [202, 202, 429]
    assert (answers[2].json()["type"], answers[2].headers["retry-after"]) == ("/problems/queue-full", "30")
    assert len(unusual.files("frames")) == 2 * len(("left", "right"))
    # Before the body is there.
    url = httpx.URL(unusual.url)
    with socket.create_connection((url.host, url.port), timeout=10) as connection:
        form = "Content-Type: multipart/form-data; boundary=x\r\nContent-Length: 5000\r\n"
        connection.sendall(f"POST /venues/venue-2/calibrate HTTP/1.1\r\nHost: 127.0.0.1\r\n{form}\r\n".encode())
        assert connection.recv(1000).startswith(b"HTTP/1.1 429 ")
    with unusual.database() as database:
        assert database.scalar(sa.select(sa.func.count()).select_from(tables.leftovers)) == 0
    for answer in answers[:2]:
        unusual.http.post(f"/jobs/{answer.json()['id']}/cancel").raise_for_status()


def test_without_a_worker_a_service_goes_on_answering_and_says_what_is_missing(unusual):
    answer = unusual.http.get("/readyz")
    assert (answer.status_code, answer.json()["status"]) == (200, "ok")
    assert answer.json()["parts"]["worker"] == "none gave a sign of life"
    assert answer.json()["warnings"].keys() == {"worker", "model"}
    assert figures(unusual)["esc_part_up", ("part", "worker")] == 0
    assert figures(unusual)["esc_part_up", ("part", "database")] == 1
