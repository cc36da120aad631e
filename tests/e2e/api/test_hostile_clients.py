"""Clients that send slowly, too much, nonsense or nothing: each is let go in time, and nothing of them stays.

Connections are real and what goes over them is written by hand: no client library sends such requests.
"""

import json
import os
import socket
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from itertools import repeat
from pathlib import Path

import httpx
import pytest

from testbed.running import Service, png, wait_for
from tests.problems import problem_of

STALL_S, WHOLE_S = 1, 2
# Connections are looked at once a second, and a test machine is busy.
SLACK_S = 10
FORM = "Content-Type: multipart/form-data; boundary=x\r\n"
BOUNDARY = b"--x\r\nContent-Disposition: form-data; name="
JSON = "Content-Type: application/json\r\n"


@pytest.fixture(scope="module")
def impatient(tmp_path_factory):
    """A service that gives clients little time and little room."""
    folder = tmp_path_factory.mktemp("impatient")
    (folder / "tmp").mkdir()
    running = Service(
        folder,
        ESC_STALL_TIMEOUT_S=str(STALL_S),
        ESC_REQUEST_TIMEOUT_S=str(WHOLE_S),
        ESC_MAX_BODY_MB="2",
        TMPDIR=str(folder / "tmp"),
    ).ready()
    running.venue("stadium")
    yield running
    assert running.stop() == 0
    log = (folder / "log").read_text()
    assert "Traceback" not in log
    assert '"status": 500' not in log


@pytest.fixture
def connection(impatient):
    with closing(connect(impatient)) as connection:
        yield connection


def connect(service: Service) -> socket.socket:
    url = httpx.URL(service.url)
    return socket.create_connection((url.host, url.port), timeout=30)


def head(line: str, headers: str = "") -> bytes:
    return f"{line} HTTP/1.1\r\nHost: 127.0.0.1\r\n{headers}\r\n".encode()


CALIBRATE = "POST /venues/stadium/calibrate"


def answer(connection: socket.socket, drip=(), every_s: float = 0.1) -> tuple[bytes, float]:
    """All that comes until the connection ends, and when that was, while `drip` goes out bit by bit."""
    begun, got, rest = time.monotonic(), b"", iter(drip)
    connection.settimeout(every_s)
    while time.monotonic() - begun < 60:
        try:
            if (more := next(rest, None)) is not None:
                connection.sendall(more)
            chunk = connection.recv(65536)
        except TimeoutError:
            continue
        except OSError:
            break
        if not chunk:
            break
        got += chunk
    else:
        pytest.fail("the connection was not ended")
    return got, time.monotonic() - begun


def status(got: bytes) -> int:
    return int(got.split()[1])


def problem(got: bytes) -> str:
    """The kind of the last problem that came."""
    fields, _, body = got.rpartition(b"\r\n\r\n")
    assert b"content-type: application/problem+json" in fields.lower()
    return json.loads(body)["type"]


# Slow ones


SLOW = {
    "says nothing": (b"", (), STALL_S),
    "a head without an end": (b"GET /jobs HTTP/1.1\r\nHost: x\r\n", repeat(b"A: b\r\n"), STALL_S),
    "a head that stops": (b"GET /jobs HTTP/1.1\r\nHos", (), STALL_S),
    "a body that stops": (head(CALIBRATE, FORM + "Content-Length: 5000\r\n") + b"--x\r\n", (), STALL_S),
    "a frame byte by byte": (
        head(CALIBRATE, FORM + "Content-Length: 5000\r\n") + BOUNDARY + b'"left"; filename="f"\r\n\r\n',
        repeat(b"x"),
        WHOLE_S,
    ),
    "a venue byte by byte": (head("PUT /venues/v", JSON + "Content-Length: 5000\r\n"), repeat(b" "), WHOLE_S),
    "chunks byte by byte": (
        head("PUT /venues/v", JSON + "Transfer-Encoding: chunked\r\n"),
        repeat(b"1\r\n \r\n"),
        WHOLE_S,
    ),
    "a body that was promised": (head(CALIBRATE, FORM + "Expect: 100-continue\r\nContent-Length: 9\r\n"), (), STALL_S),
}


