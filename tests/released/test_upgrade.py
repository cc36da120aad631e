"""A database that release 0.1.0 left, opened and served by this version."""

import sqlite3
from contextlib import closing

import psycopg
import pytest
from obstore.store import from_url

from service.schemas.names import OPEN_STATUSES
from service.store.database import SCHEMA_TABLE
from testbed.homes import Servers, in_both_homes
from testbed.released import DUMPS
from testbed.running import png, wait_for

VENUES = ["cancelled", "everything", "failed", "partly", "rejected", "waiting"]


@pytest.fixture
def left(home, tmp_path):
    """What 0.1.0 left where `start` starts services."""
    folder = tmp_path / "esc"
    folder.mkdir()
    if isinstance(home, Servers):
        with psycopg.connect(home.database_url(folder), autocommit=True) as database:
            database.execute((DUMPS / "postgresql.sql").read_text())
    else:
        with closing(sqlite3.connect(folder / "esc.sqlite")) as database:
            database.executescript((DUMPS / "sqlite.sql").read_text())
    return home.blob_url(folder)


@in_both_homes
def test_venues_jobs_and_history_of_0_1_0_are_served_and_its_waiting_job_is_computed(left, start):
    service = start("serve")
    venues = service.http.get("/venues").raise_for_status().json()["venues"]
    assert [venue["id"] for venue in venues] == VENUES
    everything = venues[1]
    assert (everything["accept"], everything["lens"], everything["view"]) == ("all", "may-drift", None)
    assert everything["field"]["ridge"] == [[-18.5, 0.0, 0.2], [18.5, 0.0, 0.2]]
    assert everything["schedule"]["options"]["seed"] == 3
    assert everything["alarms"]["rejected_in_a_row"] == 1
    assert everything["cameras"][0]["source"] == "http://***@example.com/a.jpg"
    history = service.http.get("/venues/everything/history").raise_for_status().json()["revisions"]
    assert [revision["cause"] for revision in history] == ["restored", "calibrated", "calibrated", "put"]
    jobs = service.http.get("/jobs").raise_for_status().json()["jobs"]
    assert sorted((job["venue"], job["kind"], job["status"]) for job in jobs) == [
        ("cancelled", "calibration", "cancelled"),
        ("everything", "calibration", "succeeded"),
        ("everything", "calibration", "succeeded"),
        ("failed", "calibration", "failed"),
        ("partly", "calibration", "succeeded"),
        ("rejected", "calibration", "succeeded"),
        ("rejected", "field", "succeeded"),
        ("rejected", "locate", "failed"),
        ("waiting", "calibration", "queued"),
    ]
    verdicts = {
        job["venue"]: job["result"]["verdict"] for job in jobs if job["kind"] == "calibration" and job["result"]
    }
    assert verdicts == {"everything": "accepted", "partly": "partly", "rejected": "rejected"}
    for venue in VENUES:
        service.http.get(f"/venues/{venue}/health").raise_for_status()

    (waiting,) = (job["id"] for job in jobs if job["status"] in OPEN_STATUSES)
    store = from_url(left)
    for camera in ("left", "right"):
        store.put(f"frames/{waiting}/{camera}/0", png())
    assert service.stop() == 0
    service = start()
    assert service.end(waiting)["status"] == "succeeded"
    # The same content under the same key is still the same job, and the venue is calibrated on.
    again = service.submit("waiting", headers={"Idempotency-Key": "waits"})
    assert (again.status_code, again.json()["id"]) == (200, waiting)
    assert service.calibrated("everything", shade=2)["result"]["accepted"]
    wait_for(lambda: len(service.http.get("/venues/everything/history").json()["revisions"]) == 5)


@in_both_homes
def test_the_dump_is_one_of_the_first_schema(left, home, tmp_path):
    query = f"SELECT version_num FROM {SCHEMA_TABLE}"
    if isinstance(home, Servers):
        with psycopg.connect(home.database_url(tmp_path / "esc")) as database:
            assert database.execute(query).fetchall() == [("0001",)]
    else:
        with closing(sqlite3.connect(tmp_path / "esc" / "esc.sqlite")) as database:
            assert database.execute(query).fetchall() == [("0001",)]
