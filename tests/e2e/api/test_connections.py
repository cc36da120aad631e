"""Many clients at once: strangers who say nothing, and those whose answers are held."""

import resource
import socket
import subprocess
import sys
import time
from contextlib import ExitStack, closing, contextmanager

import httpx
import pytest

from testbed.running import Service, upload, wait_for

CONNECTIONS, STRANGERS = 60, 400
# Limit of open files: its own, and those of the connections above.
OPEN_FILES = 260
ANSWER_S = 10


@pytest.fixture(scope="module")
def crowded(tmp_path_factory):
    """A service for few clients, which may open few files."""
    limits = {"ESC_CONNECTIONS": str(CONNECTIONS), "ESC_FOLLOWERS": "2", "ESC_WAITERS": "2"}
    running = Service(tmp_path_factory.mktemp("crowded"), ESC_STALL_TIMEOUT_S="120", **limits).ready()
    resource.prlimit(running.process.pid, resource.RLIMIT_NOFILE, (OPEN_FILES, OPEN_FILES))
    running.venue("stadium", "accept 1")
    yield running
    assert running.stop() == 0
    assert '"status": 500' not in (running.data / "log").read_text()


@contextmanager
def strangers(service, say=b""):
    """Connections that say so much and no more."""
    url = httpx.URL(service.url)
    with ExitStack() as stack:
        for _ in range(STRANGERS):
            one = stack.enter_context(closing(socket.create_connection((url.host, url.port), timeout=30)))
            one.setblocking(False)
            try:
                one.send(say)
            except OSError:
                continue
        yield


def asked(service, path, **more):
    """An answer to somebody who has just connected, and its seconds."""
    begun = time.monotonic()
    return httpx.get(service.url + path, timeout=30, **more), time.monotonic() - begun


SAYING = {
    "nothing": b"",
    "half a head": b"GET /livez HTTP/1.1\r\nHost: ",
    "no body": b"POST /nowhere HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 100\r\n\r\n",
}


@pytest.mark.parametrize("say", SAYING.values(), ids=SAYING)
def test_strangers_who_hardly_say_anything_keep_nobody_out(crowded, say):
    with strangers(crowded, say):
        for path in ("/livez", "/venues/stadium"):
            answer, seconds = asked(crowded, path)
            assert (answer.status_code, seconds < ANSWER_S) == (200, True)
        with httpx.Client(base_url=crowded.url, timeout=60) as http:
            files = [(side, ("f.png", b"no picture")) for side in ("left", "right") for _ in range(16)]
            assert http.post("/venues/stadium/calibrate", files=files).status_code == 422


def test_whose_answer_is_held_is_not_put_out_by_strangers(crowded):
    follow = httpx.stream("GET", f"{crowded.url}/venues/stadium/events?events=venue.*", timeout=60)
    with follow as events:
        lines = events.iter_lines()
        wait_for(lambda: next(lines).startswith("data:"))
        with strangers(crowded):
            job = httpx.post(crowded.url + "/venues/stadium/calibrate", files=upload(7)).raise_for_status().json()["id"]
            answer, _ = asked(crowded, f"/jobs/{job}", params={"wait": 30})
            assert answer.json()["status"] == "succeeded"
            crowded.http.close()
            crowded.http = httpx.Client(base_url=crowded.url, timeout=60)
            crowded.venue("stadium", "accept 1 ")
        wait_for(lambda: "venue." in next(lines))


def test_only_so_many_answers_are_held_for_jobs(crowded):
    with ExitStack() as stack:
        stack.enter_context(crowded.jobs_held("long"))
        job = crowded.submitted(crowded.venue("long"))
        held = []
        for _ in range(2):
            stream = stack.enter_context(httpx.stream("GET", f"{crowded.url}/jobs/{job}/events", timeout=30))
            held.append(stream.iter_lines())
            assert next(held[-1]) == "event: progress"
        for path in (f"/jobs/{job}/events", f"/jobs/{job}?wait=5"):
            refused, _ = asked(crowded, path)
            assert (refused.status_code, refused.headers["retry-after"]) == (503, "5")
            assert "ESC_WAITERS" in refused.json()["detail"]
        assert asked(crowded, f"/jobs/{job}")[0].status_code == 200
    wait_for(lambda: asked(crowded, f"/jobs/{job}?wait=5")[0].status_code == 200)
    crowded.end(job)


SAY = """
import resource
from service.api.file_descriptors import most_connections
from service.settings import Settings
print(most_connections(Settings()), *resource.getrlimit(resource.RLIMIT_NOFILE))
"""


def limits(soft, hard, **settings):
    """Connections and both limits, as a process that may open so many files has them, and its warnings."""
    said = subprocess.run(
        ["prlimit", f"--nofile={soft}:{hard}", sys.executable, "-c", SAY],
        env={"PATH": "/usr/bin", "ESC_LOG_FORMAT": "json", **settings},
        capture_output=True,
        text=True,
        check=True,
    ).stdout.splitlines()
    return [int(word) for word in said[-1].split()], " ".join(said[:-1])


def test_the_soft_limit_of_open_files_is_raised_to_the_hard_one():
    assert limits(300, 10_000) == ([4000, 10_000, 10_000], "")


def test_settings_that_cannot_be_had_are_told():
    (most, *_), said = limits(300, 1024)
    assert most == 1024 - 256 - 16
    assert "LimitNOFILE" in said
    assert "ESC_FOLLOWERS" in said
    assert limits(300, 1024, ESC_CONNECTIONS="500", ESC_FOLLOWERS="100", ESC_WAITERS="100") == ([500, 1024, 1024], "")
