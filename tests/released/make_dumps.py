"""`python -m tests.released.make_dumps`: databases of 0.1.0 as SQL, made by its own code in both homes.

They were made once and are kept: what later releases have to open is what these hold.
"""

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

SECRET = "whsec_" + b64encode(bytes(32)).decode()
ALARMS = {"rejected_in_a_row": 1, "moved_since_first_px": 40, "callback_url": "https://example.com/alarms"}
POINTS = {"points": [{"world": [x, y], "pixel": [10 * x + 5, 10 * y + 5]} for x in (0, 1) for y in (0, 1)]}


def main() -> None:
    DUMPS.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="esc-released-") as name:
        release = Release(Path(name) / "release")
        fill(Embedded(), Path(name) / "embedded", release)
        with closing(sqlite3.connect(Path(name) / "embedded" / "esc.sqlite")) as database:
            # A process that ended leaves nothing in the write-ahead log.
            (DUMPS / "sqlite.sql").write_text("\n".join(database.iterdump()) + "\n")
        binaries = postgres_binaries()
        with postgres_server(binaries) as postgres, s3_server() as bucket:
            home = Servers(postgres, bucket)
            fill(home, Path(name) / "servers", release)
            url = home.database_url(Path(name) / "servers")
            dump = [binaries / "pg_dump", "--inserts", "--no-owner", "--no-privileges", url]
            said = subprocess.run(dump, check=True, capture_output=True, text=True).stdout
            # Commands of psql are none of the server.
            lines = [line for line in said.splitlines() if line and not line.startswith(("--", "\\"))]
            (DUMPS / "postgresql.sql").write_text("\n".join(lines) + "\n")


def fill(home: Home, folder: Path, release: Release) -> None:
    """Venues of several kinds with a history, jobs of each end, and one that waits."""
    quiet = environment(home.settings(folder)) | release.environment
    told = {"ESC_SOURCES": '["example.com"]', "ESC_WEBHOOK_SECRET": SECRET}
    whole = Service(folder, **quiet, **told).ready()
    everything = venue("everything", "accept")
    everything["field"] |= {"ridge": [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]]}
    everything["cameras"][0] |= {"ignore": [[[0, 40], [20, 40], [20, 47]]], "source": "http://u:p@example.com/a.jpg"}
    everything["cameras"][1] |= {"source": "http://example.com/b.jpg"}
    everything["cameras"][1]["intrinsics"]["sigma"] = {"fx": 0.5}
    everything |= {
        "accept": "all",
        "lens": "may-drift",
        "alarms": ALARMS,
        "schedule": {"cron": "0 3 1 1 *", "time_zone": "Europe/Berlin", "options": {"seed": 3}},
        "webhooks": [{"url": "https://example.com/told", "events": ["poses.changed", "venue.*"]}],
    }
    put = whole.http.put("/venues/everything", json=everything)
    assert put.status_code == 201, put.text
    whole.calibrated("everything", headers={"Idempotency-Key": "first"}, callback_url="https://example.com/end")
    whole.calibrated("everything", shade=1, flat=True)
    whole.http.post("/venues/everything/restore", json={"revision": 1}).raise_for_status()
    for name, behaviour in (("rejected", "reject"), ("partly", "partly"), ("failed", "fail")):
        whole.venue(name, behaviour)
        whole.calibrated(name, dry_run=name == "partly")
    fitted = whole.http.post("/venues/rejected/field/fit", files=upload()).raise_for_status().json()["id"]
    whole.end(fitted)
    clicked = {"options": (None, json.dumps(POINTS))}
    found = whole.http.post("/venues/rejected/cameras/left/locate", files=clicked).raise_for_status().json()["id"]
    whole.end(found)
    wait_for(lambda: not any(job["status"] in ("queued", "running") for job in whole.http.get("/jobs").json()["jobs"]))
    assert whole.stop() == 0
    # Without a worker, what comes waits.
    half = Service(folder, "serve", **quiet)
    half.venue("waiting")
    waiting = half.submitted("waiting", headers={"Idempotency-Key": "waits"})
    assert half.job(waiting)["status"] == "queued"
    cancelled = half.submitted(half.venue("cancelled"))
    half.http.post(f"/jobs/{cancelled}/cancel").raise_for_status()
    assert half.stop() == 0


if __name__ == "__main__":
    main()
