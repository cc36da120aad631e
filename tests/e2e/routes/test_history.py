"""The history of a venue through the front door, and the ways back."""

import pytest

from testbed.running import venue


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
    assert (refused.status_code, refused.json()["type"]) == (412, "/problems/venue-changed")
    seen = service.http.get(f"/venues/{name}").headers["etag"]
    restored = service.http.post(path, json={"revision": 1}, headers={"If-Match": seen})
    assert (restored.status_code, restored.headers["etag"]) == (200, old)
    assert restored.json() == service.http.get(f"/venues/{name}").json()
    assert positions(service, name) == [-1.0, -1.0]
    newest = history(service, name).json()["revisions"][0]
    assert (newest["revision"], newest["cause"], newest["restored_from"]) == (3, "restored", 1)


def test_what_cannot_be_restored_is_refused_with_the_reason(service, name):
    service.venue(name)
    path = f"/venues/{name}/restore"
    none = service.http.post(path, json={"revision": 7})
    assert (none.status_code, none.json()["type"]) == (404, "/problems/revision-not-found")
    service.http.put(f"/venues/{name}", json=venue(name, cameras=("left",)))
    unfit = service.http.post(path, json={"revision": 1})
    assert (unfit.status_code, unfit.json()["type"]) == (409, "/problems/revision-unfit")
    assert "right" in unfit.json()["detail"]
    assert service.http.post("/venues/nowhere/restore", json={"revision": 1}).status_code == 404
    assert service.http.post(path, json={"revision": 0}).status_code == 422


def test_a_rejected_result_is_accepted_by_hand_and_rejected_again(service, name):
    job = service.calibrated(service.venue(name, "reject"))["id"]
    unchanged = service.http.get(f"/jobs/{job}").headers["etag"]
    accepted = service.http.post(f"/jobs/{job}/accept")
    assert (accepted.status_code, accepted.json()["venue_revision"]) == (200, 2)
    assert accepted.headers["etag"] != unchanged
    assert accepted.json()["result"]["accepted"] is False
    assert positions(service, name) == [-0.875, -0.875]
    assert service.http.post(f"/jobs/{job}/accept").json() == accepted.json()
    assert service.http.post(f"/jobs/{job}/reject").status_code == 200
    assert positions(service, name) == [-1.0, -1.0]
    assert [r["cause"] for r in history(service, name).json()["revisions"]] == ["restored", "accepted", "put"]


def test_a_pose_that_no_client_could_send_fails_its_job_at_once_in_words(service, name):
    job = service.calibrated(service.venue(name, "impossible"))
    assert (job["status"], job["attempt"], job["result"]) == ("failed", 1, None)
    assert "position" in job["error"]["detail"]
    assert "Nothing was stored." in job["error"]["detail"]
    assert positions(service, name) == [-1.0, -1.0]


def test_deciding_too_late_or_about_nothing_is_refused(service, name):
    job = service.calibrated(service.venue(name))["id"]
    service.calibrated(name, shade=1)
    late = service.http.post(f"/jobs/{job}/reject")
    assert (late.status_code, late.json()["type"]) == (409, "/problems/venue-moved-on")
    assert (late.json()["got"], "revision 3 (calibrated)" in late.json()["detail"]) == (3, True)
    failed = service.calibrated(service.venue(name, "fail"))["id"]
    for decision in ("accept", "reject"):
        answer = service.http.post(f"/jobs/{failed}/{decision}")
        assert (answer.status_code, answer.json()["type"]) == (404, "/problems/poses-not-found")


def test_the_command_line_goes_back_too(service, esc, name):
    job = service.calibrated(service.venue(name, "reject"))["id"]
    assert f'"id": "{job}"' in esc("job", "accept", job).stdout
    newest, oldest = (line.split("\t") for line in esc("venue", "history", name).stdout.splitlines())
    assert (newest[0], newest[2:4]) == ("2", ["accepted", job])
    assert (oldest[0], oldest[2:]) == (
        "1",
        ["put", "-", "left:-/0.0 right:-/0.0", "anyone from 127.0.0.1"],
    )
    assert f'"id": "{name}"' in esc("venue", "restore", name, "1").stdout
    assert positions(service, name) == [-1.0, -1.0]
    assert len(esc("venue", "history", name, "--limit", "2").stdout.splitlines()) == 2
    late = esc("job", "reject", job)
    assert (late.returncode, "revision 3 (restored)" in late.stderr) == (1, True)
