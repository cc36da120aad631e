"""Reports of live poses over HTTP: what is taken, what is answered, and who follows them."""

import json
from contextlib import contextmanager

import httpx
import pytest

from testbed.homes import in_one_home_first
from testbed.running import DEADLINE_S, venue
from tests.e2e.routes.event_stream import Stream
from tests.problems import problem_of

LEFT = {
    "id": "left",
    "status": "measured",
    "stream": "rtsp://user:secret@10.1.0.7/main",
    "pose": {"rotation": [1.6, 0.3, -0.4], "position": [-1.0, -49.0, 7.0]},
    "sigma": {"rotation_deg": 0.004, "position_m": 0.01},
    "turned_deg": 0.02,
    "moved_m": 0.004,
    "taken_at": "2026-11-23T11:12:13.480Z",
    "clock": "arrival",
    "pictures": 13,
    "left_out": 1,
    "measured": 12,
    "latency_ms": {"p50": 38, "p99": 61.5},
}
REPORT = {
    "started_at": "2026-11-23T10:00:00Z",
    "host": "truck-7",
    "pid": 4711,
    "destinations": ["opentrackio multicast"],
    "cameras": [LEFT, {"id": "right", "status": "stored"}],
}


@contextmanager
def followed(service, name):
    with httpx.stream("GET", f"{service.url}/venues/{name}/live/poses", timeout=DEADLINE_S) as answer:
        yield Stream(answer)


@in_one_home_first
def test_the_newest_report_is_answered_followed_and_kept_by_the_minute(service, name):
    service.venue(name)
    address = f"/venues/{name}/live"
    never = service.http.get(address)
    assert (never.status_code, never.json()["running"], never.json()["cameras"]) == (200, False, [])
    with followed(service, name) as stream:
        first = stream.next()
        assert (first["event"], first["data"]["running"]) == ("live", False)
        taken = service.http.put(address, json=REPORT)
        assert (taken.status_code, taken.content) == (204, b"")
        state = stream.next()["data"]
        assert state == service.http.get(address).json()
        assert (state["running"], state["host"], state["destinations"]) == (True, "truck-7", ["opentrackio multicast"])
        left, right = state["cameras"]
        assert left["pose"]["position"] == LEFT["pose"]["position"]
        assert len(left["pose"]["translation"]) == 3
        assert (left["clock"], left["latency_ms"]) == ("arrival", {"p50": 38.0, "p99": 61.5})
        assert (right["status"], right["pose"], right["stream"]) == ("stored", None, None)
        assert "secret" not in str(state)
        # That nothing more is reported is news as well.
        assert stream.next()["data"]["running"] is False
    (minute,) = service.http.get(f"{address}/history", params={"minutes": 5}).json()["minutes"]
    assert (minute["cameras"]["left"]["measured"], minute["cameras"]["left"]["pictures"]) == (12, 13)


def test_a_stream_of_live_poses_ends_with_its_venue(service, name):
    service.venue(name)
    with followed(service, name) as stream:
        stream.next()
        service.http.delete(f"/venues/{name}").raise_for_status()
        with pytest.raises(EOFError):
            stream.next()
    for address in ("live", "live/poses", "live/history"):
        assert service.http.get(f"/venues/{name}/{address}").status_code == 404


@pytest.mark.parametrize(
    ("change", "kind"),
    [
        ({"cameras": [LEFT | {"id": "middle"}]}, "unknown-camera"),
        ({"cameras": [LEFT, LEFT]}, "invalid-request"),
        ({"cameras": [LEFT | {"measured": 13}]}, "invalid-request"),
        ({"cameras": [LEFT | {"turned_deg": float("1e400")}]}, "invalid-request"),
        ({"cameras": [LEFT | {"status": "lost"}]}, "invalid-request"),
        ({"started_at": 1763892000}, "invalid-request"),
        ({"started_at": "2026-11-23T10:00:00"}, "invalid-request"),
        ({"mood": "good"}, "invalid-request"),
    ],
)
def test_a_report_that_says_what_cannot_be_is_refused(service, name, change, kind):
    service.venue(name)
    refused = service.http.put(
        f"/venues/{name}/live", content=json.dumps(REPORT | change), headers={"Content-Type": "application/json"}
    )
    assert problem_of(refused) == (422, kind)


def test_a_report_of_no_venue_is_not_found_and_leaves_nothing(service, name):
    assert service.http.put(f"/venues/{name}/live", json=REPORT).status_code == 404
    service.http.put(f"/venues/{name}", json=venue(name)).raise_for_status()
    assert service.http.get(f"/venues/{name}/live").json()["reported_at"] is None
