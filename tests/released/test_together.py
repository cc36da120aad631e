"""The last release and this version in one home: APIs, workers and clients of both."""

import json
import signal

import pytest

from testbed.books import settle
from testbed.homes import in_both_homes
from testbed.running import Service, png, venue, wait_for
from tests.e2e.commands import esc_process

JOBS = 6


@pytest.mark.long
@in_both_homes
def test_workers_of_both_versions_compute_what_apis_of_both_submit_and_an_upgrade_loses_no_job(start, release, worker):
    # Old processes begin before the schema is brought up to date: none can start after that.
    old = start("serve", **release.environment)
    workers = [worker(old, f"old-{number}", **release.environment) for number in range(2)]
    wait_for(lambda: "esc_workers 2.0" in old.http.get("/metrics").text)
    names = [f"venue-{number}" for number in range(2 * JOBS)]
    jobs = [old.submitted(old.venue(name, "refine 0.5")) for name in names[:JOBS]]
    # As the guide has it: the API first, then the workers one by one; meanwhile clients go on, at either API.
    new = start("serve")
    jobs += [new.submitted(new.venue(name, "refine 0.5")) for name in names[JOBS:]]
    for number, process in enumerate(workers):
        worker(new, f"new-{number}")
        process.send_signal(signal.SIGTERM)
        process.wait()
    ends = [new.end(job) for job in jobs]
    assert [end["status"] for end in ends] == ["succeeded"] * len(jobs)
    assert all(old.job(job)["result"]["accepted"] for job in jobs)
    assert old.stop() == 0
    # Each moved its venue once: what a worker had begun when it was ended, another began again.
    settle(new)
    for name in names:
        assert len(new.http.get(f"/venues/{name}/history").json()["revisions"]) == 2


@pytest.mark.long
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
def test_this_client_works_with_a_service_of_the_last_release(released_service, tmp_path, command, shown):
    for side in ("left", "right"):
        (tmp_path / f"{side}.png").write_bytes(png())
    (tmp_path / "here.json").write_text(json.dumps(venue("here")))
    answer = esc_process(tmp_path, *command, ESC_URL=released_service.url)
    assert (answer.returncode, "Traceback" in answer.stderr) == (0, False), answer.stderr
    assert shown in answer.stdout


@pytest.fixture(scope="module")
def released_service(release, tmp_path_factory):
    running = Service(tmp_path_factory.mktemp("old"), **release.environment).ready()
    running.calibrated(running.venue("here"))
    yield running
    assert running.stop() == 0
