"""The history of a venue through the front door, and the ways back."""

import pytest

from tests.problems import problem_of


def history(service, name, **params):
    return service.http.get(f"/venues/{name}/history", params=params)


def positions(service, name):
    return [camera["pose"]["position"][0] for camera in service.http.get(f"/venues/{name}").json()["cameras"]]


def test_the_history_comes_in_pages_and_is_not_sent_twice(service, name):
    job = service.calibrated(service.venue(name))
    assert job["venue_revision"] == 2
    first = history(service, name, limit=1)
    rest = history(service, name, limit=1, cursor=first.json()["next_cursor"])
    assert [(r["revision"], r["cause"], r["job"]) for r in first.json()["revisions"] + rest.json()["revisions"]] == [
        (2, "calibrated", job["id"]),
        (1, "put", None),
    ]
    assert rest.json()["next_cursor"] is None
    (left, _) = first.json()["revisions"][0]["cameras"]
    assert left["moved"]["position_m"] == left["drift"]["position_m"] == pytest.approx(6.33, abs=0.01)
    assert left["moved"]["pixels"] > 0
    again = service.http.get(f"/venues/{name}/history?limit=1", headers={"If-None-Match": first.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    assert service.http.get("/venues/nowhere/history").status_code == 404


def test_a_revision_is_restored_if_the_venue_is_the_one_that_was_seen(service, name):
    old = service.http.get(f"/venues/{service.venue(name)}").headers["etag"]
    service.calibrated(name)
    path = f"/venues/{name}/restore"
    refused = service.http.post(path, json={"revision": 1}, headers={"If-Match": old})
    assert problem_of(refused) == (412, "venue-changed")
    seen = service.http.get(f"/venues/{name}").headers["etag"]
    restored = service.http.post(path, json={"revision": 1}, headers={"If-Match": seen})
    assert (restored.status_code, restored.headers["etag"]) == (200, old)
    assert restored.json() == service.http.get(f"/venues/{name}").json()
    assert positions(service, name) == [-1.0, -1.0]
    newest = history(service, name).json()["revisions"][0]
    assert (newest["revision"], newest["cause"], newest["restored_from"]) == (3, "restored", 1)
    assert service.http.post(path, json={"revision": 0}).status_code == 422
    assert service.http.post("/venues/nowhere/restore", json={"revision": 1}).status_code == 404


def test_a_pose_that_no_client_could_send_fails_its_job_at_once_in_words(service, name):
    job = service.calibrated(service.venue(name, "impossible"))
    assert (job["status"], job["attempt"], job["result"]) == ("failed", 1, None)
    assert "position" in job["error"]["detail"]
    assert "Nothing was stored." in job["error"]["detail"]
    assert positions(service, name) == [-1.0, -1.0]
