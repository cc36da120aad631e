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
        (404, {"Retry-After": "2"}, False),
    ],
)
def test_busy_is_what_waiting_can_solve(status, headers, busy, monkeypatch):
    answer = httpx.Response(status, headers=headers, json={"title": "No"})
    monkeypatch.setattr(httpx.Client, "request", lambda *_, **__: answer)
    with Client("http://127.0.0.1:9") as client, pytest.raises(Refused) as refused:
        client.accept("01KAJ3Q6WZ5T3Y8R0N4M2C7B1D")
    assert refused.value.busy is busy
