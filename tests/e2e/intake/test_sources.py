"""Frames that the service fetches itself, from cameras on real sockets."""

import json
import socket
import time
from datetime import UTC, datetime, timedelta

import pytest
import sqlalchemy as sa

from service.intake.snapshots import STARTING_S, Snapshots
from service.schemas.venue import VenueIn
from service.settings import Settings
from service.store import tables
from testbed.running import png, upload, venue, wait_for
from tests.problems import problem_of


def with_sources(name: str, **sources: str) -> dict:
    document = venue(name)
    for one in document["cameras"]:
        one["source"] = sources.get(one["id"])
    return document


def put(service, name, **sources):
    answer = service.http.put(f"/venues/{name}", json=with_sources(name, **sources))
    assert answer.is_success, answer.text
    return answer.json()


def test_a_calibration_without_frames_fetches_them(service, camera, name):
    put(service, name, left=camera.url("/ok"), right=camera.url("/ok"))
    answer = service.http.post(f"/venues/{name}/calibrate")
    assert answer.status_code == 202, answer.text
    job = service.end(answer.json()["id"])
    assert job["result"]["accepted"]
    assert len(service.files(f"frames/{job['id']}")) == 2


def test_options_are_taken_without_frames_too_and_frames_that_are_sent_come_first(service, camera, name):
    put(service, name, left=camera.url("/ok"), right=camera.url("/gone"))
    options = {"options": (None, json.dumps({"dry_run": True}))}
    assert service.http.post(f"/venues/{name}/calibrate", files=options).status_code == 502
    sent = service.http.post(f"/venues/{name}/calibrate", files=[*upload(), ("options", options["options"])])
    assert service.end(sent.json()["id"])["venue_revision"] is None


def test_the_same_request_is_the_same_job_and_fetches_nothing_again(service, camera, name):
    put(service, name, left=camera.url("/ok"), right=camera.url("/ok"))
    headers = {"Idempotency-Key": f"{name}-1"}
    first = service.http.post(f"/venues/{name}/calibrate", headers=headers)
    asked = len(camera.asked)
    again = service.http.post(f"/venues/{name}/calibrate", headers=headers)
    assert (again.status_code, again.json()["id"], len(camera.asked)) == (200, first.json()["id"], asked)


def test_of_motion_jpeg_the_first_picture_is_the_frame(service, camera, name):
    put(service, name, left=camera.url("/mjpeg"), right=camera.url("/ok"))
    picture = service.http.get(f"/venues/{name}/cameras/left/snapshot")
    assert (picture.status_code, picture.content) == (200, png())


def test_several_frames_of_each_camera_are_taken_as_far_apart_as_asked(camera, tmp_path):
    stored = VenueIn.model_validate(with_sources("v", left=camera.url("/ok"), right=camera.url("/mjpeg"))).to_venue()
    snapshots = Snapshots(Settings(data=tmp_path, sources=["127.0.0.1"], source_timeout_s=30), lambda _: None)
    asked, begun = len(camera.asked), time.monotonic()
    taken = snapshots.take_of_all(stored.cameras, {}, frames=3, spacing_s=0.5)
    assert time.monotonic() - begun >= 1
    assert taken == {"left": [png()] * 3, "right": [png()] * 3}
    assert sorted(camera.asked[asked:]) == ["/mjpeg"] * 3 + ["/ok"] * 3


def test_a_schedule_that_wants_more_frames_than_an_upload_may_have_is_refused(unusual, camera, name):
    document = with_sources(name, left=camera.url("/ok"), right=camera.url("/ok"))
    schedule = {"cron": "0 4 * * *", "frames": 3}
    refused = unusual.http.put(f"/venues/{name}", json=document | {"schedule": schedule})
    assert (refused.status_code, refused.json()["type"], refused.json()["expected"]) == (
        422,
        "/problems/too-many-frames",
        2,
    )


@pytest.mark.parametrize("way", ["basic", "digest"])
def test_user_and_password_reach_the_camera_and_nobody_else(service, camera, name, way):
    shown = put(service, name, left=camera.url(f"/{way}", "user:pass%20word@"), right=camera.url("/ok"))
    assert shown["cameras"][0]["source"] == camera.url(f"/{way}", "***@")
    picture = service.http.get(f"/venues/{name}/cameras/left/snapshot")
    assert (picture.status_code, picture.headers["content-type"], picture.content) == (200, "image/png", png())
    # As it was read, it is put again: what stands for the password keeps it.
    assert service.http.put(f"/venues/{name}", json=sent_again(shown)).status_code == 200
    assert service.http.get(f"/venues/{name}/cameras/left/snapshot").status_code == 200
    job = service.end(service.http.post(f"/venues/{name}/calibrate").json()["id"])
    told = json.dumps([job, service.http.get(f"/venues/{name}").json(), service.http.get("/venues").json()])
    seen = told + (service.data / "log").read_text()
    assert not [secret for secret in ("pass%20word", "pass word") if secret in seen]


