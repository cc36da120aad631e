"""`python -m tests.released.make_dumps COMMIT`: databases of a release as SQL, made by its own code in both homes.

Beside each dump stands what the release answered about it. They are made once for each release that this one upgrades.
"""

import argparse
import json
import sqlite3
import subprocess
import tempfile
from base64 import b64encode
from contextlib import closing
from pathlib import Path

from testbed.homes import Embedded, Home, Servers, environment, postgres_binaries, postgres_server, s3_server
from testbed.released import DUMPS, Release
from testbed.running import Service, upload, venue, wait_for
from tests.e2e.routes.test_live_reports import REPORT

SECRET = "whsec_" + b64encode(bytes(32)).decode()
POINTS = {"points": [{"world": [x, y], "pixel": [10 * x + 5, 10 * y + 5]} for x in (0, 1) for y in (0, 1)]}
EVERYTHING = {
    "accept": "all",
    "lens": "may-drift",
    "view": {"projection": "cylinder", "width_px": 1280},
    "recover": "accept",
    "alarms": {
        "rejected_in_a_row": 1,
        "moved_since_first_px": 40,
        "trend_m": 0.2,
        "knocked": True,
        "callback_url": "https://example.com/alarms",
    },
    "schedule": {
        "cron": "0 3 1 1 *",
        "time_zone": "Europe/Berlin",
        "frames": 2,
        "spacing_s": 7,
        "options": {"seed": 3},
    },
    "webhooks": [{"url": "https://example.com/told", "events": ["poses.changed", "venue.*"]}],
}
# What a release is asked about its database, and the version that upgrades it again.
ASKED = (
    "/venues",
    "/venues/everything",
    "/venues/everything/history",
    "/venues/everything/cameras/left/trend",
    "/jobs",
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("commit", help="the commit of the release")
    commit = parser.parse_args().commit
    DUMPS.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="esc-released-") as name:
        release = Release(Path(name) / "release", commit)
        answers = fill(Embedded(), Path(name) / "embedded", release)
        with closing(sqlite3.connect(Path(name) / "embedded" / "esc.sqlite")) as database:
            # A process that ended leaves nothing in the write-ahead log.
            keep("sqlite", list(database.iterdump()), answers)
        binaries = postgres_binaries()
        with postgres_server(binaries) as postgres, s3_server() as bucket:
            home = Servers(postgres, bucket)
            answers = fill(home, Path(name) / "servers", release)
            url = home.database_url(Path(name) / "servers")
            command = [binaries / "pg_dump", "--inserts", "--no-owner", "--no-privileges", url]
            dump = subprocess.run(command, check=True, capture_output=True, text=True).stdout
            # Commands of psql are none of the server.
            lines = [line for line in dump.splitlines() if line and not line.startswith(("--", "\\"))]
            keep("postgresql", lines, answers)


def keep(name: str, sql: list[str], answers: dict) -> None:
    (DUMPS / f"{name}.sql").write_text("\n".join(sql) + "\n")
    (DUMPS / f"{name}.json").write_text(json.dumps(answers, indent=1) + "\n")


def fill(home: Home, folder: Path, release: Release) -> dict:
    """Store venues of several kinds with a history, jobs of each end, and one that waits; return what is answered."""
    quiet = environment(home.settings(folder)) | release.environment
    whole = Service(folder, **quiet, ESC_SOURCES='["example.com"]', ESC_WEBHOOK_SECRET=SECRET).ready()
    everything = venue("everything", "refine") | EVERYTHING
    everything["field"] |= {
        "ridge": [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]],
        "uneven_m": 0.004,
        "sigma": {"width_m": 0.2},
    }
    everything["cameras"][0] |= {"ignore": [[[0, 40], [20, 40], [20, 47]]], "source": "http://u:p@example.com/a.jpg"}
    everything["cameras"][0]["light"] = {"gain": [1.06, 1.0, 0.94], "contrast": 0.1}
    everything["cameras"][1] |= {"source": "http://example.com/b.jpg"}
    everything["cameras"][1]["intrinsics"]["sigma"] = {"fx": 0.5}
    whole.http.put("/venues/everything", json=everything).raise_for_status()
    whole.calibrated("everything", headers={"Idempotency-Key": "first"}, callback_url="https://example.com/end")
    whole.calibrated("everything", shade=1, flat=True)
    whole.http.post("/venues/everything/restore", json={"revision": 1}).raise_for_status()
    whole.http.put("/venues/everything/live", json=REPORT).raise_for_status()
    for behaviour in ("reject", "partly", "fail", "knock", "contradict"):
        whole.calibrated(whole.venue(behaviour, behaviour), dry_run=behaviour == "partly")
    for request, files in (
        ("field/fit", upload()),
        ("cameras/left/locate", {"options": (None, json.dumps(POINTS))}),
        ("find", upload()),
    ):
        answer = whole.http.post(f"/venues/reject/{request}", files=files).raise_for_status()
        whole.end(answer.json()["id"])
    wait_for(lambda: not any(job["status"] in ("queued", "running") for job in whole.http.get("/jobs").json()["jobs"]))
    assert whole.stop() == 0
    # Without a worker, what comes waits.
    half = Service(folder, "serve", **quiet)
    waiting = half.submitted(half.venue("waiting"), headers={"Idempotency-Key": "waits"})
    assert half.job(waiting)["status"] == "queued"
    half.http.post(f"/jobs/{half.submitted(half.venue('cancelled'))}/cancel").raise_for_status()
    answers = {address: half.http.get(address).raise_for_status().json() for address in ASKED}
    assert half.stop() == 0
    return answers


if __name__ == "__main__":
    main()
