"""Finding cameras by HTTP: of a venue that is not stored yet and of one that is, and taking what was found."""

import pytest

from testbed.homes import in_both_homes, in_one_home_first
from testbed.running import png, upload, venue
from tests.e2e.routes.searching import adopt, depth, find, forget_frames, found, site
from tests.problems import problem_of


def test_a_search_is_a_job_with_candidates_and_a_picture_of_each(service, name):
    answer = find(service, name, place=site(name), seed=5)
    job = answer.json()
    assert (answer.status_code, job["kind"], job["venue"]) == (202, "find", name)
    assert answer.headers["location"] == f"/jobs/{job['id']}"
    job = service.end(job["id"])
    assert job["result"]["accepted"]
    assert job["result"]["provenance"]["seed"] == job["options"]["seed"] == 5
    assert [len(camera["candidates"]) for camera in job["result"]["cameras"]] == [2, 2]
    assert job["links"]["candidate/left/2"] == f"/jobs/{job['id']}/candidate/left/2.jpg"
    assert service.http.get(job["links"]["candidate/left/2"]).headers["content-type"] == "image/jpeg"
    assert problem_of(service.http.get(f"/jobs/{job['id']}/candidate/left/3.jpg")) == (404, "picture-not-found")


@in_both_homes
def test_a_search_stores_nothing_and_one_call_makes_the_venue_of_it(service, name):
    job = found(service, name, place=site(name))
    assert service.http.get(f"/venues/{name}").status_code == 404
    answer = adopt(service, name, job)
    assert answer.status_code == 201
    assert answer.headers["etag"]
    stored = service.http.get(f"/venues/{name}").json()
    assert stored == answer.json()
    assert [depth(stored, camera) for camera in ("left", "right")] == [40, 40]
    assert stored["cameras"][0]["intrinsics"]["sigma"] == {"fx": 0.5}
    (revision,) = service.http.get(f"/venues/{name}/history").json()["revisions"]
    assert (revision["cause"], revision["job"]) == ("found", job["id"])
    assert service.job(job["id"])["venue_revision"] == 1
    assert adopt(service, name, job).status_code == 200
    assert len(service.http.get(f"/venues/{name}/history").json()["revisions"]) == 1
    assert service.calibrated(name)["result"]["accepted"]


def test_of_a_camera_that_is_not_sure_a_person_chooses_a_candidate_or_leaves_it_out(service, name):
    job = found(service, name, place=site(name, "partly"))
    assert problem_of(adopt(service, name, job)) == (409, "candidate-needed")
    assert adopt(service, name, job).json()["expected"] == ["right"]
    assert problem_of(adopt(service, name, job, right=3)) == (404, "candidate-not-found")
    assert problem_of(adopt(service, name, job, top=1)) == (404, "candidate-not-found")
    assert problem_of(adopt(service, name, job, left=None, right=None)) == (422, "candidate-refused")
    stored = adopt(service, name, job, right=2).json()
    assert [depth(stored, camera) for camera in ("left", "right")] == [40, 60]
    other = found(service, f"{name}-2", place=site(f"{name}-2", "partly"))
    assert [one["id"] for one in adopt(service, f"{name}-2", other, right=None).json()["cameras"]] == ["left"]


@in_one_home_first
def test_of_a_stored_venue_those_with_frames_are_found_and_the_others_stay(service, name):
    service.venue(name)
    before = service.http.get(f"/venues/{name}").json()
    job = found(service, name, files=upload(cameras=("left",)))
    assert service.http.get(f"/venues/{name}").json() == before
    answer = adopt(service, name, job)
    assert answer.status_code == 200
    assert [depth(answer.json(), camera) for camera in ("left", "right")] == [40, 50]
    newest, first = service.http.get(f"/venues/{name}/history").json()["revisions"]
    assert [(one["cause"], one["revision"]) for one in (newest, first)] == [("found", 2), ("put", 1)]
    back = service.http.post(f"/venues/{name}/restore", json={"revision": 1}).json()
    assert [depth(back, camera) for camera in ("left", "right")] == [50, 50]
    assert back["cameras"] == before["cameras"]


