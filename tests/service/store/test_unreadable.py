"""A row that cannot be read takes nothing else down, and there is a way out of it by HTTP alone."""

from functools import partial

import pytest
import sqlalchemy as sa

from service.schemas.addresses import HIDDEN
from service.schemas.source_urls import SourceSecrets
from service.store import tables, unreadable
from service.store.unreadable import UnreadableRow
from testbed.homes import in_both_homes, in_one_home_first
from testbed.parameters import try_first
from testbed.running import venue
from testbed.stock import result
from tests.problems import problem_of
from tests.service.local_service import LocalService
from worker.duties.alarms import AlarmTimer

pytestmark = pytest.mark.slow

SUNKEN = [[-18.5, 0.0, -0.001], [18.5, 0.0, -0.001]]
WATCHED = {"alarms": {"not_calibrated_for_h": 1}}
# What is known of a venue beside its document: one of these is spoilt at each venue.
ROWS = {
    f"{table.name}-{column}".replace("_", "-"): (table, column)
    for table, columns in (
        (tables.venue_quality, ("cameras", "glance")),
        (tables.memories, ("document",)),
        (tables.camera_anchors, ("posed", "baselines")),
        (tables.revisions, ("cameras", "movements")),
        (tables.events, ("data",)),
        (tables.live_reports, ("document", "watched")),
        (tables.live_minutes, ("cameras",)),
    )
    for column in columns
}


@pytest.fixture
def service(stock, monkeypatch):
    # Other tests of this process have met rows of theirs.
    monkeypatch.setattr(unreadable, "_met", {})
    with LocalService(stock.settings) as service:
        yield service


@pytest.fixture
def broken(stock, service):
    """A venue whose field has a ridge that no field can have, beside one that is as it should be."""
    for name in ("broken", "good"):
        assert service.ask("PUT", f"/venues/{name}", json=venue(name) | WATCHED).status_code == 201
    stock.calibrated("broken")
    overwrite(stock, tables.venues, "broken", sunken)
    return "/venues/broken"


def sunken(document):
    return document | {"field": document["field"] | {"ridge": SUNKEN}}


def overwrite(stock, table, row_id, change, column="document", key="id"):
    """Write into a row what the service would not."""
    is_row = table.c[key] == row_id
    with stock.engine.begin() as connection:
        document = connection.scalar(sa.select(table.c[column]).where(is_row))
        connection.execute(sa.update(table).where(is_row).values({column: change(document)}))


def rejected_with(stock, venue_id, **changes):
    """A job that the gate rejected, with these changes to its result."""
    task = stock.attempts.begin(stock.submitted(venue_id))
    stock.attempts.finish(task, result(task.venue, accepted=False).model_copy(update=changes), [])
    return task.job_id


@in_both_homes
def test_lists_name_a_venue_that_cannot_be_read_and_show_the_others(service, broken):
    for path in ("/venues", "/venues?fields=summary", "/venues?limit=1"):
        answer = service.ask("GET", path)
        (entry,) = answer.json()["unreadable"]
        assert (answer.status_code, entry["id"]) == (200, "broken")
        assert "the ridge must be 0 to 3 m high, not -0.001 m" in entry["why"]
    assert [one["id"] for one in service.ask("GET", "/venues").json()["venues"]] == ["good"]
    page = service.ask("GET", "/venues?limit=1").json()
    assert (page["venues"], page["next_cursor"]) == ([], "broken")
    rest = service.ask("GET", "/venues?limit=1&cursor=broken").json()
    assert (rest["venues"][0]["id"], "unreadable" in rest) == ("good", False)
    start = service.ask("GET", "/", headers={"Accept": "text/html"})
    assert (start.status_code, "broken</a> cannot be read" in start.text, "/ui/venues/good" in start.text) == (
        200,
        True,
        True,
    )


