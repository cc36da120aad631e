"""Keys against a real server: access to each route."""

import json
import os
import re

import httpx
import pytest
from fastapi.routing import iter_route_contexts

from service.api.auth import GUESSES
from service.app import create_app
from service.pages.page_rendering import SIGN_IN, Page
from service.routes.contract.guarded import Guarded
from service.settings import Settings
from testbed.running import Service, keys_in, png, upload, venue, wait_for
from tests.e2e.commands import esc_here, esc_process
from tests.problems import problem_of
from tools.openapi import document

SCOPES = ("read", "calibrate", "admin")
# What the service can do is no secret.
OPEN = {
    "/livez",
    "/readyz",
    "/problems",
    "/problems/{kind}",
    "/refusals",
    "/refusals/{reason}",
    "/docs",
    "/docs/rapidoc-min.js",
    "/docs/scheme.js",
    "/docs/LICENSE.txt",
}
# The way to sign in, and what it is drawn with.
OPEN |= {"/ui/documents/{name}", "/favicon.ico", "/ui/static/{version}/{path:path}", "/ui/sign-in", "/ui/sign-out"}
NEEDED = {"GET": "read", "POST": "calibrate", "PUT": "admin", "PATCH": "admin", "DELETE": "admin"}
# Pages that show nothing but how to change something, a question that takes a body, and what changes no venue.
OTHERWISE = {
    ("GET", "/ui/venues/{venue_id}/calibrate"): "calibrate",
    ("GET", "/ui/venues/{venue_id}/ignore"): "admin",
    ("GET", "/ui/venues/{venue_id}/settings"): "admin",
    ("GET", "/ui/venues/{venue_id}/first-pose"): "admin",
    ("GET", "/ui/venues/{venue_id}/find"): "calibrate",
    ("GET", "/ui/plan"): "calibrate",
    ("GET", "/ui/new-venue"): "admin",
    ("GET", "/ui/new-venue/by-hand"): "admin",
    ("POST", "/ui/new-venue/plan"): "read",
    ("POST", "/ui/new-venue/calibration"): "admin",
    ("PUT", "/venues/{venue_id}/live"): "calibrate",
    ("GET", "/keys"): "admin",
    ("POST", "/keys"): "admin",
}
JOB = "01KAJ3Q6WZ5T3Y8R0N4M2C7B1D"


def bearer(key):
    return {"Authorization": f"Bearer {key}"}


@pytest.fixture(scope="module")
def keys(tmp_path_factory):
    """A key of each scope, and the folder they are for."""
    folder = tmp_path_factory.mktemp("guarded")
    store = keys_in(folder)
    return folder, {scope: store.add(scope, scope) for scope in SCOPES}


@pytest.fixture(scope="module")
def guarded(keys):
    """A service that has keys."""
    running = Service(keys[0])
    yield running
    assert running.stop() == 0


@pytest.fixture(scope="module")
def key(keys):
    return keys[1]


@pytest.fixture(scope="module")
def routes(tmp_path_factory):
    """Every method and path of the application."""
    app = create_app(Settings(data=tmp_path_factory.mktemp("routes")))
    yield list(iter_route_contexts(app.routes))
    app.state.context.queue.close()
    app.state.context.engine.dispose()


def esc(folder, *arguments, **environment):
    return esc_here(folder, *arguments, **os.environ | {"ESC_DATA": str(folder)} | environment)


def test_keys_are_said_to_be_of_this_machine_where_other_commands_go_to_a_service_elsewhere(tmp_path):
    made = esc_process(
        tmp_path, "key", "add", "cron", "--scope", "read", ESC_DATA=str(tmp_path), ESC_URL="https://esc.example.com"
    )
    assert made.returncode == 0
    assert "the service at ESC_URL (https://esc.example.com) is not asked" in made.stderr


def test_every_route_says_who_may_call_it_and_means_it(guarded, key, routes):
    for route in routes:
        if not isinstance(route.original_route, Guarded):
            assert route.path == "/openapi.json", f"{route.path} is not guarded"
            continue
        (method,) = route.methods
        needed = None if route.path in OPEN else OTHERWISE.get((method, route.path), NEEDED[method])
        path = route.path.replace(":path", "").format(
            job_id=JOB,
            venue_id="nowhere",
            camera="left",
            number=1,
            kind="not-found",
            reason="lines",
            version="0",
            path="page.css",
            name="refused",
            key_name="nobody",
        )
        # Who just may, who just may not, and a stranger.
        for caller in dict.fromkeys((None, SCOPES[max(0, SCOPES.index(needed) - 1)], needed) if needed else (None,)):
            answer = guarded.http.request(method, path, headers=bearer(key[caller]) if caller else {})
            expected = "let in" if caller == needed else 403 if caller else 401
            got = answer.status_code if answer.status_code in (401, 403) else "let in"
            if (method, path) == ("POST", SIGN_IN):
                # Its key is in the form, and there was none.
                got = "let in"
            if isinstance(route.original_route, Page) and answer.headers.get("location", "").startswith(SIGN_IN):
                got = 401
            assert (method, route.path, caller, got) == (method, route.path, caller, expected)


