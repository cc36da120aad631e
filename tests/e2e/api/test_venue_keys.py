"""Keys for some venues: every route of the application, called for a venue that the key is not for."""

import json
import os
import re

import httpx
import pytest
from fastapi.routing import iter_route_contexts

from service.app import create_app
from service.routes.contract.guarded import Guarded
from service.settings import Settings
from testbed.running import Service, keys_in, upload, venue
from tests.e2e.commands import esc_here

OURS, THEIRS = "ours", "theirs"
# By any of these a venue that the key is not for would be known: its id, its name, its camera.
SECRET_NAME, SECRET_CAMERA = "accept 0.1", "theircamera"
TELLING = re.compile(f'{SECRET_CAMERA}|{SECRET_NAME}|/venues/{THEIRS}/|"{THEIRS}"')
# The lists, which show what is the key's.
LISTS = {("GET", "/venues"), ("GET", "/jobs"), ("GET", "/"), ("GET", "/ui/jobs")}
NO_SUCH = "01KAJ3Q6WZ5T3Y8R0N4M2C7B1D"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("venue-keys")


@pytest.fixture(scope="module")
def shared(folder):
    """A service with two calibrated venues; its client may do everything."""
    keys = keys_in(folder)
    all_venues, one_venue = keys.add("owner", "admin"), keys.add("customer", "admin", venues=[OURS])
    running = Service(folder).ready()
    running.http.headers["Authorization"] = f"Bearer {all_venues}"
    for one, behaviour, camera in ((OURS, "accept", "left"), (THEIRS, SECRET_NAME, SECRET_CAMERA)):
        running.http.put(f"/venues/{one}", json=venue(one, behaviour, (camera, "right"))).raise_for_status()
    running.jobs = {}
    for one, camera in ((OURS, "left"), (THEIRS, SECRET_CAMERA)):
        files = [(camera, frame) if name == "left" else (name, frame) for name, frame in upload()]
        answer = running.http.post(f"/venues/{one}/calibrate", files=files).raise_for_status()
        running.jobs[one] = running.end(answer.json()["id"])
    running.customer = httpx.Client(base_url=running.url, headers={"Authorization": f"Bearer {one_venue}"}, timeout=60)
    yield running
    running.customer.close()
    assert running.stop() == 0


@pytest.fixture(scope="module")
def guarded_routes(tmp_path_factory):
    """Method and path of every route of the application that asks for a key."""
    app = create_app(Settings(data=tmp_path_factory.mktemp("routes")))
    found = []
    for route in iter_route_contexts(app.routes):
        if isinstance(route.original_route, Guarded) and route.original_route.needed is not None:
            found += [(method, route.path) for method in route.methods]
    yield found
    app.state.context.queue.close()
    app.state.context.engine.dispose()


def addressed(path, job, venue_id):
    return path.format(job_id=job, venue_id=venue_id, camera=SECRET_CAMERA, number=0, key_name="nobody")


def called(service, method, path):
    """Answer to a key for one venue, whatever the body of its request is."""
    bodies = [{}]
    if method in ("POST", "PUT", "PATCH"):
        kind = "application/merge-patch+json" if method == "PATCH" else "application/json"
        document = service.http.get(f"/venues/{THEIRS}").json() | {"name": "taken over", "revision": 1}
        bodies = [{"content": json.dumps(document), "headers": {"Content-Type": kind}}, {"files": upload()}, {}]
    return [service.customer.request(method, path, **body) for body in bodies]


def everything_of(service, venue_id):
    """All that a change of a venue would change."""
    paths = (f"/venues/{venue_id}", f"/venues/{venue_id}/history", f"/jobs?venue={venue_id}")
    return [service.http.get(path).raise_for_status().json() for path in paths]


def test_a_key_for_one_venue_reads_and_changes_nothing_of_another_by_any_route(shared, guarded_routes):
    before = everything_of(shared, THEIRS)
    tried = set()
    for method, path in guarded_routes:
        for answer in called(shared, method, addressed(path, shared.jobs[THEIRS]["id"], THEIRS)):
            about_one = "{venue_id}" in path or "{job_id}" in path
            expected = {200} if (method, path) in LISTS else {404} if about_one else {403}
            assert (method, path, answer.status_code) == (method, path, *expected), answer.text
            # The name in the address itself is the caller's own word.
            assert not TELLING.search(answer.text), (method, path, answer.text)
        tried.add((method, path))
    assert {("GET", "/metrics"), ("POST", "/venues/{venue_id}/calibrate"), ("DELETE", "/jobs/{job_id}")} <= tried
    assert len(tried) > 50
    assert everything_of(shared, THEIRS) == before


def test_what_is_not_the_keys_is_answered_as_if_it_were_not_there(shared, guarded_routes):
    def without_id(answer, of):
        return answer.status_code, answer.text.replace(of, "...")

    for method, path in guarded_routes:
        for there, nowhere in ((THEIRS, "nowhere"), (shared.jobs[THEIRS]["id"], NO_SUCH)):
            if ("{venue_id}" if there == THEIRS else "{job_id}") not in path:
                continue
            other, none = (shared.customer.request(method, addressed(path, one, one)) for one in (there, nowhere))
            # The pages show the time and the address that was asked for.
            if not path.startswith("/ui/"):
                assert without_id(other, there) == without_id(none, nowhere), (method, path)
            assert other.status_code == none.status_code == 404