@in_one_home_first
def test_alone_it_is_a_problem_that_says_what_to_do(service, broken):
    answer = service.ask("GET", broken)
    assert problem_of(answer) == (409, "unreadable")
    for way in ("/restore", "PUT /venues/broken", "DELETE"):
        assert way in answer.json()["detail"]
    assert (
        service.ask("PATCH", broken, json={}, headers={"Content-Type": "application/merge-patch+json"}).status_code
        == 409
    )
    assert [one["cause"] for one in service.ask("GET", f"{broken}/history").json()["revisions"]] == [
        "calibrated",
        "put",
    ]
    page = service.ask("GET", "/ui/venues/broken")
    assert (page.status_code, "Restore revision 2" in page.text, "Delete the venue" in page.text) == (409, True, True)
    assert 'esc_unreadable_rows{kind="venue"} 1.0' in service.ask("GET", "/metrics").text


@in_one_home_first
@pytest.mark.parametrize("spoilt", ["ridge", "everything"])
@pytest.mark.parametrize(("way_out", "status"), [("restore", 200), ("put", 200), ("delete", 204)])
def test_it_is_restored_put_and_deleted(stock, service, broken, spoilt, way_out, status):
    if spoilt == "everything":
        overwrite(stock, tables.venues, "broken", lambda _: {"cameras": [3], "field": "grass"})
        status = 409 if way_out == "restore" else status
    requests = {
        "restore": partial(service.ask, "POST", f"{broken}/restore", json={"revision": 2}),
        "put": partial(service.ask, "PUT", broken, json=venue("broken")),
        "delete": partial(service.ask, "DELETE", broken),
    }
    assert requests[way_out]().status_code == status
    after = service.ask("GET", broken)
    assert after.status_code == {"delete": 404}.get(way_out, status)
    if after.status_code == 200:
        assert after.json()["field"]["ridge"] is None
        newest = service.ask("GET", f"{broken}/history").json()["revisions"][0]
        assert (newest["revision"], newest["cause"]) == (3, {"restore": "restored"}.get(way_out, "put"))
        assert after.json()["cameras"][0]["pose"] == newest["cameras"][0]["pose"]
        assert 'esc_unreadable_rows{kind="venue"} 0.0' in service.ask("GET", "/metrics").text


def test_a_put_of_it_goes_by_its_conditions_and_knows_its_passwords(stock, service, broken):
    assert service.ask("PUT", broken, json=venue("broken"), headers={"If-Match": '"seen"'}).status_code == 412
    assert service.ask("PUT", broken, json=venue("broken"), headers={"If-None-Match": "*"}).status_code == 412
    with pytest.raises(UnreadableRow):
        stock.venues.get("broken")
    good = stock.venue("good")
    left = good.cameras[0].model_copy(update={"source": "http://***@10.0.0.7/left.jpg"})
    anew = good.model_copy(update={"id": "broken", "cameras": [left, *good.cameras[1:]]})
    stock.venues.put(anew, {"left": SourceSecrets("user:secret")})
    overwrite(stock, tables.venues, "broken", sunken)
    stock.venues.put(anew, {"left": SourceSecrets(HIDDEN)})
    assert stock.venues.with_credentials("broken") == (anew, {"left": "user:secret"})


@in_one_home_first
def test_its_alarms_hold_up_no_other_venue(stock, service, broken):
    stock.time_passes(hours=3)
    timer = AlarmTimer(stock.venues)
    timer.poll()
    assert [alarm.rule for alarm in stock.venues.health("good").alarms] == ["not-calibrated"]
    assert stock.venues.with_alarms_due(10) == []
    service.ask("POST", f"{broken}/restore", json={"revision": 1})
    assert {alarm.camera for alarm in stock.venues.health("broken").alarms} == {None}


@in_one_home_first
def test_a_job_of_it_ends_and_is_rejected_back(stock, service):
    job = stock.calibrated("v")
    running = stock.attempts.begin(stock.submitted("v"))
    overwrite(stock, tables.venues, "v", sunken)
    with pytest.raises(UnreadableRow):
        stock.attempts.finish(running, result(running.venue, accepted=True), [])
    assert service.ask("POST", f"/jobs/{running.job_id}/cancel").json()["status"] == "cancelled"
    assert service.ask("GET", f"/ui/jobs/{job}").status_code == 200
    assert service.ask("POST", f"/jobs/{job}/reject").status_code == 200
    assert service.ask("GET", "/venues/v").status_code == 200