def test_found_cameras_of_a_new_venue_are_stored_by_an_admins_key_alone(guarded, key):
    site = {"id": "found", "field": {"template": "football"}, "cameras": [{"id": "left"}]}
    sent = [*upload(cameras=("left",)), ("site", (None, json.dumps(site)))]
    job = guarded.http.post("/venues/found/find", files=sent, headers=bearer(key["calibrate"])).json()
    ended = f"/jobs/{job['id']}"
    wait_for(lambda: guarded.http.get(ended, headers=bearer(key["read"])).json()["status"] == "succeeded")
    told = [
        guarded.http.post("/venues/found/adopt-found", json={"job": job["id"]}, headers=bearer(key[scope])).status_code
        for scope in ("read", "calibrate", "admin", "calibrate")
    ]
    assert told == [403, 403, 201, 200]


def test_the_document_says_which_scope_a_route_needs():
    made = document()
    assert made["components"]["securitySchemes"]["key"]["scheme"] == "bearer"
    assert made["paths"]["/venues/{venue_id}"]["put"]["security"] == [{"key": ["admin"]}]
    assert {"401", "403", "429"} <= made["paths"]["/venues/{venue_id}"]["put"]["responses"].keys()
    assert made["paths"]["/livez"]["get"]["security"] == []


def test_the_document_defines_the_world_and_tells_what_each_route_does():
    made = document()
    world = made["info"]["description"]
    for told in ("centre of the field", "`length_m`", "z up", "metres", "world to camera", "PUT /venues/{venue_id}"):
        assert told in world
    used = {tag for path in made["paths"].values() for operation in path.values() for tag in operation["tags"]}
    assert used == {tag["name"] for tag in made["tags"] if tag["description"]}
    for path in (*made["paths"].values(), *made["webhooks"].values()):
        for operation in path.values():
            assert operation["description"].replace("`", "").startswith(operation["summary"][:20])
            assert len(operation["summary"].split()) > 2, operation["summary"]
            # The page shows summaries as they are, and descriptions as Markdown.
            assert "`" not in operation["summary"]
    layer = made["paths"]["/jobs/{job_id}/stored/{camera}.png"]["get"]
    assert layer["summary"] == "Draw the field by the pose that was stored, to lay over a frame"


def test_a_browser_finds_an_icon_beside_what_names_none(guarded):
    assert guarded.http.get("/favicon.ico").headers["content-type"] == "image/svg+xml"


def test_refusals_are_problems_that_name_the_way_in(guarded, key):
    missing = guarded.http.get("/jobs")
    assert (missing.status_code, missing.headers["content-type"]) == (401, "application/problem+json")
    assert (missing.headers["www-authenticate"], missing.json()["type"]) == ("Bearer", "/problems/key-missing")
    unknown = guarded.http.get("/jobs", headers=bearer("esc_unknown"))
    assert unknown.headers["www-authenticate"] == 'Bearer error="invalid_token"'
    assert problem_of(unknown) == (401, "key-unknown")
    small = guarded.http.put("/venues/v", json=venue("v"), headers=bearer(key["calibrate"]))
    assert problem_of(small) == (403, "scope-too-small")
    assert (small.json()["expected"], small.json()["got"]) == ("admin", "calibrate")


def test_a_body_is_not_looked_at_before_the_key(guarded):
    answer = guarded.http.put("/venues/v", content=b"{", headers={"Content-Type": "application/json"})
    assert answer.status_code == 401


def test_from_the_venue_to_the_pose_with_the_keys_that_suffice(guarded, key, name):
    guarded.http.put(f"/venues/{name}", json=venue(name), headers=bearer(key["admin"])).raise_for_status()
    sent = guarded.http.post(f"/venues/{name}/calibrate", files=upload(), headers=bearer(key["calibrate"]))
    assert (sent.status_code, sent.json()["asked_by"]) == (202, "key calibrate")
    with guarded.http.stream("GET", f"/jobs/{sent.json()['id']}/events", headers=bearer(key["read"])) as events:
        assert "event: end" in events.read().decode()


