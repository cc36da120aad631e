"""Schedules of a running service beside clients that push."""

import json
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime

import httpx
import pytest
import sqlalchemy as sa

from service.store import tables
from testbed.homes import in_both_homes
from testbed.running import upload, venue, wait_for

LIMIT, CLIENTS, JOB_S = 2, 4, 0.5
# Until a place is free, frames are fetched by a process of their own, and the worker looks, on a busy machine.
TURN_S = 30.0


def push(service, name, until, answers):
    """Submit all the time, new frames each time."""
    with httpx.Client(base_url=service.url, timeout=60) as client:
        for shade in range(100_000):
            if until.is_set():
                return
            answer = client.post(f"/venues/{name}/calibrate", files=upload(shade % 256))
            answers.append((answer.status_code, answer.json().get("detail", "")))
            time.sleep(0.03)


@pytest.mark.long
@in_both_homes
def test_a_schedule_gets_its_turn_however_many_clients_push(start, camera):
    service = start("up", ESC_QUEUE_LIMIT=str(LIMIT), ESC_SOURCES=json.dumps(["127.0.0.1"])).ready()
    document = venue("scheduled", cameras=("left",)) | {"schedule": {"cron": "0 3 * * *"}}
    document["cameras"][0]["source"] = camera.url("/ok")
    service.http.put("/venues/scheduled", json=document).raise_for_status()
    names = [service.venue(f"pushed-{number}", f"accept {JOB_S}") for number in range(CLIENTS)]
    until, answers = threading.Event(), []
    with ThreadPoolExecutor(CLIENTS) as clients:
        for name in names:
            clients.submit(push, service, name, until, answers)
        try:
            wait_for(lambda: [status for status, _ in answers].count(202) > LIMIT + 1)
            with service.database() as connection:
                now = datetime.now(UTC)
                connection.execute(sa.update(tables.schedules).values(due_at=now, look_at=now))
            due, before = time.monotonic(), len(answers)
            state = wait_for(
                lambda: (seen := service.http.get("/venues/scheduled/health").json()["schedule"])["last_job"] and seen,
                deadline_s=2 * TURN_S,
            )
            waited_s = time.monotonic() - due
            wait_for(lambda: 202 in [status for status, _ in answers[before:]])
        finally:
            until.set()
    assert waited_s < TURN_S
    assert state["last_error"] is None
    said = {detail for status, detail in answers if status == 429}
    # Nobody is told of more jobs than wait.
    assert said <= {
        "2 jobs wait; try again.",
        "1 jobs wait, and 1 of 2 places are kept for schedules that are due; try again.",
    }
    assert "1 jobs wait, and 1 of 2 places are kept for schedules that are due; try again." in said