@in_one_home_first
def test_what_was_found_is_calibrated_with_the_frames_of_the_search(service, name):
    job = found(service, name, place=site(name, "partly"))
    assert problem_of(calibrate(service, job)) == (404, "venue-not-found")
    adopt(service, name, job, right=None).raise_for_status()
    answer = calibrate(service, job)
    assert (answer.status_code, answer.json()["kind"], answer.json()["venue"]) == (202, "calibration", name)
    assert answer.headers["location"] == f"/jobs/{answer.json()['id']}"
    calibration = service.end(answer.json()["id"])
    # The frame of the camera that was left out is left out too.
    assert list(calibration["frames"]) == ["left"]
    assert calibration["venue_revision"] == 2
    frames = [service.http.get(one["frames"]["left"][0]).content for one in (job, calibration)]
    assert frames[0] == frames[1]


def test_the_frames_of_a_search_are_one_calibration_while_that_is_open(service, name):
    service.venue(name)
    job = found(service, name)
    service.venue(name, "hang")
    one, other = calibrate(service, job), calibrate(service, job)
    assert (one.status_code, other.status_code) == (202, 200)
    assert one.json()["id"] == other.json()["id"]
    service.http.post(f"/jobs/{one.json()['id']}/cancel")


def test_why_the_frames_of_a_job_calibrate_nothing_is_said(service, name):
    service.venue(name)
    assert problem_of(calibrate(service, service.calibrated(name))) == (404, "poses-not-found")
    partial = calibrate(service, found(service, name, files=upload(cameras=("left",))))
    assert problem_of(partial) == (422, "missing-camera")
    assert "no frame of right" in partial.json()["detail"]
    job = found(service, name)
    forget_frames(service, job)
    assert problem_of(calibrate(service, job)) == (410, "frames-deleted")


def calibrate(service, job):
    return service.http.post(f"/jobs/{job['id']}/calibrate")


def test_a_new_venue_gets_the_ridge_that_was_found_with_its_cameras(service, name):
    job = found(service, name, place=site(name, "crowned"))
    assert adopt(service, name, job).json()["field"]["ridge"] == job["result"]["ridge"]


def test_a_stored_venue_gets_the_ridge_with_the_poses_of_all_of_its_cameras_and_with_fewer_not(service, name):
    service.venue(name, "crowned")
    job = found(service, name)
    assert adopt(service, name, job, right=None).json()["field"]["ridge"] is None
    assert problem_of(adopt(service, name, job)) == (409, "venue-moved-on")
    service.http.post(f"/venues/{name}/restore", json={"revision": 1}).raise_for_status()
    assert adopt(service, name, job).json()["field"]["ridge"] == job["result"]["ridge"]
    back = service.http.post(f"/venues/{name}/restore", json={"revision": 1}).json()
    assert back["field"]["ridge"] is None


def test_options_name_the_cameras_that_are_found_of_those_with_frames(service, name):
    service.venue(name)
    job = found(service, name, cameras=["right"])
    assert [camera["id"] for camera in job["result"]["cameras"]] == ["right"]
    assert [depth(adopt(service, name, job).json(), camera) for camera in ("left", "right")] == [50, 40]


def test_a_camera_that_was_put_elsewhere_meanwhile_keeps_that_pose(service, name):
    service.venue(name)
    job = found(service, name, files=upload(cameras=("left",)))
    assert service.calibrated(name)["result"]["accepted"]
    moved = depth(service.http.get(f"/venues/{name}").json(), "left")
    assert problem_of(adopt(service, name, job)) == (409, "venue-moved-on")
    assert depth(service.http.get(f"/venues/{name}").json(), "left") == moved


def test_the_venue_of_a_search_that_somebody_has_put_meanwhile_stays(service, name):
    job = found(service, name, place=site(name))
    service.venue(name)
    assert problem_of(adopt(service, name, job)) == (409, "venue-moved-on")
    assert problem_of(find(service, name, place=site(name))) == (409, "venue-stored")
    assert problem_of(service.http.post(f"/jobs/{job['id']}/again")) == (409, "venue-stored")
    service.http.delete(f"/venues/{name}").raise_for_status()
    assert service.http.post(f"/jobs/{job['id']}/again").status_code == 202
    assert adopt(service, name, job).status_code == 201


def test_cameras_of_a_venue_that_was_deleted_meanwhile_make_no_new_one(service, name):
    service.venue(name)
    job = found(service, name, files=upload(cameras=("left",)))
    service.http.delete(f"/venues/{name}").raise_for_status()
    assert problem_of(adopt(service, name, job)) == (409, "venue-moved-on")


