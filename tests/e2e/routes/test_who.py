"""Attribution of changes in history and events: key, address and request."""

import json
import time

import pytest

from service.schemas.actor import Actor
from service.schemas.venue import VENUE_EXAMPLE, VenueIn
from service.store.events.feed import EventRepository
from service.store.venues import VenueRepository
from testbed.running import Service, keys_in, venue
from tests.e2e.routes.event_stream import Stream

TRUCK, OFFICE = "203.0.113.7", "2001:db8::7"


@pytest.fixture(scope="module")
def asking(tmp_path_factory):
    """A service that asks for keys; its client has one, and comes by a proxy of this machine."""
    folder = tmp_path_factory.mktemp("asking")
    key = keys_in(folder).add("truck", "admin")
    running = Service(folder).ready()
    running.http.headers.update({"Authorization": f"Bearer {key}", "X-Forwarded-For": TRUCK})
    running.environment["ESC_API_KEY"] = key
    yield running
    assert running.stop() == 0


def revisions(service, name):
    return service.http.get(f"/venues/{name}/history").raise_for_status().json()["revisions"]


def by(request_id, address=TRUCK):
    return {"name": "key truck", "address": address, "request_id": request_id}


def call(service, method, path, request_id, **content):
    answer = service.http.request(method, path, headers={"X-Request-ID": request_id}, **content)
    return answer.raise_for_status()


def test_every_change_of_the_poses_says_who_made_it_from_where_and_by_which_request(asking, name):
    call(asking, "PUT", f"/venues/{name}", "put-1", json=venue(name, "reject"))
    patch = {"cameras": {"left": {"pose": {"position": [0.0, -40.0, 8.0]}}}}
    headers = {"Content-Type": "application/merge-patch+json", "X-Request-ID": "patch-1", "X-Forwarded-For": OFFICE}
    asking.http.patch(f"/venues/{name}", content=json.dumps(patch), headers=headers).raise_for_status()
    rejected = asking.calibrated(name, headers={"X-Request-ID": "job-1"})
    call(asking, "POST", f"/jobs/{rejected['id']}/accept", "accept-1")
    call(asking, "POST", f"/jobs/{rejected['id']}/reject", "reject-1")
    call(asking, "POST", f"/venues/{name}/restore", "restore-1", json={"revision": 1})
    call(asking, "PUT", f"/venues/{name}", "put-2", json=venue(name, "accept"))
    asking.calibrated(name, 1, headers={"X-Request-ID": "job-2"})
    told = [(revision["cause"], revision["by"]) for revision in revisions(asking, name)]
    assert told == [
        ("calibrated", by("job-2")),
        ("restored", by("restore-1")),
        ("restored", by("reject-1")),
        ("accepted", by("accept-1")),
        ("put", by("patch-1", OFFICE)),
        ("put", by("put-1")),
    ]


def test_events_say_who_did_what_and_nobody_of_what_the_service_does_by_itself(asking, name):
    call(asking, "PUT", f"/venues/{name}", "put-1", json=venue(name))
    with asking.http.stream("GET", f"/venues/{name}/events") as answer:
        stream = Stream(answer)
        told = [stream.next()]
        asking.calibrated(name, headers={"X-Request-ID": "job-1"})
        call(asking, "PUT", f"/venues/{name}", "put-2", json=venue(name, "accept 60"))
        open_job = asking.submitted(name, 1, headers={"X-Request-ID": "job-2"})
        call(asking, "POST", f"/jobs/{open_job}/cancel", "cancel-1")
        call(asking, "DELETE", f"/venues/{name}", "delete-1")
        told += stream.until("venue.deleted")
    assert [(event["event"], event["data"]["by"]) for event in told] == [
        ("poses.current", by("put-1")),
        ("job.queued", by("job-1")),
        ("poses.changed", by("job-1")),
        ("job.succeeded", None),
        ("venue.changed", by("put-2")),
        ("poses.changed", by("put-2")),
        ("job.queued", by("job-2")),
        ("job.cancelled", by("cancel-1")),
        ("venue.deleted", by("delete-1")),
    ]


def test_a_webhook_gets_no_address(engine):
    venues, following = VenueRepository(engine), EventRepository(engine)
    by = Actor(name="key truck", address=TRUCK, request_id="put-1")
    stored = VenueIn.model_validate(VENUE_EXAMPLE).to_venue()
    venues.put(stored, by=by)
    number = following.newest([stored.id])[stored.id]
    assert following.since(stored.id, 0, [], 1).events[0].event.by == by
    assert following.get(number).by == Actor(name="key truck", address=None, request_id="put-1")


def test_where_no_keys_are_asked_for_it_was_anyone(service, name):
    service.http.put(f"/venues/{name}", json=venue(name), headers={"X-Request-ID": "van-3"}).raise_for_status()
    (put,) = revisions(service, name)
    assert put["by"] == {"name": "anyone", "address": "127.0.0.1", "request_id": "van-3"}
    assert service.calibrated(name)["asked_by"] is None
    assert revisions(service, name)[0]["by"]["name"] == "anyone"


def test_the_log_line_of_a_request_has_the_address_of_its_client(asking, name):
    call(asking, "PUT", f"/venues/{name}", "logged-put", json=venue(name))
    line = request_line(asking, "logged-put")
    assert (line["address"], line["key"], line["status"]) == (TRUCK, "truck", 201)


def request_line(service, request_id):
    """Line of a request in the log; it is written once the answer has been sent."""
    for _ in range(100):
        lines = [line for line in (service.data / "log").read_text().splitlines() if request_id in line]
        found = [line for line in map(json.loads, lines) if line["event"] == "request"]
        if found:
            (line,) = found
            return line
        time.sleep(0.05)
    raise AssertionError(f"no line of the request {request_id}")
