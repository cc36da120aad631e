"""Release 0.1.0 and this version in one home: APIs, workers and clients of both."""

import json
import signal

import pytest

from testbed.books import settle
from testbed.homes import in_both_homes
from testbed.running import Service, png, venue, wait_for
from tests.e2e.commands import esc_process

# A venue with everything that 0.1.0 has not heard of.
LIGHT = {"gain": [1.06, 1.0, 0.94], "contrast": 0.1}
VIEW = {"projection": "cylinder", "width_px": 1280}
TREND_M = 0.2
JOBS = 6


def with_news(name, behaviour="accept"):
    put = venue(name, behaviour) | {"view": VIEW, "alarms": {"rejected_in_a_row": 3, "trend_m": TREND_M}}
    put["cameras"][0]["light"] = LIGHT
    return put


def show_news(document):
    return document["view"]["width_px"], document["alarms"]["trend_m"], document["cameras"][0]["light"]["gain"]


NEWS = (VIEW["width_px"], TREND_M, LIGHT["gain"])


@in_both_homes
def test_a_worker_of_0_1_0_computes_what_a_new_api_submits_and_takes_nothing_from_the_venue(start, release, worker):
    # It must have begun before the schema is brought up to date: none is started again after that.
    old = start("serve", **release.environment)
    worker(old, "old", **release.environment)
    wait_for(lambda: "esc_workers 1.0" in old.http.get("/metrics").text)
    service = start("serve")
    service.http.put("/venues/news", json=with_news("news")).raise_for_status()
    job = service.calibrated("news")
    assert (job["status"], job["attempt"], job["result"]["accepted"]) == ("succeeded", 1, True)
    assert show_news(service.http.get("/venues/news").json()) == NEWS
    assert service.calibrated("news", shade=1)["status"] == "succeeded"
    # What the old API shows is what it knows.
    assert old.job(job["id"])["result"]["accepted"]
    assert old.http.get("/venues/news").json()["alarms"]["rejected_in_a_row"] == 3


@in_both_homes
def test_a_new_worker_computes_what_an_api_of_0_1_0_submits_and_that_shows_the_result(start, release, worker):
    old = start("serve", **release.environment)
    old.venue("here", "refine")
    waiting = old.submitted("here")
    process = worker(old, "new")
    assert old.end(waiting)["result"]["accepted"]
    again = old.calibrated("here", shade=1)
    assert again["result"]["accepted"]
    assert [revision["cause"] for revision in old.http.get("/venues/here/history").json()["revisions"]] == [
        "calibrated",
        "calibrated",
        "put",
    ]
    service = start("serve")
    # What only the new worker could tell is there for the new API.
    camera = service.job(again["id"])["result"]["cameras"][0]
    assert (camera["nights"], camera["displacement"]["across_m"]) == (2, 0.03)
    assert "displacement" not in old.job(again["id"])["result"]["cameras"][0]
    assert process.poll() is None


@in_both_homes
def test_an_upgrade_with_jobs_in_flight_loses_none_and_computes_none_twice(start, release, worker):
    old = start("serve", **release.environment)
    names = [f"venue-{number}" for number in range(JOBS)]
    for name in names:
        old.venue(name, "accept 0.5")
    workers = [worker(old, f"old-{number}", **release.environment) for number in range(2)]
    wait_for(lambda: "esc_workers 2.0" in old.http.get("/metrics").text)
    jobs = [old.submitted(name) for name in names]
    # As the guide has it: the API first, then the workers one by one; meanwhile clients go on, at either API.
    new = start("serve")
    for name in names:
        new.http.put(f"/venues/more-{name}", json=with_news(f"more-{name}", "accept 0.5")).raise_for_status()
    jobs += [new.submitted(f"more-{name}") for name in names]
    for number, process in enumerate(workers):
        worker(new, f"new-{number}")
        process.send_signal(signal.SIGTERM)
        process.wait()
    assert old.stop() == 0
    ends = [new.end(job) for job in jobs]
    assert [end["status"] for end in ends] == ["succeeded"] * len(jobs)
    # Of those, each moved its venue once: what a worker had begun when it was ended, another began again.
    settle(new)
    for name in names:
        assert len(new.http.get(f"/venues/{name}/history").json()["revisions"]) == 2
        assert show_news(new.http.get(f"/venues/more-{name}").json()) == NEWS


@pytest.mark.parametrize(
    ("command", "shown"),
    [
        (["venue", "get", "here"], '"id": "here"'),
        (["venue", "list"], "here"),
        (["venue", "history", "here"], "put"),
        (["venue", "health", "here"], '"state": "ok"'),
        (["job", "list"], "succeeded"),
        (["calibrate", "here", "left=left.png", "right=right.png", "--wait"], '"accepted": true'),
        (["venue", "set", "here", "alarms.rejected_in_a_row=3"], '"rejected_in_a_row": 3'),
        (["venue", "put", "here.json", "--force"], '"name": "accept"'),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_this_client_works_with_a_service_of_0_1_0(service_of_0_1_0, tmp_path, command, shown):
    for side in ("left", "right"):
        (tmp_path / f"{side}.png").write_bytes(png())
    (tmp_path / "here.json").write_text(json.dumps(venue("here")))
    said = esc_process(tmp_path, *command, ESC_URL=service_of_0_1_0.url)
    assert (said.returncode, "Traceback" in said.stderr) == (0, False), said.stderr
    assert shown in said.stdout


@pytest.fixture(scope="module")
def service_of_0_1_0(release, tmp_path_factory):
    running = Service(tmp_path_factory.mktemp("old"), **release.environment).ready()
    running.calibrated(running.venue("here"))
    yield running
    assert running.stop() == 0
