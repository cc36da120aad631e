"""Numbers of the field as the lines have them, through the front door: offered by a job, stored by hand, undone."""

import json

import pytest

from tests.problems import problem_of


@pytest.fixture
def job(service, name):
    """A job that was accepted, whose lines contradict the ridge and the length of the field."""
    return service.calibrated(service.venue(name, "contradict"))


def adopt(service, venue_id, job_id, number="ridge_height_m", **headers):
    wanted = {"job": job_id, "name": number}
    return service.http.post(f"/venues/{venue_id}/adopt-field", json=wanted, headers=headers)


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


def test_it_is_stored_in_the_venue_that_was_seen_if_its_sport_has_such_a_field(service, name, job):
    assert problem_of(adopt(service, name, job["id"], **{"If-Match": '"another"'})) == (412, "venue-changed")
    assert problem_of(adopt(service, "nowhere", job["id"])) == (404, "venue-not-found")
    unknown = adopt(service, name, job["id"], "ridge")
    assert problem_of(unknown) == (422, "invalid-request")
    assert "ridge_height_m" in json.dumps(unknown.json()["errors"])
    seen = service.http.get(f"/venues/{name}").headers["etag"]
    answer = adopt(service, name, job["id"], **{"If-Match": seen})
    assert (answer.status_code, answer.json()["field"]["ridge"][0]) == (200, [-18.5, 0.0, 0.332])
    assert answer.headers["etag"] == service.http.get(f"/venues/{name}").headers["etag"] != seen
    refused = adopt(service, name, job["id"], "length_m")
    assert problem_of(refused) == (422, "field-number-refused")
    assert "are these" not in refused.json()["detail"], "what the lines say is in metres"