def test_a_password_among_the_parameters_is_shown_to_nobody_and_still_reaches_the_camera(service, camera, name):
    shown = put(service, name, left=camera.url("/snap?usr=admin&pwd=hunter2"), right=camera.url("/gone?pwd=s3cret"))
    assert shown["cameras"][0]["source"] == camera.url("/snap?usr=***&pwd=***")
    got = service.http.get(f"/venues/{name}")
    assert service.http.put(f"/venues/{name}", json=got.json()).status_code == 200
    assert service.http.get(f"/venues/{name}").content == got.content
    assert service.http.get(f"/venues/{name}/cameras/left/snapshot").content == png()
    failed = service.http.post(f"/venues/{name}/calibrate")
    assert (failed.status_code, failed.json()["source"]) == (502, camera.url("/gone?pwd=***"))
    assert "/gone?pwd=s3cret" in camera.asked
    seen = shown | {"problem": failed.text, "list": service.http.get("/venues").text}
    assert not [secret for secret in ("hunter2", "s3cret") if secret in json.dumps(seen)]
    assert not [secret for secret in ("hunter2", "s3cret") if secret in (service.data / "log").read_text()]


def test_a_parameter_that_nobody_knows_is_refused_by_its_name(service, camera, name):
    document = with_sources(name, left=camera.url("/snap?token=***"))
    refused = service.http.put(f"/venues/{name}", json=document)
    assert problem_of(refused) == (422, "source-refused")
    assert "`token`" in refused.json()["detail"]


def sent_again(shown: dict) -> dict:
    for one in shown["cameras"]:
        del one["pose"]["translation"]
    return shown


def test_a_password_does_not_follow_a_source_to_another_host(service, camera, name):
    shown = put(service, name, left=camera.url("/basic", "user:pass%20word@"), right=camera.url("/ok"))
    shown["cameras"][0]["source"] = "http://***@127.0.0.2/basic"
    refused = service.http.put(f"/venues/{name}", json=sent_again(shown))
    assert problem_of(refused) == (422, "source-refused")


@pytest.mark.parametrize(
    ("path", "kind", "says"),
    [
        ("/gone", "source-failed", "404"),
        ("/basic", "source-failed", "check address, user and password"),
        ("/elsewhere", "source-failed", "it answered 302 and leads to another address"),
        ("/endless", "source-failed", "ESC_MAX_FRAME_MB"),
        ("/mjpeg-short", "source-failed", "ended before the first was whole"),
        ("/mjpeg-never-whole", "source-failed", "ESC_MAX_FRAME_MB"),
        ("/text", "source-failed", "a web page in place of a picture"),
        ("/small", "frame-size", "64x48"),
    ],
)
def test_a_source_that_gives_no_frame_is_named_with_what_came(service, camera, name, path, kind, says):
    put(service, name, left=camera.url("/ok"), right=camera.url(path))
    answer = service.http.post(f"/venues/{name}/calibrate")
    assert (answer.json()["type"], answer.json()["camera"]) == (f"/problems/{kind}", "right"), answer.text
    assert says in answer.json()["detail"]
    assert service.http.get("/jobs", params={"venue": name}).json()["jobs"] == []


@pytest.mark.parametrize("path", ["/hang", "/drip", "/mjpeg-silent", "rtsp"])
def test_a_source_that_is_too_slow_is_given_up(unusual, camera, name, path):
    with socket.create_server(("127.0.0.1", 0)) as silent:
        url = "rtsp://user:pass@{}:{}/live".format(*silent.getsockname()) if path == "rtsp" else camera.url(path)
        document = venue(name, cameras=("left",))
        document["cameras"][0]["source"] = url
        unusual.http.put(f"/venues/{name}", json=document).raise_for_status()
        begun = time.monotonic()
        answer = unusual.http.post(f"/venues/{name}/calibrate")
    assert (answer.status_code, answer.json()["camera"]) == (502, "left"), answer.text
    assert "within 1 s" in answer.json()["detail"]
    # And what a busy machine may add.
    assert time.monotonic() - begun < 1 + STARTING_S + 10
    assert "pass" not in answer.text + (unusual.data / "log").read_text()


def test_a_venue_with_a_camera_without_a_source_says_which(service, camera, name):
    put(service, name, left=camera.url("/ok"))
    answer = service.http.post(f"/venues/{name}/calibrate")
    assert (answer.status_code, answer.json()["type"], answer.json()["camera"]) == (
        422,
        "/problems/missing-camera",
        "right",
    )