def test_who_sends_too_slowly_is_told_and_let_go(impatient):
    def told_in_time(kind):
        first, drip, limit_s = SLOW[kind]
        with closing(connect(impatient)) as connection:
            connection.sendall(first)
            got, took_s = answer(connection, drip)
        return problem(got), limit_s <= took_s < limit_s + SLACK_S

    with ThreadPoolExecutor(len(SLOW)) as senders:
        told = dict(zip(SLOW, senders.map(told_in_time, SLOW), strict=True))
    assert told == dict.fromkeys(SLOW, ("/problems/too-slow", True))


def test_who_goes_on_sending_after_the_answer_is_let_go(connection):
    connection.sendall(head("POST /venues/nowhere/calibrate", FORM + "Content-Length: 1000000\r\n"))
    got, took_s = answer(connection, repeat(b"-"))
    assert problem(got) == "/problems/venue-not-found"
    assert took_s < WHOLE_S + SLACK_S


def test_who_takes_no_answer_is_let_go(impatient):
    with closing(socket.socket()) as connection:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        url = httpx.URL(impatient.url)
        connection.connect((url.host, url.port))
        connection.sendall(head("GET /docs/rapidoc-min.js") * 50)
        port = connection.getsockname()[1]
        wait_for(lambda: holds(impatient, port))
        wait_for(lambda: not holds(impatient, port))


def test_who_is_slow_holds_up_nobody(impatient):
    slow = [connect(impatient) for _ in range(200)]
    for one in slow:
        one.sendall(b"GET /jobs HTTP/1.1\r\n")
    assert impatient.http.get("/jobs").status_code == 200
    for one in slow:
        assert problem(answer(one)[0]) == "/problems/too-slow"
        one.close()


