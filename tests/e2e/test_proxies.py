"""A real nginx and a real Caddy in front, by the samples that operators copy."""

import shutil
import socket
import threading
import time
import zlib
from contextlib import ExitStack
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import httpx
import pytest

from testbed.parameters import try_first
from testbed.running import DEADLINE_S, Service, keys_in, png, venue
from tests.e2e.proxies import NAME, STALL_S, Caddy, Nginx, SignInProxy
from tests.e2e.routes.event_stream import Stream

# Beside the chunks of a PNG: one that no reader knows.
LARGE_MB, FRAMES = 40, {"left": 3, "right": 2}


@pytest.fixture(scope="module")
def keyed(tmp_path_factory):
    """A service with a key that is patient for seconds only."""
    folder = tmp_path_factory.mktemp("behind")
    key = keys_in(folder).add("ops", "admin")
    running = Service(folder, ESC_STALL_TIMEOUT_S=str(STALL_S), ESC_MAX_BODY_MB="256").ready()
    yield running, key
    running.kill()


@pytest.fixture(scope="module", params=try_first([Nginx, Caddy]), ids=lambda kind: kind.program)
def proxy(request, keyed, missing, tmp_path_factory):
    if shutil.which(request.param.program) is None:
        missing(request.param.program)
    one = request.param(tmp_path_factory.mktemp(request.param.program), keyed[0])
    yield one
    one.stop()


@pytest.fixture
def http(proxy, keyed, name):
    with proxy.client(keyed[1]) as client:
        client.put(f"/venues/{name}", json=venue(name)).raise_for_status()
        yield client


def large_png() -> bytes:
    """A small picture with a large chunk."""
    data = bytes(LARGE_MB * 10**6)
    chunk = len(data).to_bytes(4, "big") + b"prIv" + data
    picture = png()
    return picture[:33] + chunk + zlib.crc32(b"prIv" + data).to_bytes(4, "big") + picture[33:]


@pytest.mark.long
def test_an_upload_of_200_megabytes_arrives(http, name):
    frame = large_png()
    files = [(camera, (f"{camera}.png", frame)) for camera, count in FRAMES.items() for _ in range(count)]
    sent = http.post(f"/venues/{name}/calibrate", files=files)
    assert (sent.status_code, sent.headers["location"]) == (202, f"/jobs/{sent.json()['id']}")
    ended = http.get(sent.headers["location"], params={"wait": 60}).json()
    assert ended["status"] == "succeeded"


def test_what_is_too_large_or_has_no_key_is_refused_by_the_service_itself(http, proxy, name):
    files = [("left", ("left.png", bytes(49 * 10**6))), ("right", ("right.png", png()))]
    refused = http.post(f"/venues/{name}/calibrate", files=files)
    assert (refused.status_code, refused.headers["content-type"]) == (413, "application/problem+json")
    with proxy.client(Cookie="_oauth2_proxy=unknown") as stranger:
        assert stranger.put(f"/venues/{name}", json=venue(name)).json()["type"] == "/problems/key-missing"


def test_events_arrive_when_they_happen(http, name):
    with http.stream("GET", f"/venues/{name}/events", params={"events": "poses.changed"}) as answer:
        stream = Stream(answer)
        assert stream.next()["event"] == "poses.current"
        moved = venue(name)
        moved["cameras"][0]["pose"]["position"][0] += 1
        begun = time.monotonic()
        http.put(f"/venues/{name}", json=moved).raise_for_status()
        assert stream.next()["data"]["data"]["changed"] == ["left"]
        assert time.monotonic() - begun < 5


def test_tags_and_conditions_go_through(http, name):
    tag = http.get(f"/venues/{name}").headers["etag"]
    assert http.get(f"/venues/{name}", headers={"If-None-Match": tag}).status_code == 304
    changed = http.put(f"/venues/{name}", json=venue(name, "renamed"), headers={"If-Match": tag})
    assert changed.status_code == 200
    assert http.put(f"/venues/{name}", json=venue(name), headers={"If-Match": tag}).status_code == 412


