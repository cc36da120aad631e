"""A job's frames once more."""

from testbed.running import venue
from tests.problems import problem_of
from tests.service.routes.test_find import forget_frames


def test_the_same_frames_and_options_are_another_job_from_the_poses_that_hold_now(service, name):
    first = service.calibrated(service.venue(name), seed=5, dry_run=True)
    answer = service.http.post(f"/jobs/{first['id']}/again")
    assert (answer.status_code, answer.headers["Location"]) == (202, f"/jobs/{answer.json()['id']}")
    again = service.end(answer.json()["id"])
    assert again["id"] != first["id"]
    assert again["result"]["provenance"] == first["result"]["provenance"]


def test_who_asks_twice_gets_one_job(service, name):
    first = service.calibrated(service.venue(name))
    service.venue(name, "hang")
    one, other = (service.http.post(f"/jobs/{first['id']}/again") for _ in range(2))
    assert (one.status_code, other.status_code) == (202, 200)
    assert one.json()["id"] == other.json()["id"]
    service.http.post(f"/jobs/{one.json()['id']}/cancel")


def test_frames_that_are_gone_are_asked_for_again(service, name):
    job = service.calibrated(service.venue(name))
    forget_frames(service, job)
    answer = service.http.post(f"/jobs/{job['id']}/again")
    assert problem_of(answer) == (410, "frames-deleted")


def test_frames_of_a_venue_that_was_changed_are_those_of_another(service, name):
    job = service.calibrated(service.venue(name))["id"]
    changed = venue(name) | {"field": {"length_m": 100, "width_m": 68}}
    service.http.put(f"/venues/{name}", json=changed).raise_for_status()
    answer = service.http.post(f"/jobs/{job}/again")
    assert problem_of(answer) == (409, "venue-replaced")
    service.http.delete(f"/venues/{name}")
    assert service.http.post(f"/jobs/{job}/again").status_code == 404
