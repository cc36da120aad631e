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