def test_guesses_are_limited_by_the_address_of_who_guesses_whatever_they_say_about_themselves(proxy):
    guessing, another = proxy.addresses
    with proxy.client("esc_wrong", guessing) as guesser, proxy.client("esc_wrong", another) as other:
        codes = [
            guesser.get("/venues", headers={"X-Forwarded-For": f"9.9.9.{number}"}).status_code for number in range(13)
        ]
        assert (set(codes[:10]), codes[-1]) == ({401}, 429)
        assert other.get("/venues").status_code == 401


def test_the_cookie_of_the_page_stays_within_https_and_plain_http_leads_there(proxy, keyed):
    with proxy.client(Origin=proxy.url) as browser:
        signed_in = browser.post("/ui/sign-in", data={"key": keyed[1], "next": "/"})
        assert signed_in.status_code == 303
        assert "Secure" in signed_in.headers["set-cookie"]
    plain = httpx.get(f"http://{NAME}:{proxy.http_port}/venues", follow_redirects=False)
    assert plain.status_code in (301, 308)
    assert plain.headers["location"].startswith(f"https://{NAME}")


def test_slow_clients_are_let_go_and_hold_up_nobody(proxy, keyed, http, name):
    head = (
        f"POST /venues/{name}/calibrate HTTP/1.1\r\nHost: {NAME}\r\nAuthorization: Bearer {keyed[1]}\r\n"
        "Content-Type: multipart/form-data; boundary=b\r\nContent-Length: 1000000\r\n\r\n--b\r\n"
    )
    with ExitStack() as connections:
        slow = []
        for _ in range(30):
            plain = socket.create_connection(("127.0.0.1", proxy.https_port), timeout=DEADLINE_S)
            slow.append(connections.enter_context(proxy.trusted.wrap_socket(plain, server_hostname=NAME)))
            slow[-1].sendall(head.encode())
        begun = time.monotonic()
        assert http.get(f"/venues/{name}").status_code == 200
        assert time.monotonic() - begun < 5
        # They hear that they are too slow or too many, or nothing (of Caddy 2.6 an empty 200): not that a job began.
        assert not [answer for answer in (one.recv(4096) for one in slow) if b" 202 " in answer]


@pytest.fixture
def sign_in():
    """What oauth2-proxy answers: 202 to whom it knows by a cookie, 401 to others."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(202 if "_oauth2_proxy=known" in self.headers.get("Cookie", "") else 401)
            self.send_header("Content-Length", "0")
            self.end_headers()

        def log_message(self, *_):
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True).start()
        yield f"127.0.0.1:{server.server_port}"
        server.shutdown()


def test_people_who_signed_in_at_a_provider_have_the_key_of_the_proxy_and_programs_their_own(
    keyed, sign_in, missing, tmp_path
):
    if shutil.which(Caddy.program) is None:
        missing(Caddy.program)
    service, key = keyed
    reader = keys_in(service.data).add("people", "read")
    proxy = SignInProxy(tmp_path, service, sign_in, reader)
    try:
        with proxy.client(Cookie="_oauth2_proxy=unknown") as stranger:
            sent = stranger.get("/ui/jobs")
            place = f"/oauth2/sign_in?rd=https://{NAME}:{proxy.https_port}/ui/jobs"
            assert (sent.status_code, sent.headers["location"]) == (302, place)
        with proxy.client(Cookie="_oauth2_proxy=known") as person:
            assert person.get("/ui/jobs").status_code == 200
            assert person.get("/venues").status_code == 200
            refused = person.put("/venues/theirs", json=venue("theirs"))
            assert refused.json()["type"] == "/problems/scope-too-small"
        with proxy.client(key) as program:
            assert program.get("/keys").status_code == 200
        with proxy.client("esc_of_nobody", Cookie="_oauth2_proxy=known") as program:
            assert program.get("/venues").json()["type"] == "/problems/key-unknown"
    finally:
        proxy.stop()