def test_an_upload_that_is_only_slow_arrives(impatient):
    frames = [(name, (f"{name}.png", png(shade=9))) for name in ("left", "right")]
    request = impatient.http.build_request("POST", "/venues/stadium/calibrate", files=frames)
    body = request.read()

    def slowly():
        for start in range(0, len(body), -(-len(body) // 6)):
            yield body[start : start + -(-len(body) // 6)]
            time.sleep(0.3)

    sent = impatient.http.post("/venues/stadium/calibrate", content=slowly(), headers=request.headers)
    assert sent.status_code in (200, 202)
    impatient.end(sent.json()["id"])


# Nonsense


NONSENSE = {
    "tls": b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03" + bytes(500),
    "http/2": b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
    "no http": b"HELP\r\n\r\n",
    "no host": b"GET /livez HTTP/1.1\r\n\r\n",
    "two hosts": head("GET /livez", "Host: other\r\n"),
    "a huge field": head("GET /livez", f"X: {'x' * 200_000}\r\n"),
    "thousands of fields": head("GET /livez", "".join(f"X-{n}: x\r\n" for n in range(20_000))),
    "a huge address": head(f"GET /{'x' * 200_000}"),
    "a NUL in a field": head("GET /livez", "X: a\0b\r\n"),
    "a NUL in the address": head("GET /li\0vez"),
    "bytes beyond ASCII in the address": b"GET /\xff\xfe HTTP/1.1\r\nHost: x\r\n\r\n",
    "two lengths": head(CALIBRATE, FORM + "Content-Length: 5\r\nContent-Length: 6\r\n"),
    "a negative length": head(CALIBRATE, FORM + "Content-Length: -5\r\n"),
    "a length that is none": head(CALIBRATE, FORM + "Content-Length: many\r\n"),
    "an unknown transfer coding": head(CALIBRATE, FORM + "Transfer-Encoding: rot13\r\n"),
    "a chunk of no size": head(CALIBRATE, FORM + "Transfer-Encoding: chunked\r\n") + b"zz\r\n",
    "a chunk of no size after the answer": head("POST /nowhere", "Transfer-Encoding: chunked\r\n") + b"zz\r\n",
    "a length and chunks": head(CALIBRATE, FORM + "Content-Length: 5\r\nTransfer-Encoding: chunked\r\n") + b"zz\r\n",
    "more than the length says": head("GET /livez", "Content-Length: 1\r\n") + b"abc\r\n\r\n",
}


@pytest.mark.parametrize("kind", NONSENSE)
def test_what_is_no_http_is_refused_at_once(connection, kind):
    try:
        connection.sendall(NONSENSE[kind])
    except OSError:
        return  # It did not even hear it to its end.
    got, took_s = answer(connection)
    # A closing socket with unread bytes may take the answer along.
    assert got == b"" or problem(got) in ("/problems/malformed-request", "/problems/not-found")
    assert took_s < STALL_S + SLACK_S


def test_a_length_beyond_all_numbers_is_too_large(connection):
    connection.sendall(head(CALIBRATE, FORM + f"Connection: close\r\nContent-Length: {'9' * 19}\r\n"))
    assert problem(answer(connection)[0]) == "/problems/body-too-large"


def test_a_form_where_a_document_is_asked_for_is_refused_before_it_is_read(connection):
    connection.sendall(head("PUT /venues/v", FORM + "Content-Length: 1000000\r\n"))
    assert problem(answer(connection)[0]) == "/problems/not-json"


def test_chunks_without_end_are_cut_off(connection):
    connection.sendall(head("PUT /venues/v", JSON + "Transfer-Encoding: chunked\r\n"))
    many = b"10000\r\n" + b" " * 65536 + b"\r\n"
    got, took_s = answer(connection, repeat(many), every_s=0.01)
    assert problem(got) == "/problems/body-too-large"
    assert took_s < WHOLE_S + SLACK_S


def test_who_leaves_in_the_middle_is_forgotten(impatient):
    for part in (b"", b"GET /jo", head(CALIBRATE, FORM + "Content-Length: 5000\r\n") + b"--x\r\nabc"):
        with closing(connect(impatient)) as connection:
            connection.sendall(part)
            port = connection.getsockname()[1]
            wait_for(lambda port=port: holds(impatient, port))
        wait_for(lambda port=port: not holds(impatient, port))


# Forms that are none


def part(name: str, more: str = "", content: bytes = b"x") -> bytes:
    return BOUNDARY + f"{name}{more}\r\n\r\n".encode("utf-8", "surrogateescape") + content + b"\r\n"


FORMS = {
    "nothing": b"",
    "no parts": b"--x--\r\n",
    "garbage": os.urandom(5000),
    "parts without an end": part('"left"', '; filename="f"', png()) * 3,
    "thousands of parts": part('"left"', '; filename="f"') * 20_000 + b"--x--\r\n",
    "thousands of fields": part('"a"') * 20_000 + b"--x--\r\n",
    "a name up the tree": part('"../../left"', '; filename="f"', png()) + b"--x--\r\n",
    "an absolute name": part('"/etc/passwd"', '; filename="f"', png()) + b"--x--\r\n",
    "a NUL in a name": part('"le\0ft"', '; filename="f"', png()) + b"--x--\r\n",
    "no name": b"--x\r\nContent-Disposition: form-data\r\n\r\nx\r\n--x--\r\n",
    "an empty name": part('""', '; filename="f"', png()) + b"--x--\r\n",
    "no disposition": b"--x\r\nContent-Type: image/png\r\n\r\n" + png() + b"\r\n--x--\r\n",
    "a name that is no UTF-8": part('"\udcff\udcfe"', '; filename="f"', png()) + b"--x--\r\n",
    "a huge name": part(f'"{"x" * 100_000}"', '; filename="f"', png()) + b"--x--\r\n",
    "a huge field in a part": part('"left"', f"\r\nX: {'x' * 100_000}") + b"--x--\r\n",
    "a thousand fields in a part": part('"left"', "\r\nX: x" * 1000) + b"--x--\r\n",
    "a form in a part": part('"left"', '; filename="f"\r\nContent-Type: multipart/mixed; boundary=x') + b"--x--\r\n",
    "a part in base64": part('"left"', '; filename="f"\r\nContent-Transfer-Encoding: base64', b"eA==") + b"--x--\r\n",
    "an empty part": part('"left"', '; filename="f"', b"") + part('"right"', '; filename="f"', b"") + b"--x--\r\n",
    "options without an end": part('"options"', "", b'{"a":' * 10_000) + b"--x--\r\n",
}


@pytest.mark.parametrize("kind", FORMS)
def test_a_form_that_is_none_is_refused(impatient, kind):
    headers = {"Content-Type": "multipart/form-data; boundary=x"}
    refused = impatient.http.post("/venues/stadium/calibrate", content=FORMS[kind], headers=headers)
    assert refused.status_code in (400, 413, 422)
    assert refused.headers["content-type"] == "application/problem+json"


@pytest.mark.parametrize("boundary", ["", "=", "x" * 10_000, '"', "\xff", "x; charset=utf-7", "a b c"])
def test_a_boundary_that_is_none_is_refused(impatient, boundary):
    headers = {"Content-Type": f"multipart/form-data; boundary={boundary}".encode("latin-1")}
    refused = impatient.http.post("/venues/stadium/calibrate", content=FORMS["no name"], headers=headers)
    assert refused.status_code in (400, 422)


@pytest.mark.parametrize("coding", ["gzip", "br", "deflate, gzip", "nonsense"])
def test_a_packed_body_is_refused(impatient, coding):
    refused = impatient.http.put("/venues/v", content=b"\x1f\x8b", headers={"Content-Encoding": coding})
    assert problem_of(refused) == (415, "encoded-body")
    assert refused.headers["accept-encoding"] == "identity"


# What stays of it


@pytest.mark.long
def test_a_thousand_hostile_requests_leave_nothing_behind(impatient):
    impatient.calibrated("stadium", 200)

    def attack() -> None:
        for body in FORMS.values():
            impatient.http.post(
                "/venues/stadium/calibrate", content=body, headers={"Content-Type": "multipart/form-data; boundary=x"}
            )
        for nonsense in NONSENSE.values():
            with closing(connect(impatient)) as connection:
                connection.sendall(nonsense[:10_000])
        unheard_of = os.urandom(8).hex()
        for method, path in ((unheard_of, "/jobs"), ("GET", f"/{unheard_of}"), ("DELETE", f"/venues/{unheard_of}")):
            impatient.http.request(method, path)

    metrics(impatient)
    for _ in range(5):
        attack()
    files, series = stored(impatient), metrics(impatient)
    memory_kb, connected = resident_kb(impatient), sockets(impatient)
    for _ in range(20):
        attack()
    wait_for(lambda: sockets(impatient) <= connected)
    assert stored(impatient) == files
    assert list((impatient.data / "tmp").iterdir()) == []
    assert metrics(impatient) == series
    assert resident_kb(impatient) < 1.05 * memory_kb


def stored(service: Service) -> list[str]:
    return sorted(str(file) for file in (service.data / "blobs").rglob("*"))


def resident_kb(service: Service) -> int:
    (line,) = [line for line in proc(service, "status").read_text().splitlines() if line.startswith("VmRSS")]
    return int(line.split()[1])


def sockets(service: Service) -> int:
    return sum(str(file.readlink()).startswith("socket:") for file in proc(service, "fd").iterdir())


def holds(service: Service, port: int) -> bool:
    """True if the service has an open socket to this port of ours."""
    ends = [line.split() for line in proc(service, "net/tcp").read_text().splitlines()[1:]]
    server = f"{httpx.URL(service.url).port:04X}"
    sockets = {end[9] for end in ends if end[1].endswith(f":{server}") and end[2].endswith(f":{port:04X}")}
    return bool(sockets - {"0"})


def metrics(service: Service) -> set[str]:
    """Names of all metrics: one more for each method and path that is counted apart."""
    return {line.rpartition(" ")[0] for line in service.http.get("/metrics").text.splitlines()}


def proc(service: Service, file: str) -> Path:
    return Path(f"/proc/{service.process.pid}/{file}")
