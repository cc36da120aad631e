"""A truck that was switched on with a clock hours ahead, which is then put right: all of its processes run on."""

import json
from datetime import UTC, datetime, timedelta

import pytest

from testbed.clocks import Clock
from testbed.running import Service, venue, wait_for

AHEAD_S = 6 * 3600
# Every quarter of an hour, and venues of one schedule are spread over another.
LATEST = timedelta(minutes=31)


@pytest.fixture
def ahead(tmp_path):
    """A service whose clock is ahead, and the clock. Its home is SQLite, which has no clock of its own."""
    clock = Clock(tmp_path, AHEAD_S)
    sources = {"ESC_SOURCES": json.dumps(["127.0.0.1"])}
    service = Service(tmp_path / "esc", "up", **clock.environment, **sources).ready()
    yield service, clock
    service.kill()


@pytest.mark.long
def test_a_clock_that_is_put_right_by_hours_holds_up_neither_schedules_nor_jobs(ahead, camera):
    service, clock = ahead
    document = venue("scheduled", cameras=("left",)) | {"schedule": {"cron": "*/15 * * * *"}}
    document["cameras"][0]["source"] = camera.url("/ok")
    service.http.put("/venues/scheduled", json=document).raise_for_status()
    name = service.venue("by-hand")
    then = service.calibrated(name)
    assert datetime.fromisoformat(then["finished_at"]) > datetime.now(UTC) + timedelta(hours=5)
    assert next_time(service) > datetime.now(UTC) + timedelta(hours=5)

    clock.put(0)
    wait_for(lambda: next_time(service) < datetime.now(UTC) + LATEST)
    now = service.calibrated(name)
    assert (now["status"], now["attempt"]) == ("succeeded", 1)
    assert datetime.fromisoformat(now["finished_at"]) < datetime.now(UTC) + timedelta(minutes=1)
    assert service.http.get("/readyz").json()["warnings"] == {}
    assert service.http.get(f"/venues/{name}/history").json()["revisions"][0]["job"] == now["id"]


def next_time(service):
    """When the schedule fires next."""
    return datetime.fromisoformat(service.http.get("/venues/scheduled/health").json()["schedule"]["next_at"])
