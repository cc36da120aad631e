"""Numbers of the field as the lines have them, through the front door: offered by a job, stored by hand, undone."""

import json

import pytest


@pytest.fixture
def job(service, name):
    """A job that was accepted, whose lines contradict the ridge and the length of the field."""
    return service.calibrated(service.venue(name, "contradict"))


def adopt(service, venue_id, job_id, number="ridge_height_m", **headers):
    wanted = {"job": job_id, "name": number}
    return service.http.post(f"/venues/{venue_id}/adopt-field", json=wanted, headers=headers)


def kind_of(answer):
    return answer.status_code, answer.json()["type"]


def test_a_result_says_what_storing_a_number_would_be(job):
    ridge, length = job["result"]["adoptable"]
    assert ridge == {
        "name": "ridge_height_m",
        "given": 0.0,
        "value": 0.332,
        "sigma": 0.051,
        "moves_m": {"left": 0.081, "right": 0.079},
    }
    assert length["name"] == "length_m"


def test_a_number_of_the_field_is_stored_as_a_revision_of_its_own_and_restoring_takes_it_back(service, name, job):
    seen = service.http.get(f"/venues/{name}")
    answer = adopt(service, name, job["id"], **{"If-Match": seen.headers["etag"]})
    ridge = [[-18.5, 0.0, 0.332], [18.5, 0.0, 0.332]]
    assert (answer.status_code, answer.json()["field"]["ridge"]) == (200, ridge)
    assert answer.json()["cameras"] == seen.json()["cameras"]
    assert answer.headers["etag"] == service.http.get(f"/venues/{name}").headers["etag"]
    newest = service.http.get(f"/venues/{name}/history").json()["revisions"][0]
    assert (newest["revision"], newest["cause"], newest["job"], newest["ridge"]) == (3, "adopted", job["id"], ridge)
    assert newest["field_numbers"] == {"ridge_height_m": {"before": 0.0, "after": 0.332}}
    restored = service.http.post(f"/venues/{name}/restore", json={"revision": 2}).json()
    assert restored == seen.json()


def test_to_store_a_number_twice_is_to_store_it_once(service, name, job):
    assert adopt(service, name, job["id"]).json() == adopt(service, name, job["id"]).json()
    assert len(service.http.get(f"/venues/{name}/history").json()["revisions"]) == 3


def test_it_is_stored_in_the_venue_that_was_seen(service, name, job):
    assert kind_of(adopt(service, name, job["id"], **{"If-Match": '"another"'})) == (412, "/problems/venue-changed")
    assert kind_of(adopt(service, "nowhere", job["id"])) == (404, "/problems/venue-not-found")


def test_a_job_whose_poses_do_not_hold_any_more_is_refused_with_what_holds(service, name, job):
    service.calibrated(name, shade=1)
    stale = adopt(service, name, job["id"])
    assert kind_of(stale) == (409, "/problems/venue-moved-on")
    assert (stale.json()["job"], stale.json()["got"]) == (job["id"], 3)


def test_what_the_job_does_not_offer_is_refused_with_what_it_does(service, name, job):
    refused = adopt(service, name, job["id"], "width_m")
    assert kind_of(refused) == (404, "/problems/field-number-not-found")
    assert refused.json()["expected"] == ["ridge_height_m", "length_m"]
    unknown = adopt(service, name, job["id"], "ridge")
    assert kind_of(unknown) == (422, "/problems/invalid-request")
    assert "ridge_height_m" in json.dumps(unknown.json()["errors"])


def test_a_job_of_another_venue_is_as_one_that_is_not_there(service, name, job):
    other = service.calibrated(service.venue(f"{name}-2", "contradict"))
    for job_id in (other["id"], "01KAJ3Q6WZ5T3Y8R0N4M2C7B1D"):
        assert kind_of(adopt(service, name, job_id)) == (404, "/problems/job-not-found")


def test_a_number_that_the_sport_does_not_allow_is_refused_with_its_limits(service, name, job):
    refused = adopt(service, name, job["id"], "length_m")
    assert kind_of(refused) == (422, "/problems/field-number-refused")
    assert "60 to 130 m, not 131.5" in refused.json()["detail"]
    assert "are these" not in refused.json()["detail"], "what the lines say is in metres"
    assert len(service.http.get(f"/venues/{name}/history").json()["revisions"]) == 2


def test_the_page_offers_what_can_be_stored_and_says_why_the_rest_cannot(service, name, job):
    for path in (f"/ui/jobs/{job['id']}", f"/ui/venues/{name}"):
        page = service.http.get(path).text
        assert page.count(f'data-call="/venues/{name}/adopt-field"') == 1
        assert "It cannot be stored: football: 60 to 130 m, not 131.5." in page
    adopt(service, name, job["id"])
    assert "adopt-field" not in service.http.get(f"/ui/jobs/{job['id']}").text
    assert "ridge 0.000 → 0.332 m" in service.http.get(f"/ui/venues/{name}").text
