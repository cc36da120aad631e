"""Jobs over HTTP: what is answered of them, before and after their end."""

from datetime import UTC, datetime

import pytest
import sqlalchemy as sa

from service.routes.jobs import STRAGGLING
from service.store import tables
from service.store.jobs.files import frame_folder, pictures_folder
from testbed.homes import in_both_homes, in_one_home_first
from testbed.running import SIZE, png, upload
from tests.problems import problem_of


def test_of_a_result_that_is_accepted_in_part_that_part_is_stored_and_the_other_by_hand(service, name):
    before = service.http.get(f"/venues/{service.venue(name, 'partly')}").json()["cameras"]
    job = service.calibrated(name)
    result = job["result"]
    assert (result["verdict"], result["accepted"]) == ("partly", False)
    assert [camera["accepted"] for camera in result["cameras"]] == [True, False]
    left, right = service.http.get(f"/venues/{name}").json()["cameras"]
    assert left["pose"] == result["cameras"][0]["pose"] != before[0]["pose"]
    assert right["pose"] == before[1]["pose"] != result["cameras"][1]["pose"]
    accepted = service.http.post(f"/jobs/{job['id']}/accept", params={"camera": "right"})
    assert (accepted.status_code, accepted.json()["venue_revision"]) == (200, 3)
    stored = service.http.get(f"/venues/{name}").json()["cameras"]
    assert [camera["pose"] for camera in stored] == [camera["pose"] for camera in job["result"]["cameras"]]
    nobody = service.http.post(f"/jobs/{job['id']}/accept", params={"camera": "nobody"})
    assert problem_of(nobody) == (404, "poses-not-found")
    assert nobody.json()["expected"] == ["left", "right"]


def test_a_rejection_gives_its_reason_and_links_the_pictures_that_were_made(service, name):
    job = service.calibrated(service.venue(name, "reject"))
    assert (job["result"]["accepted"], job["result"]["rejected_because"]) == (False, "the lines do not fit")
    assert service.http.get(job["links"]["overlay/left"]).status_code == 200
    assert {"birdseye", "overlay/left", "overlay/right"} <= set(job["links"])
    assert "preview" not in job["links"]
    assert service.http.get(f"/jobs/{job['id']}/preview.jpg").status_code == 404


def test_frames_of_a_camera_may_repeat(service, name):
    service.venue(name)
    answer = service.http.post(f"/venues/{name}/calibrate", files=[*upload(1), *upload(2)])
    assert service.end(answer.json()["id"])["status"] == "succeeded"


@pytest.mark.parametrize("cameras", [("only",), ("a", "b", "c")])
def test_venues_have_one_camera_or_several(service, name, cameras):
    service.venue(name, cameras=cameras)
    answer = service.http.post(f"/venues/{name}/calibrate", files=upload(cameras=cameras))
    assert len(service.end(answer.json()["id"])["result"]["cameras"]) == len(cameras)


def test_the_seed_is_the_callers_or_one_is_chosen_and_told(service, name):
    assert service.calibrated(service.venue(name), seed=7)["result"]["provenance"]["seed"] == 7
    assert service.calibrated(name, 1)["result"]["provenance"]["seed"] >= 0


def test_the_same_frames_of_other_cameras_are_other_content(service, name):
    service.venue(name)
    frames = [png(shade=shade) for shade in (1, 2, 3)]
    sent = [("left", frames[0]), ("right", frames[1]), ("right", frames[2])]
    exchanged = [("left", frames[0]), ("left", frames[1]), ("right", frames[2])]
    job = service.http.post(f"/venues/{name}/calibrate", files=sent).json()["id"]
    answer = service.http.post(f"/venues/{name}/calibrate", files=exchanged)
    assert problem_of(answer) == (409, "venue-busy")
    assert service.http.post(f"/venues/{name}/calibrate", files=sent).json()["id"] == job


@in_both_homes
def test_the_same_frames_give_the_running_job_back_and_others_a_conflict(service, name):
    job = service.submitted(service.venue(name, "accept 2"))
    again = service.submit(name)
    assert (again.status_code, again.json()["id"]) == (200, job)
    for other in (service.submit(name, 1), service.submit(name, generations=9)):
        assert other.status_code == 409
        assert (other.json()["type"], other.json()["job"]) == ("/problems/venue-busy", job)
        assert service.http.get(other.headers["location"]).json()["id"] == job
        assert "retry-after" in other.headers
    assert service.http.delete(f"/venues/{name}").json()["job"] == job
    assert service.end(job)["status"] == "succeeded"
    assert service.submitted(name) != job


def test_an_idempotency_key_stands_for_one_job_even_after_its_end(service, name):
    service.venue(name)
    key = {"Idempotency-Key": "2026-11-21T10:00"}
    job = service.submitted(name, headers=key)
    service.end(job)
    again = service.submit(name, headers=key)
    assert (again.status_code, again.json()["id"], again.json()["status"]) == (200, job, "succeeded")
    other = service.submit(name, 1, headers=key)
    assert problem_of(other) == (422, "idempotency-key-reused")
    assert other.json()["job"] == job


def test_a_key_belongs_to_its_venue(service, name):
    key = {"Idempotency-Key": "k"}
    jobs = {service.submitted(service.venue(f"{name}-{n}"), headers=key) for n in range(2)}
    assert len(jobs) == 2


