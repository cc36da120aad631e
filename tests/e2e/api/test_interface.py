"""The OpenAPI document against the service: schemathesis with all its checks, keys asked for.

ESC_TEST_EXAMPLES=500 makes up so many requests of each kind, from another seed every time.
"""

import json
import os
import random
import re
import subprocess
import sys
from pathlib import Path

import pytest

from testbed.running import Service, keys_in, upload, venue

HERE = Path(__file__).parent
ROOT = HERE.parents[2]
EXAMPLES = int(os.environ.get("ESC_TEST_EXAMPLES", "0"))
FEW = 8
# What must have happened, or the checks were about refusals only.
REACHED = {
    ("PUT", "/venues/*", 201),
    ("PATCH", "/venues/*", 200),
    ("PATCH", "/venues/*", 422),
    ("DELETE", "/venues/*", 204),
    ("POST", "/venues/*/calibrate", 202),
    ("GET", "/jobs/*", 200),
    ("GET", "/jobs/*/events", 200),
    ("GET", "/jobs/*/frames/0", 200),
    ("GET", "/jobs/*/poses", 200),
    ("GET", "/jobs/*/poses", 422),
    ("GET", "/venues/*/poses", 200),
    ("GET", "/venues/*/history", 200),
    ("GET", "/venues/*/cameras/left/trend", 200),
    ("POST", "/venues/*/restore", 200),
    ("GET", "/jobs/*/preview.jpg", 200),
    ("GET", "/jobs/*/overlay/left.jpg", 200),
    ("POST", "/jobs/*/cancel", 200),
    ("DELETE", "/jobs/*", 204),
    ("POST", "/jobs/*/reject", 200),
    ("PUT", "/venues/*", 412),
}


@pytest.fixture
def guarded(tmp_path):
    """A service that asks for keys and has a calibrated venue or two; its client has a key."""
    folder = tmp_path / "esc"
    folder.mkdir()
    key = keys_in(folder).add("ops", "admin")
    # A package keeps a core busy for seconds, and whoever comes meanwhile is told to come again; no zip is looked into.
    at_once = json.dumps([sys.executable, "-c", "import sys; sys.stdin.buffer.read(); print(end='PK')"])
    given = {"ESC_RATE_PER_S": "100000", "ESC_RATE_BURST": "100000", "ESC_STITCH_PROGRAM": at_once}
    service = Service(folder, **given).ready()
    service.http.headers["Authorization"] = f"Bearer {key}"
    yield service
    service.kill()


@pytest.mark.long
@pytest.mark.timeout(300 + EXAMPLES * 10)
def test_the_service_does_what_its_document_says_and_nothing_else(guarded, tmp_path):
    venues, doomed = [f"v{n}" for n in range(9)], [f"d{n}" for n in range(9)]
    for name in venues + doomed:
        guarded.http.put(f"/venues/{name}", json=venue(name)).raise_for_status()
    answers = [guarded.http.post(f"/venues/{name}/calibrate", files=upload()) for name in venues[:6]]
    jobs = [guarded.end(answer.json()["id"])["id"] for answer in answers]
    known = {"venues": venues, "doomed": doomed, "jobs": jobs[:4], "doomed_jobs": jobs[4:]}
    for name, values in known.items():
        (tmp_path / f"{name}.txt").write_text("".join(f'"{value}"\n' for value in values))
    (tmp_path / "schemathesis.toml").write_bytes((HERE / "schemathesis.toml").read_bytes())

    seed = random.randrange(2**32) if EXAMPLES else 1
    command = ["run", f"{guarded.url}/openapi.json", "--checks", "all", "--seed", seed]
    # A map of a lens keeps a core busy for seconds, and the machine may have other work.
    command += [
        "--request-timeout",
        60,
        "--max-examples",
        EXAMPLES or FEW,
        "--header",
        f"Authorization: {guarded.http.headers['Authorization']}",
    ]
    told = subprocess.run(
        [Path(sys.executable).parent / "schemathesis", *map(str, command)],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT), "COLUMNS": "120"},
        capture_output=True,
        text=True,
    )
    assert told.returncode == 0, told.stdout + told.stderr
    log = (guarded.data / "log").read_text()
    assert "Traceback" not in log
    requests = [entry for entry in map(json.loads, log.splitlines()) if entry.get("event") == "request"]
    reached = {
        (one["method"], re.sub("/(venues|jobs)/[^/]+", r"/\1/*", one["path"]), one["status"]) for one in requests
    }
    assert REACHED - reached == set()
    # 200 for whoever waits and sees the job's end.
    assert {("POST", "/venues/*/cameras/left/locate", status) for status in (200, 202)} & reached
    assert [one for one in requests if one["status"] >= 500] == []
