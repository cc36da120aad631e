"""A service that runs for months: what is past its time goes, and says so where somebody asks for it."""

from datetime import UTC, datetime, timedelta

import sqlalchemy as sa

from service.store import tables
from service.store.blobs import Blobs
from testbed.books import queued
from testbed.homes import in_one_home_first
from testbed.running import Service, wait_for
from tests.problems import problem_of


def age(service, job: str, days: float) -> None:
    """Let a job have ended so many days ago."""
    ended = datetime.now(UTC) - timedelta(days=days)
    with service.database() as connection:
        connection.execute(sa.update(tables.jobs).where(tables.jobs.c.id == job).values(finished_at=ended))


@in_one_home_first
def test_a_job_that_is_deleted_takes_its_frames_and_pictures_with_it(service, name):
    job = service.calibrated(service.venue(name), headers={"Idempotency-Key": name})
    poses = service.http.get(f"/venues/{name}").json()
    assert [len(service.files(f"{kind}/{job['id']}")) > 0 for kind in ("frames", "pictures")] == [True, True]
    assert service.http.delete(f"/jobs/{job['id']}").status_code == 204
    assert service.files(f"frames/{job['id']}") == service.files(f"pictures/{job['id']}") == []
    for path in ("", "/preview.jpg", "/overlay/left.jpg"):
        assert service.http.get(f"/jobs/{job['id']}{path}").json()["type"] == "/problems/job-not-found"
    assert service.http.delete(f"/jobs/{job['id']}").status_code == 404
    with service.database() as connection:
        assert job["id"] not in queued(connection)
    assert service.http.get(f"/venues/{name}").json() == poses
    # Nor does it stand in the way of anything.
    assert service.calibrated(name, headers={"Idempotency-Key": name})["id"] != job["id"]
    assert service.http.get(f"/ui/venues/{name}").status_code == 200


def test_a_job_that_is_open_is_cancelled_before_it_is_deleted(service, esc, name):
    job = service.submitted(service.venue(name, "hang"))
    refused = service.http.delete(f"/jobs/{job}")
    assert problem_of(refused) == (409, "job-open")
    assert esc("job", "delete", job, "--yes").returncode == 1
    service.http.post(f"/jobs/{job}/cancel")
    assert esc("job", "delete", job, "--yes").returncode == 0
    assert service.http.get(f"/jobs/{job}").status_code == 404


@in_one_home_first
def test_what_is_past_its_time_goes_and_says_so(start):
    service = start("up", ESC_TIDY_EVERY_S="0.5").ready()
    service.venue("v", "reject")
    key = {"Idempotency-Key": "k"}
    ancient, old, young = (
        service.calibrated("v", shade, headers=key if shade == 0 else None)["id"] for shade in range(3)
    )
    age(service, old, days=15)
    wait_for(lambda: not service.files(f"pictures/{old}") and not service.files(f"frames/{old}"))
    answer = service.http.get(f"/jobs/{old}/birdseye.jpg")
    assert problem_of(answer) == (410, "picture-deleted")
    assert "14 days" in answer.json()["detail"]
    assert service.job(old)["result"]["rejected_because"] == "the lines do not fit"
    assert "birdseye" not in service.job(old)["links"]
    assert service.http.get(f"/jobs/{young}/birdseye.jpg").status_code == 200

    age(service, ancient, days=401)
    gone = wait_for(lambda: (answer := service.http.get(f"/jobs/{ancient}")).status_code == 404 and answer)
    assert gone.json()["type"] == "/problems/job-not-found"
    with service.database() as connection:
        assert {ancient, old, young} & queued(connection).keys() == {old, young}
    # The key went with its job.
    assert service.submit("v", headers=key).status_code == 202


@in_one_home_first
def test_a_picture_that_somebody_else_deleted_is_told_from_one_that_never_was(service, name):
    job = service.calibrated(service.venue(name))["id"]
    blobs = Blobs(service.blob_url)
    blobs.delete_under(f"pictures/{job}")
    # It is drawn again, as if nobody had ever looked at it.
    assert service.http.get(f"/jobs/{job}/birdseye.jpg").status_code == 200
    for kind in ("frames", "pictures"):
        blobs.delete_under(f"{kind}/{job}")
    gone = service.http.get(f"/jobs/{job}/birdseye.jpg")
    assert problem_of(gone) == (410, "picture-deleted")
    never = service.http.get(f"/jobs/{job}/overlay/middle.jpg")
    assert problem_of(never) == (404, "picture-not-found")


def test_a_nearly_full_disk_refuses_uploads_and_says_what_to_do(service, name):
    running = service.submitted(service.venue(name, "accept 2"))
    tight = Service(service.data, "serve", ESC_MIN_FREE_MB="1e9")
    answer = tight.submit(name, 1)
    assert problem_of(answer) == (507, "disk-full")
    assert "ESC_KEEP_FRAMES_DAYS" in answer.json()["detail"]
    ready = tight.http.get("/readyz")
    assert ready.status_code == 200
    assert ready.json()["warnings"]["disk"].endswith("1000000000 needed: uploads are refused")
    assert tight.end(running)["status"] == "succeeded"
    assert tight.http.get(f"/jobs/{running}/preview.jpg").status_code == 200
    tight.kill()


def test_the_free_room_is_a_metric(service):
    (line,) = [line for line in service.http.get("/metrics").text.splitlines() if line.startswith("esc_disk_free")]
    assert float(line.split()[1]) > 0
    assert service.http.get("/readyz").json()["parts"]["disk"] == "ok"
