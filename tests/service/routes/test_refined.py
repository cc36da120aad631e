"""Refined poses and lenses through the front door: what is exported, and what is stored by hand."""

import pytest

from testbed.running import venue
from tests.problems import problem_of


def poses(service, address, **params):
    return service.http.get(f"{address}/poses", params={"format": "json", **params})


def adopt(service, name, camera="left", **headers):
    return service.http.post(f"/venues/{name}/cameras/{camera}/adopt-refined", headers=headers)


def refined_of(job, camera="left"):
    (found,) = (one for one in job["result"]["cameras"] if one["id"] == camera)
    return found["refined"]


@pytest.fixture
def job(service, name):
    """A job that was accepted, with refined poses."""
    return service.calibrated(service.venue(name, "refine"))


def test_each_job_goes_on_with_the_memory_that_the_one_before_left(service, name, job):
    nights = [one["nights"] for one in job["result"]["cameras"]]
    again = service.calibrated(name, shade=1)
    assert (nights, [one["nights"] for one in again["result"]["cameras"]]) == ([1, 1], [2, 2])


def test_the_refined_poses_of_a_venue_are_those_of_its_last_accepted_job(service, name, job):
    answer = poses(service, f"/venues/{name}", lens="refined")
    assert answer.headers["content-disposition"] == f'attachment; filename="{name}-refined-json.json"'
    left, _ = answer.json()["cameras"]
    assert (left["pose"], left["intrinsics"]["matrix"]) == (
        refined_of(job)["pose"],
        refined_of(job)["intrinsics"]["matrix"],
    )
    assert left["intrinsics"]["sigma"] == {"fx": 0.01}
    stored = poses(service, f"/venues/{name}")
    assert stored.json()["cameras"][0]["pose"] != left["pose"]
    assert stored.headers["etag"] != answer.headers["etag"]
    of_job = poses(service, f"/jobs/{job['id']}", lens="refined")
    assert of_job.json() == answer.json()


def test_a_camera_without_a_refined_pose_is_named_with_what_to_do(service, name):
    service.calibrated(service.venue(name))
    for address in (
        f"/venues/{name}",
        f"/jobs/{service.http.get('/jobs', params={'venue': name}).json()['jobs'][0]['id']}",
    ):
        problem = poses(service, address, lens="refined", camera="right")
        assert problem_of(problem) == (404, "refined-not-found")
        assert problem.json()["camera"] == "right"
        assert "lens=stored" in problem.json()["detail"]
    assert poses(service, f"/venues/{name}", lens="long").status_code == 422


def test_it_is_stored_in_the_venue_that_was_seen_and_for_a_camera_that_it_has(service, name, job):
    refused = adopt(service, name, **{"If-Match": '"another"'})
    assert problem_of(refused) == (412, "venue-changed")
    assert adopt(service, name, "middle").json()["type"] == "/problems/no-such-camera"
    assert adopt(service, "nowhere").json()["type"] == "/problems/venue-not-found"
    seen = service.http.get(f"/venues/{name}").headers["etag"]
    answer = adopt(service, name, **{"If-Match": seen})
    assert (answer.status_code, answer.json()["cameras"][0]["pose"]) == (200, refined_of(job)["pose"])
    assert answer.headers["etag"] == service.http.get(f"/venues/{name}").headers["etag"] != seen


def test_a_result_cannot_be_rejected_once_something_of_it_was_stored_by_hand_and_restore_can(service, name, job):
    adopt(service, name)
    assert service.http.post(f"/jobs/{job['id']}/reject").json()["type"] == "/problems/venue-moved-on"
    restored = service.http.post(f"/venues/{name}/restore", json={"revision": 1}).json()
    assert restored["cameras"][0]["pose"]["position"] == venue(name)["cameras"][0]["pose"]["position"]


def test_the_page_says_what_differs_and_offers_to_store_it(service, name, job):
    page = service.http.get(f"/ui/jobs/{job['id']}").text
    assert "<b>3.40 cm</b>" in page
    assert "0.10 % longer" in page
    assert "Focal length 0.6 ± 0.1 % longer than on 3 November: zoom ring or focus." in page
    assert f'data-call="/venues/{name}/cameras/left/adopt-refined"' in page
    adopt(service, name)
    assert "adopt-refined" not in service.http.get(f"/ui/jobs/{job['id']}").text
    assert "refined lens stored" in service.http.get(f"/ui/venues/{name}").text
