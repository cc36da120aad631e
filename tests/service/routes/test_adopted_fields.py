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


def test_it_is_stored_in_the_venue_that_was_seen_if_its_sport_has_such_a_field(service, name, job):
    assert kind_of(adopt(service, name, job["id"], **{"If-Match": '"another"'})) == (412, "/problems/venue-changed")
    assert kind_of(adopt(service, "nowhere", job["id"])) == (404, "/problems/venue-not-found")
    unknown = adopt(service, name, job["id"], "ridge")
    assert kind_of(unknown) == (422, "/problems/invalid-request")
    assert "ridge_height_m" in json.dumps(unknown.json()["errors"])
    refused = adopt(service, name, job["id"], "length_m")
    assert kind_of(refused) == (422, "/problems/field-number-refused")
    assert "are these" not in refused.json()["detail"], "what the lines say is in metres"


def test_the_page_offers_what_can_be_stored_and_says_why_the_rest_cannot(service, name, job):
    for path in (f"/ui/jobs/{job['id']}", f"/ui/venues/{name}"):
        page = service.http.get(path).text
        assert page.count(f'data-call="/venues/{name}/adopt-field"') == 1
        assert "It cannot be stored: football: 60 to 130 m, not 131.5." in page
    adopt(service, name, job["id"])
    assert "adopt-field" not in service.http.get(f"/ui/jobs/{job['id']}").text
    assert "ridge 0.000 → 0.332 m" in service.http.get(f"/ui/venues/{name}").text