def test_memories_of_a_found_camera_end_and_those_of_the_others_stay(service, name):
    service.venue(name, "refine")
    for shade in (1, 2):
        service.calibrated(name, shade)
    adopt(service, name, found(service, name, files=upload(cameras=("left",)))).raise_for_status()
    nights = {camera["id"]: camera["nights"] for camera in service.calibrated(name, 3)["result"]["cameras"]}
    assert nights == {"left": 1, "right": 3}


def test_found_poses_leave_in_the_formats_of_other_tools(service, name):
    job = found(service, name, place=site(name, "partly"))
    exported = service.http.get(f"/jobs/{job['id']}/poses").raise_for_status().json()
    assert [camera["id"] for camera in exported["cameras"]] == ["left"]
    none = found(service, f"{name}-2", place=site(f"{name}-2", "reject"))
    assert problem_of(service.http.get(f"/jobs/{none['id']}/poses")) == (404, "poses-not-found")


def test_a_key_is_one_search_by_its_content(service, name):
    key = {"Idempotency-Key": f"{name}-1"}
    first = find(service, name, place=site(name), headers=key, seed=1)
    again = find(service, name, place=site(name), headers=key, seed=1)
    other = find(service, name, place=site(name, left={"side": "near"}), headers=key, seed=1)
    assert (first.status_code, again.status_code, other.status_code) == (202, 200, 422)
    assert first.json()["id"] == again.json()["id"]


def test_a_search_is_cancelled_and_its_frames_are_listed(service, name):
    job = find(service, name, place=site(name, "hang")).json()
    assert list(job["frames"]) == ["left", "right"]
    assert service.http.post(f"/jobs/{job['id']}/cancel").json()["status"] == "cancelled"


@pytest.mark.parametrize(
    ("asked", "answered"),
    [
        ({}, (422, "site-missing")),
        ({"place": {"cameras": []}}, (422, "invalid-request")),
        ({"place": site("another")}, (422, "venue-id-mismatch")),
        ({"place": "left"}, (422, "invalid-request")),
        ({"place": site("v", left={"source": "http://10.1.0.7/a.jpg"})}, (422, "invalid-request")),
        ({"place": site("v", cameras=["site"])}, (422, "invalid-request")),
        ({"place": site("v"), "cameras": ["left"]}, (422, "invalid-request")),
        ({"place": site("v"), "dry_run": True}, (422, "invalid-request")),
        ({"place": site("v"), "files": upload()[:1]}, (422, "missing-camera")),
        ({"place": site("v"), "files": upload(cameras=("left", "right", "top"))}, (422, "unknown-camera")),
        ({"place": site("v", left={"image_size": [128, 90]})}, (422, "frame-size")),
        ({"place": site("v"), "files": [("left", ("a.png", png()[:-20])), *upload()[1:]]}, (422, "truncated-image")),
    ],
)
def test_what_is_wrong_with_a_search_is_said_at_once(service, name, asked, answered):
    if isinstance(asked.get("place"), dict) and asked["place"].get("id") == "v":
        asked = asked | {"place": asked["place"] | {"id": name}}
    assert problem_of(find(service, name, **asked)) == answered


def test_what_is_wrong_with_a_search_of_a_stored_venue_is_said_at_once(service, name):
    whole = venue(name)
    assert problem_of(find(service, name, place=site(name) | {"cameras": whole["cameras"]})) == (422, "nothing-to-find")
    service.venue(name)
    assert problem_of(find(service, name, cameras=["top"])) == (404, "no-such-camera")
    assert problem_of(find(service, name, files=upload()[:1], cameras=["right"])) == (422, "missing-camera")
    assert problem_of(find(service, name, files=[("options", (None, "{}"))])) == (422, "nothing-to-find")
    assert problem_of(service.http.post(f"/venues/{name}/find", json={})) == (415, "not-multipart")


def test_what_cannot_be_taken_is_said(service, name):
    service.venue(name)
    calibration = service.calibrated(name)
    assert problem_of(adopt(service, name, calibration)) == (404, "poses-not-found")
    job = found(service, name)
    assert problem_of(adopt(service, f"{name}-not", job)) == (404, "poses-not-found")
    assert problem_of(adopt(service, name, job, {"If-Match": '"other"'})) == (412, "venue-changed")
    accepted = service.http.post(f"/jobs/{job['id']}/accept")
    assert problem_of(accepted) == (404, "poses-not-found")
    assert f"/venues/{name}/adopt-found" in accepted.json()["detail"]