@pytest.mark.parametrize("host", ["10.0.0.1", "[::1]", "169.254.169.254"])
def test_hosts_that_are_not_named_are_refused(service, name, host):
    answer = service.http.put(f"/venues/{name}", json=with_sources(name, left=f"http://{host}/x"))
    assert (answer.status_code, answer.json()["type"], answer.json()["camera"]) == (
        422,
        "/problems/source-refused",
        "left",
    )


@pytest.mark.parametrize("url", ["ftp://127.0.0.1/x", "http://", "file:///etc/passwd", "http://127.0.0.1:x/", "x"])
def test_an_address_that_is_no_source_is_refused(service, name, url):
    answer = service.http.put(f"/venues/{name}", json=with_sources(name, left=url))
    assert problem_of(answer) == (422, "invalid-request")


def test_moving_a_source_does_not_disturb_a_calibration(service, camera, name):
    put(service, name, left=camera.url("/ok"), right=camera.url("/ok"))
    first = service.http.post(f"/venues/{name}/calibrate").json()["id"]
    put(service, name, left=camera.url("/ok?again"), right=camera.url("/ok"))
    assert service.end(first)["result"]["accepted"]


def test_the_command_line_needs_no_frames(service, camera, esc, name, tmp_path):
    put(service, name, left=camera.url("/ok"), right=camera.url("/ok"))
    saved = esc("snapshot", name, "-o", "now")
    assert saved.stdout.splitlines() == ["left=now/left.png", "right=now/right.png"]
    assert (tmp_path / "now/left.png").read_bytes() == png()
    assert esc("snapshot", name, "--camera", "right", "-o", "one").stdout == "right=one/right.png\n"
    done = esc("calibrate", name, "--wait")
    assert (done.returncode, json.loads(done.stdout)["status"]) == (0, "succeeded")


def due_now(service, name):
    """Let the schedule of a venue have been due a while ago."""
    s = tables.schedules.c
    an_hour_ago = datetime.now(UTC) - timedelta(hours=1)
    with service.database() as connection:
        due = sa.update(tables.schedules).where(s.venue == name)
        connection.execute(due.values(due_at=an_hour_ago, look_at=an_hour_ago))


def scheduled(name: str, **sources: str) -> dict:
    return with_sources(name, **sources) | {"schedule": {"cron": "0 3 * * *", "time_zone": "Asia/Tokyo"}}


def test_a_schedule_calibrates_by_itself_and_once_for_all_that_was_missed(service, camera, name):
    document = scheduled(name, left=camera.url("/ok"), right=camera.url("/ok"))
    service.http.put(f"/venues/{name}", json=document).raise_for_status()
    assert service.http.get(f"/venues/{name}").json()["schedule"] == document["schedule"] | {
        "exact": False,
        "options": None,
    }
    due_now(service, name)
    state = wait_for(lambda: (s := health(service, name)["schedule"])["last_job"] and s)
    assert service.end(state["last_job"])["result"]["accepted"]
    assert datetime.fromisoformat(state["next_at"]) > datetime.now(UTC)
    assert len(service.http.get("/jobs", params={"venue": name}).json()["jobs"]) == 1


def test_a_schedule_that_finds_no_frames_says_why_and_goes_on(service, camera, name):
    document = scheduled(name, left=camera.url("/ok"), right=camera.url("/gone"))
    service.http.put(f"/venues/{name}", json=document).raise_for_status()
    due_now(service, name)
    error = wait_for(lambda: health(service, name)["schedule"]["last_error"])
    assert "camera right" in error
    assert "404" in error
    failed = service.job(health(service, name)["schedule"]["last_job"])
    assert (failed["asked_by"], failed["frames"]) == ("schedule", {})
    assert (failed["status"], failed["error"]["camera"], failed["error"]["detail"]) == ("failed", "right", error)
    page = service.http.get(f"/ui/venues/{name}").text
    assert "0 3 * * * <span>Asia/Tokyo</span>" in page
    assert "The schedule, the last time: No frame of camera right" in page
    assert service.http.get(f"/ui/jobs/{failed['id']}").status_code == 200
    again = service.http.post(f"/jobs/{failed['id']}/again")
    assert (again.status_code, again.json()["detail"]) == (410, "It never had any; send new ones.")
    service.http.put(f"/venues/{name}", json=scheduled(name, left=camera.url("/ok"), right=camera.url("/ok")))
    due_now(service, name)
    wait_for(lambda: health(service, name)["schedule"]["last_job"] != failed["id"])


def test_a_schedule_needs_sources(service, camera, name):
    answer = service.http.put(f"/venues/{name}", json=scheduled(name, left=camera.url("/ok")))
    assert (answer.status_code, "right has none" in answer.json()["detail"]) == (422, True)


def health(service, name):
    return service.http.get(f"/venues/{name}/health").json()