def test_lists_show_what_the_key_is_for_and_a_filter_gets_no_further(shared):
    customer, jobs = shared.customer, shared.jobs
    assert [one["id"] for one in customer.get("/venues").json()["venues"]] == [OURS]
    assert [one["id"] for one in customer.get("/jobs").json()["jobs"]] == [jobs[OURS]["id"]]
    assert customer.get("/jobs", params={"venue": THEIRS}).json()["jobs"] == []
    assert {one["id"] for one in shared.http.get("/venues").json()["venues"]} == {OURS, THEIRS}
    page = customer.get("/").text
    assert OURS in page
    assert THEIRS not in page


def test_a_key_for_one_venue_does_with_it_whatever_its_scope_allows(shared):
    customer, job = shared.customer, shared.jobs[OURS]
    assert customer.get(f"/venues/{OURS}").status_code == 200
    assert customer.get(f"/jobs/{job['id']}/preview.jpg").status_code == 200
    with customer.stream("GET", f"/venues/{OURS}/events") as events:
        assert "poses.current" in next(events.iter_lines())
    patched = customer.patch(
        f"/venues/{OURS}", content='{"name": "accept 0.2"}', headers={"Content-Type": "application/merge-patch+json"}
    )
    assert patched.status_code == 200
    again = customer.post(f"/jobs/{job['id']}/again")
    assert again.status_code == 202
    assert shared.end(again.json()["id"])["asked_by"] == "key customer"
    assert customer.post(f"/venues/{OURS}/restore", json={"revision": 1}).status_code == 200


def test_a_page_session_knows_what_its_key_knows(shared, folder):
    key = keys_in(folder).add("visitor", "read", venues=[OURS])
    with httpx.Client(base_url=shared.url) as browser:
        browser.post("/ui/sign-in", data={"key": key})
        assert browser.get(f"/ui/venues/{OURS}").status_code == 200
        assert browser.get(f"/ui/venues/{THEIRS}").status_code == 404
        assert browser.get("/metrics").status_code == 403


def test_the_command_makes_a_key_for_venues_and_lists_them(tmp_path):
    def esc(*arguments):
        return esc_here(tmp_path, "key", *arguments, **os.environ | {"ESC_DATA": str(tmp_path)})

    assert esc("add", "demo", "--scope", "read", "--venue", "b", "--venue", "a").stdout.startswith("esc_")
    assert esc("add", "all", "--scope", "read").returncode == 0
    assert [line.split("\t")[-1] for line in esc("list").stdout.splitlines()] == ["all", "a,b"]
    assert esc("add", "wrong", "--scope", "read", "--venue", "No Id").returncode == 2


def test_an_exchanged_key_stays_good_for_the_grace_and_no_longer(tmp_path):
    def esc(*arguments):
        return esc_here(tmp_path, "key", *arguments, **os.environ | {"ESC_DATA": str(tmp_path)})

    old = esc("add", "cron", "--scope", "calibrate", "--venue", "demo").stdout.strip()
    new = esc("rotate", "cron", "--grace", "2h").stdout.strip()
    found = {key.name: key for key in keys_in(tmp_path).all()}
    assert old != new
    assert found.keys() == {"cron", "cron-old"}
    assert (found["cron"].venues, found["cron"].scope, found["cron"].expires_at) == ({"demo"}, "calibrate", None)
    left = (found["cron-old"].expires_at - found["cron"].created_at).total_seconds()
    assert left == pytest.approx(7200, abs=1)
    assert esc("rotate", "cron", "--grace", "0m").returncode == 0
    assert {key.name: key.expired for key in keys_in(tmp_path).all()} == {"cron": False, "cron-old": True}
    assert esc("rotate", "nobody").returncode == 1
    assert esc("rotate", "cron", "--grace", "soon").returncode == 2


def test_a_key_for_one_venue_learns_of_no_other_key_and_of_no_address(shared):
    """Changes of others are told as those of another key, its own as they are; the owner sees all."""
    own = shared.customer.patch(
        f"/venues/{OURS}", content=b'{"name": "accept"}', headers={"Content-Type": "application/merge-patch+json"}
    )
    assert own.status_code == 200
    job = shared.jobs[OURS]["id"]
    told = {
        path: shared.customer.get(path).text
        for path in (
            f"/venues/{OURS}/history",
            "/jobs",
            "/jobs?fields=summary",
            f"/jobs/{job}",
            f"/ui/jobs/{job}",
            "/ui/jobs",
        )
    }
    told["page"] = shared.customer.get(f"/ui/venues/{OURS}").text
    told["events"] = first_events(shared.customer, OURS)
    told["job events"] = shared.customer.get(f"/jobs/{job}/events").text
    for path, text in told.items():
        assert "key owner" not in text, path
    others = [one["by"] for one in json.loads(told[f"/venues/{OURS}/history"])["revisions"]]
    assert {"name": "another key", "address": None, "request_id": None} in others
    assert {one["name"] for one in others} <= {"another key", "key customer"}
    assert "another key" in told["events"]
    assert "key customer" in told["events"]
    by = shared.http.get(f"/venues/{OURS}/history").json()["revisions"][-1]["by"]
    assert (by["name"], by["address"]) == ("key owner", "127.0.0.1")
    assert shared.http.get(f"/jobs/{job}").json()["asked_by"] == "key owner"


def first_events(client, venue_id):
    """The stream of a venue from its beginning, up to the change that the customer made."""
    read = ""
    with client.stream("GET", f"/venues/{venue_id}/events", headers={"Last-Event-ID": "0"}) as stream:
        for line in stream.iter_lines():
            read += line
            if "venue.changed" in read and "key customer" in read:
                break
    return read
