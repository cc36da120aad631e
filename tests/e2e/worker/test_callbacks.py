"""Callbacks of a whole service: whoever is killed when, the end of a job is told."""

import json
import os
import signal
from datetime import UTC, datetime

import pytest
import sqlalchemy as sa

from service.settings import Settings
from service.store import tables
from testbed.running import wait_for
from tests.e2e.commands import esc_here
from tests.problems import problem_of
from tests.worker.receiver import LOCAL, SECRET, Holding
from worker.duties import webhook_request


@pytest.fixture
def receiver():
    hook = Holding()
    yield hook
    hook.close()


@pytest.mark.long
def test_the_worker_that_is_killed_over_a_callback_sends_it_again_when_it_is_back(start, receiver):
    service = start("up", **LOCAL).ready()
    job = service.submitted(service.venue("v"), callback_url=receiver.url)
    ended = service.end(job)
    wait_for(lambda: receiver.received)
    # A receiver that hangs holds up no job.
    assert service.calibrated(service.venue("w"))["status"] == "succeeded"
    os.kill(service.worker(), signal.SIGKILL)
    receiver.go.set()
    due_now(service, job)
    wait_for(lambda: len(receiver.received) == 2)
    first, second = receiver.received
    assert (first.body, first.headers["webhook-id"]) == (second.body, job)
    told = {"type": "job.succeeded", "timestamp": ended["finished_at"], "data": ended | {"callback": None}, "by": None}
    assert json.loads(second.body) == told
    keys = Settings(webhook_secret=SECRET).webhook_keys
    at = datetime.fromtimestamp(int(second.headers["webhook-timestamp"]), UTC)
    assert second.headers.items() >= webhook_request.headers(job, at, second.body, keys).items()
    wait_for(lambda: 'esc_callbacks_total{outcome="delivered"} 1.0' in service.http.get("/metrics").text)


def due_now(service, job: str) -> None:
    """Spare a test the time after which an attempt counts as lost."""
    d = tables.deliveries
    with service.database() as connection:
        connection.execute(sa.update(d).where(d.c.id == job).values(due_at=datetime(2026, 1, 1, tzinfo=UTC)))


def test_an_end_that_no_worker_saw_is_told_by_the_next_one(start, receiver, worker_beside):
    receiver.go.set()
    service = start("serve", **LOCAL)
    job = service.submitted(service.venue("v"), callback_url=receiver.url)
    service.http.post(f"/jobs/{job}/cancel")
    worker_beside(service, "next")
    service.process.kill()
    wait_for(lambda: receiver.received)
    assert json.loads(receiver.received[0].body)["type"] == "job.cancelled"


def test_without_a_secret_a_callback_is_refused_with_what_to_do(service, name):
    answer = service.submit(service.venue(name), callback_url="https://example.com/told")
    assert problem_of(answer) == (422, "callback-refused")
    assert "ESC_WEBHOOK_SECRET" in answer.json()["detail"]
    nonsense = service.submit(name, callback_url="told")
    assert problem_of(nonsense) == (422, "invalid-request")
    assert nonsense.json()["errors"][0]["where"] == "options.callback_url"


def test_a_secret_that_is_none_is_refused_at_the_start(tmp_path):
    refused = esc_here(tmp_path, "up", "--port", "0", ESC_DATA=str(tmp_path), ESC_WEBHOOK_SECRET="topsecret")
    assert refused.returncode == 2
    assert "ESC_WEBHOOK_SECRET: " in refused.stderr
    assert "topsecret" not in refused.stderr