def test_the_command_line_sends_its_key_and_helps_without_one(guarded, key, name, tmp_path):
    (tmp_path / "venue.json").write_text(json.dumps(venue(name)))
    for side in ("left", "right"):
        # Too large for the buffers of a socket: what refuses it must read it, or its answer is lost.
        (tmp_path / f"{side}.png").write_bytes(png() + bytes(30_000_000))

    def call(*arguments, api_key=""):
        return esc(tmp_path, *arguments, ESC_URL=guarded.url, ESC_API_KEY=api_key)

    put = call("venue", "put", "venue.json", api_key=key["admin"] + "\n")
    assert put.returncode == 0, put.stderr
    small = call("venue", "put", "venue.json", api_key=key["calibrate"])
    assert (small.returncode, "a key of scope admin; calibrate has calibrate" in small.stderr) == (1, True)
    for wrong in ("", "esc_unknown"):
        refused = call("calibrate", name, "left=left.png", "right=right.png", "--wait", api_key=wrong)
        assert refused.returncode == 1
        assert "Set ESC_API_KEY" in refused.stderr
        assert "esc_unknown" not in refused.stderr
    odd = call("venue", "list", api_key="zwei Wörter")
    assert (odd.returncode, "without spaces" in odd.stderr, "Wörter" in odd.stderr) == (2, True, False)


def test_keys_are_made_listed_and_removed_on_the_machine_of_the_service(start):
    service = start("serve")
    assert service.http.get("/jobs").status_code == 200
    made = esc(service.data, "key", "add", "cron", "--scope", "calibrate", "--days", "30")
    key = made.stdout.strip()
    assert (made.returncode, key.startswith("esc_")) == (0, True)
    wait_for(lambda: service.http.get("/jobs").status_code == 401)
    assert service.http.get("/jobs", headers=bearer(key)).status_code == 200
    assert service.stop() == 0

    name, scope, made_at, used_at, until, venues = esc(service.data, "key", "list").stdout.strip().split("\t")
    assert (name, scope, venues) == ("cron", "calibrate", "all")
    assert made_at <= used_at < until
    again = esc(service.data, "key", "add", "cron", "--scope", "read")
    assert (again.returncode, "There is a key cron already" in again.stderr) == (2, True)
    removed = esc(service.data, "key", "remove", "cron", "--yes")
    assert (removed.returncode, "No key is left" in removed.stderr) == (0, True)
    assert esc(service.data, "key", "remove", "cron", "--yes").returncode == 1
    assert key not in (service.data / "log").read_text()


@pytest.mark.parametrize("command", [("list",), ("remove", "cron", "--yes")])
def test_to_ask_for_the_keys_of_no_service_makes_none(tmp_path, command):
    answer = esc(tmp_path, "key", *command)
    assert (answer.returncode, "There is no service here" in answer.stderr) == (1, True)
    assert list(tmp_path.iterdir()) == []


def test_the_first_key_of_a_folder_is_said_to_be_that(tmp_path):
    first, second = (esc(tmp_path, "key", "add", name, "--scope", "read") for name in ("a", "b"))
    assert (first.returncode, "no service has used it yet" in first.stderr) == (0, True)
    assert (second.returncode, "no service has used it yet" in second.stderr) == (0, False)


@pytest.mark.parametrize("arguments", [("Bad name", "--scope", "read"), ("x", "--scope", "all"), ("x",)])
def test_a_key_needs_a_name_and_a_scope(tmp_path, arguments):
    assert esc(tmp_path, "key", "add", *arguments).returncode == 2


def test_beyond_this_machine_nobody_listens_without_keys(tmp_path):
    alone = esc_process(tmp_path, "serve", "--host", "0.0.0.0", "--port", "0", ESC_DATA=str(tmp_path))
    assert (alone.returncode, "esc key add NAME --scope admin" in alone.stderr) == (2, True)


@pytest.fixture(scope="module")
def beyond(tmp_path_factory):
    """A service that other machines reach; its address, and its keys."""
    folder = tmp_path_factory.mktemp("beyond")
    keys = keys_in(folder)
    keys.add("first", "admin")
    running = Service(folder, "serve", "--host", "0.0.0.0")
    yield f"http://127.0.0.1:{httpx.URL(running.url).port}", keys
    assert running.stop() == 0


def test_beyond_this_machine_a_key_is_asked_for(beyond):
    url, keys = beyond
    assert httpx.get(f"{url}/jobs").status_code == 401
    assert httpx.get(f"{url}/jobs", headers=bearer(keys.add("ops", "admin"))).status_code == 200
    assert httpx.get(f"{url}/livez").status_code == 200


