"""What the client makes of a refusal."""

import httpx
import pytest

from service.client import Client, Refused


@pytest.mark.parametrize(
    ("status", "headers", "busy"),
    [
        (409, {"Retry-After": "2"}, True),
        (409, {}, False),
        (429, {}, True),
        (503, {}, True),
        (502, {}, True),
        (507, {}, False),
        (404, {"Retry-After": "2"}, False),
    ],
)
def test_busy_is_what_waiting_can_solve(status, headers, busy, monkeypatch):
    answer = httpx.Response(status, headers=headers, json={"title": "No"})
    monkeypatch.setattr(httpx.Client, "request", lambda *_, **__: answer)
    with Client("http://127.0.0.1:9") as client, pytest.raises(Refused) as refused:
        client.accept("01KAJ3Q6WZ5T3Y8R0N4M2C7B1D")
    assert refused.value.busy is busy


@pytest.mark.parametrize(("status", "kind"), [(503, "extra-missing"), (502, "source-failed")])
def test_what_waiting_cannot_solve_is_not_busy(status, kind):
    assert not Refused(status, {"type": f"/problems/{kind}", "title": "No"}).busy


def test_a_job_that_is_followed_for_long_outlives_an_outage_at_its_end(monkeypatch):
    """The patience is counted from the last answer and not from the first question."""
    now, running, ended = [0.0], job_answer("running"), job_answer("succeeded")
    answers = [running] * 40 + [httpx.ConnectError("refused")] * 3 + [ended]

    def request(*_, **__):
        now[0] += 5.0
        answer = answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return httpx.Response(200, json=answer)

    monkeypatch.setattr(httpx.Client, "request", request)
    monkeypatch.setattr("service.client.time.monotonic", lambda: now[0])
    monkeypatch.setattr("service.client.time.sleep", lambda _: None)
    with Client("http://127.0.0.1:9") as client:
        assert client.follow(client.job("01KAJ3Q6WZ5T3Y8R0N4M2C7B1D")).status == "succeeded"
    assert answers == []


def job_answer(status: str) -> dict:
    return {
        "id": "01KAJ3Q6WZ5T3Y8R0N4M2C7B1D",
        "venue": "v",
        "kind": "calibration",
        "status": status,
        "progress": None,
        "queue_position": None,
        "attempt": 1,
        "created_at": "2026-11-21T10:00:00Z",
        "started_at": None,
        "finished_at": None,
        "error": None,
        "result": None,
        "options": {},
        "links": {},
    }