@in_both_homes
def test_a_job_that_cannot_be_read_is_listed_apart_and_deleted(stock, service):
    jobs = [stock.calibrated("v") for _ in range(2)]
    overwrite(stock, tables.jobs, jobs[1], lambda _: ["no", "object"], column="options")
    for path in ("/jobs", "/jobs?fields=summary", "/ui/jobs", "/", "/ui/venues/v", f"/ui/jobs/{jobs[0]}", "/metrics"):
        assert service.ask("GET", path).status_code == 200, path
    listed = service.ask("GET", "/jobs").json()
    assert ([job["id"] for job in listed["jobs"]], [one["id"] for one in listed["unreadable"]]) == (jobs[:1], jobs[1:])
    assert service.ask("GET", f"/jobs/{jobs[1]}").json()["type"] == "/problems/unreadable"
    assert len(stock.events.since("v", 0, [], 100).events) > 0
    assert service.ask("DELETE", f"/jobs/{jobs[1]}").status_code == 204
    assert "unreadable" not in service.ask("GET", "/jobs").json()


@pytest.mark.parametrize("rubbish", try_first([{"left": [1]}, [3], "text"]), ids=str)
def test_no_other_row_of_a_venue_takes_it_down(stock, service, rubbish):
    report = {"host": "h", "pid": 1, "version": "0", "started_at": "2026-11-21T10:00:00Z", "cameras": []}
    for name, (table, column) in ROWS.items():
        stock.calibrated(name)
        service.ask("PUT", f"/venues/{name}/live", json=report)
        overwrite(stock, table, name, lambda _: rubbish, column, "venue")
    for path in ("/venues", "/venues?fields=summary", "/", "/jobs", "/metrics"):
        assert service.ask("GET", path).status_code == 200, path
    for name in ROWS:
        for path in ("", "/history"):
            assert service.ask("GET", f"/venues/{name}{path}").status_code == 200, (name, path)
        for path in ("health", "live", "live/history", "cameras/left/trend"):
            assert service.ask("GET", f"/venues/{name}/{path}").status_code < 500, (name, path)
        assert service.ask("GET", f"/ui/venues/{name}").status_code in (200, 409), name
        stock.calibrated(name)
        assert service.ask("PUT", f"/venues/{name}", json=venue(name)).status_code == 200, name
        assert service.ask("GET", f"/ui/venues/{name}").status_code == 200, name
        assert service.ask("DELETE", f"/venues/{name}").status_code == 204, name


def test_poses_with_a_ridge_that_no_field_has_are_not_accepted(stock, service):
    job = rejected_with(stock, "v", ridge=SUNKEN)
    before = service.ask("GET", "/venues/v").json()
    assert stock.decisions.decidable(job).accept == frozenset()
    answer = service.ask("POST", f"/jobs/{job}/accept")
    assert problem_of(answer) == (422, "poses-refused")
    assert "the ridge must be 0 to 3 m high, not -0.001 m" in answer.json()["detail"]
    assert service.ask("GET", "/venues/v").json() == before


def test_a_restore_says_which_nights_it_drops(stock, service):
    memory = {"nights": []}
    stock.venue("v")
    for _ in range(2):
        task = stock.attempts.begin(stock.submitted("v"))
        stock.attempts.finish(task, result(task.venue, accepted=True), [], {"left": memory, "right": memory})
    kept = service.ask("POST", "/venues/v/restore", json={"revision": 2}).json()
    assert "warnings" not in kept
    (warning,) = service.ask("POST", "/venues/v/restore", json={"revision": 1}).json()["warnings"]
    assert "cameras left, right remember are dropped" in warning