def test_where_a_proxy_decides_who_may_call_it_can_be_switched_off(start, tmp_path):
    keys_in(tmp_path / "esc").add("ops", "admin")
    service = start("serve", "--host", "0.0.0.0", ESC_AUTH="off")
    assert httpx.get(f"http://127.0.0.1:{httpx.URL(service.url).port}/jobs").status_code == 200
    assert "ESC_AUTH=off" in (service.data / "log").read_text()


@pytest.mark.parametrize(("trusted", "second"), [("127.0.0.1", "key-unknown"), ("10.9.9.9", "too-many-unknown-keys")])
def test_who_guesses_is_told_apart_by_what_a_proxy_says_where_it_is_trusted(start, tmp_path, trusted, second):
    keys_in(tmp_path / "esc").add("ops", "admin")
    service = start("serve", FORWARDED_ALLOW_IPS=trusted)

    def guess(client):
        answer = service.http.get("/jobs", headers=bearer("esc_guessed") | {"X-Forwarded-For": client})
        return answer.json()["type"].rpartition("/")[2]

    assert [guess("192.0.2.1") for _ in range(GUESSES + 1)][-1] == "too-many-unknown-keys"
    assert guess("192.0.2.2") == second


def test_the_log_names_the_key_and_does_not_hold_it(guarded, key):
    for caller in (*key.values(), "esc_guessed"):
        guarded.http.get("/jobs", headers=bearer(caller))
    log = (guarded.data / "log").read_text()
    named = {line.get("key") for line in map(json.loads, log.splitlines()) if line.get("event") == "request"}
    assert set(SCOPES) <= named
    for secret in (*key.values(), "esc_guessed"):
        assert secret not in log


# Pages that the browsers of this machine show


@pytest.fixture(scope="module")
def open_to_all(tmp_path_factory):
    """A service without keys, called by its address, by localhost and by one name."""
    running = Service(tmp_path_factory.mktemp("open"), "serve", ESC_ALLOWED_HOSTS='["esc.truck.lan"]')
    yield running
    assert running.stop() == 0


@pytest.mark.parametrize(
    "host", ["127.0.0.1:8000", "localhost", "LOCALHOST:1", "[::1]:80", "10.0.0.7", "esc.truck.lan"]
)
def test_a_service_without_keys_answers_to_its_own_names(open_to_all, host):
    assert open_to_all.http.get("/jobs", headers={"Host": host}).status_code == 200


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:8000", "localhost.evil.example", "127.0.0.1.nip.io", "[", ""]
)
def test_and_to_no_other_name_that_was_made_to_point_to_it(open_to_all, host):
    answer = open_to_all.http.get("/jobs", headers={"Host": host})
    assert problem_of(answer) == (421, "host-unknown")
    assert "ESC_ALLOWED_HOSTS" in answer.json()["detail"]


@pytest.mark.parametrize("origin", ["https://evil.example", "http://127.0.0.1:1", "null", "http://[", ""])
def test_pages_of_other_origins_change_nothing(open_to_all, origin):
    for method, path in (("PUT", "/venues/v"), ("DELETE", "/venues/v"), ("POST", "/venues/v/calibrate")):
        answer = open_to_all.http.request(method, path, headers={"Origin": origin})
        assert problem_of(answer) == (403, "origin-foreign")


def test_pages_of_the_service_may(open_to_all):
    for origin in (open_to_all.url, "https://esc.truck.lan"):
        answer = open_to_all.http.put("/venues/v", json=venue("v"), headers={"Origin": origin})
        assert answer.is_success


def test_no_answer_may_be_embedded_or_guessed_at_elsewhere(open_to_all):
    for path in ("/jobs", "/docs", "/nowhere"):
        headers = open_to_all.http.get(path).headers
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["cross-origin-resource-policy"] == "same-origin"
        assert "access-control-allow-origin" not in headers


def test_a_key_is_enough_under_any_name(guarded, key):
    elsewhere = {"Host": "esc.example.com", "Origin": "https://planner.example.com"}
    assert guarded.http.get("/jobs", headers=bearer(key["read"]) | elsewhere).status_code == 200


# The documentation, in a truck without internet


def test_the_documentation_needs_nothing_from_elsewhere(open_to_all):
    page = open_to_all.http.get("/docs")
    assert page.headers["content-security-policy"].startswith("default-src 'none'; script-src 'self'")
    assert "://" not in page.text
    for script in re.findall(r'src="([^"]+)"', page.text):
        answer = open_to_all.http.get(script)
        assert (answer.status_code, answer.headers["content-type"]) == (200, "text/javascript; charset=utf-8")
    assert "MIT License" in open_to_all.http.get("/docs/LICENSE.txt").text