@pytest.mark.parametrize("key", ["", "a b", "x" * 256, "\xe9"])
def test_a_key_that_is_none_is_refused(service, name, key):
    service.venue(name)
    headers = {"Idempotency-Key": key.encode("latin-1")}
    assert service.submit(name, headers=headers).status_code == 422


def test_an_unchanged_job_is_not_sent_again(service, name):
    job = service.calibrated(service.venue(name))["id"]
    tag = service.http.get(f"/jobs/{job}").headers["etag"]
    answer = service.http.get(f"/jobs/{job}", headers={"If-None-Match": f'"other", {tag}'})
    assert (answer.status_code, answer.content, answer.headers["etag"]) == (304, b"", tag)
    assert "retry-after" not in answer.headers


@in_both_homes
def test_who_saw_the_end_and_connects_again_is_told_that_there_is_no_more(service, name):
    job = service.calibrated(service.venue(name))["id"]
    lines = [line.partition(": ") for line in service.http.get(f"/jobs/{job}/events").text.splitlines()]
    (number,) = [value for field, _, value in lines if field == "id"]
    again = service.http.get(f"/jobs/{job}/events", headers={"Last-Event-ID": number})
    assert (again.status_code, again.content) == (204, b"")
    missed_it = service.http.get(f"/jobs/{job}/events", headers={"Last-Event-ID": "1"})
    assert "event: end" in missed_it.text


def test_a_picture_can_be_asked_for_without_its_bytes(service, name):
    job = service.calibrated(service.venue(name))
    for link in ("self", "preview"):
        whole, without = service.http.get(job["links"][link]), service.http.head(job["links"][link])
        assert (without.status_code, without.content) == (200, b"")
        for field in ("content-type", "content-length", "etag", "cache-control"):
            assert without.headers.get(field) == whole.headers.get(field)
    assert service.http.head("/jobs/01KAJ3Q6WZ5T3Y8R0N4M2C7B1D").status_code == 404


def test_jobs_are_listed_newest_first_in_pages_that_go_on_whatever_came_in_between(service, name):
    service.venue(name)
    ids = [service.calibrated(name, shade)["id"] for shade in range(3)]
    first = service.http.get("/jobs", params={"venue": name, "limit": 2}).json()
    service.calibrated(name, 3)
    rest = service.http.get("/jobs", params={"venue": name, "limit": 2, "cursor": first["next_cursor"]}).json()
    assert [job["id"] for job in first["jobs"] + rest["jobs"]] == ids[::-1]
    assert rest["next_cursor"] is None
    assert service.http.get("/jobs", params={"venue": name, "status": "failed"}).json()["jobs"] == []


@in_both_homes
def test_the_frames_that_were_sent_are_the_frames_that_are_kept(service, name):
    job = service.submitted(service.venue(name), 5)
    service.end(job)
    assert service.http.get(f"/jobs/{job}/frames/0").content == png(*SIZE, shade=5)


@in_one_home_first
def test_a_job_that_failed_says_what_was_asked_and_shows_its_frames(service, name):
    job = service.calibrated(service.venue(name, "fail"), dry_run=True, generations=7)
    assert (job["status"], job["error"]["camera"], job["asked_by"]) == ("failed", "left", None)
    assert job["error"]["type"] == "/problems/no-markings-in-view"
    picture = service.http.get(f"/jobs/{job['id']}/preview.jpg")
    assert problem_of(picture) == (404, "picture-not-found")
    assert (job["options"]["dry_run"], job["options"]["generations"]) == (True, 7)
    assert isinstance(job["options"]["seed"], int)
    assert job["frames"].keys() == {"left", "right"}
    (address,) = job["frames"]["right"]
    frame = service.http.get(address)
    assert (frame.headers["content-type"], frame.content) == ("image/png", png())
    missing = service.http.get(address[:-1] + "9")
    assert problem_of(missing) == (404, "picture-not-found")


@in_one_home_first
def test_a_job_whose_frames_are_past_their_time_names_none(service, name):
    job = service.calibrated(service.venue(name))
    (address,) = job["frames"]["left"]
    with service.database() as connection:
        j = tables.jobs
        gone = sa.update(j).where(j.c.id == job["id"]).values(frames_deleted_at=datetime.now(UTC))
        connection.execute(gone)
    assert service.job(job["id"])["frames"] == {}
    assert (service.http.get(address).status_code, service.http.get(address).json()["type"]) == (
        410,
        "/problems/frames-deleted",
    )


def test_of_a_deleted_job_what_its_worker_writes_meanwhile_is_swept_once_it_must_have_stopped(service, name):
    job = service.calibrated(service.venue(name))["id"]
    assert service.http.delete(f"/jobs/{job}").status_code == 204
    expiry, folders = service.context.expiry, {frame_folder(job), pictures_folder(job)}
    now = expiry.now()
    assert folders.isdisjoint(expiry.leftovers(now, 1000))
    assert folders <= {*expiry.leftovers(now + STRAGGLING, 1000)}


@pytest.mark.parametrize("nonsense", ["XYZ", "01kaj3q6wz5t3y8r0n4m2c7b1d", "%00", "a" * 300])
def test_an_id_that_no_job_can_have_is_answered_as_that_of_a_job_that_is_gone(service, nonsense):
    for path in ("", "/preview.jpg"):
        answer = service.http.get(f"/jobs/{nonsense}{path}")
        assert problem_of(answer) == (404, "job-not-found")
