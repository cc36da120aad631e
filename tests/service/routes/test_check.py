"""Checks of calibrations by HTTP: any tool's file and frames become a job with a grade for each camera."""

import io
import json
import zipfile

import pytest

from service.formats.conversion import members_of, write_cameras
from service.formats.records import CameraRecord
from service.schemas.geometry import Intrinsics, Pose
from testbed.running import png, upload
from tests.problems import problem_of

LENS = Intrinsics(matrix=[[60, 0, 32], [0, 60, 24], [0, 0, 1]], distortion=[])
POSE = Pose.from_position([1.6, 0.1, -0.2], [-1.0, -50.0, 8.0])
TENNIS = {"field": {"template": "tennis"}, "seed": 5}


def calibration(form, *cameras):
    """Files of a format, by their names."""
    records = [CameraRecord(camera, LENS, (64, 48), POSE) for camera in cameras]
    return members_of(write_cameras(records, form), cameras[0])


def check(service, files, frames, headers=None, **options):
    parts = [("calibration", (name, data)) for name, data in files.items()]
    return service.http.post(
        "/check", files=[*parts, *frames, ("options", (None, json.dumps(options)))], headers=headers
    )


def test_a_file_and_frames_become_a_job_that_grades_each_camera(service):
    answer = check(service, calibration("colmap", "left", "right", "top"), upload(), **TENNIS)
    job = answer.json()
    assert (answer.status_code, job["kind"], job["venue"]) == (202, "check", None)
    job = service.end(job["id"])
    result = job["result"]
    assert (result["grade"], result["format"]) == ("drifted", "colmap")
    assert [(one["id"], one["grade"]) for one in result["cameras"]] == [("left", "good"), ("right", "drifted")]
    assert job["options"]["seed"] == 5
    given = {one["id"]: one for one in job["options"]["cameras"]}
    assert given["left"]["pose"]["position"] == pytest.approx(POSE.position)
    assert job["id"] in [one["id"] for one in service.http.get("/jobs", params={"kind": "check"}).json()["jobs"]]


def test_a_format_with_a_file_for_each_camera_is_sent_as_several_files_of_one_part(service):
    files = calibration("opencv", "left", "right")
    assert len(files) == 2
    assert service.end(check(service, files, upload(), **TENNIS).json()["id"])["result"]["format"] == "opencv"


def test_a_zip_is_unpacked_and_one_without_a_calibration_refused(service):
    def zipped(files):
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as content:
            for name, data in files.items():
                content.writestr(name, data)
        return {"calibration.zip": packed.getvalue()}

    answer = check(service, zipped(calibration("colmap", "left", "right")), upload(), **TENNIS)
    assert service.end(answer.json()["id"])["result"]["format"] == "colmap"
    assert problem_of(check(service, zipped({"notes.pdf": b"%PDF"}), upload(), **TENNIS)) == (
        422,
        "calibration-refused",
    )
    bomb = zipped({"left.yml": bytes(9 << 20)})
    assert problem_of(check(service, bomb, upload(), **TENNIS)) == (422, "calibration-refused")


def test_the_only_camera_of_a_file_is_called_as_its_frame(service):
    answer = check(service, calibration("pose2sim", "int_cam0_img"), upload(cameras=("left",)), **TENNIS)
    assert [one["id"] for one in service.end(answer.json()["id"])["result"]["cameras"]] == ["left"]


def test_the_same_key_and_content_are_the_same_job(service):
    key = {"Idempotency-Key": "check-1"}
    files = calibration("colmap", "left", "right")
    first, again = (check(service, files, upload(), key, **TENNIS) for _ in range(2))
    other = check(service, files, upload(shade=9), key, **TENNIS)
    assert (first.status_code, again.status_code, other.status_code) == (202, 200, 422)
    assert first.json()["id"] == again.json()["id"]


def test_a_check_is_run_again_with_its_frames(service):
    job = service.end(check(service, calibration("colmap", "left", "right"), upload(), **TENNIS).json()["id"])
    again = service.http.post(f"/jobs/{job['id']}/again")
    assert again.status_code == 202
    assert service.end(again.json()["id"])["result"]["cameras"] == job["result"]["cameras"]


def test_what_cannot_be_checked_is_refused_with_what_was_expected(service):
    good = calibration("colmap", "left", "right")
    assert problem_of(check(service, {}, upload(), **TENNIS)) == (422, "calibration-refused")
    broken = check(service, {"calib.toml": b"[cam]\nname = 1"}, upload(), **TENNIS)
    assert problem_of(broken) == (422, "calibration-refused")
    assert "calib.toml" in broken.json()["detail"]
    assert problem_of(check(service, good, [], **TENNIS)) == (422, "missing-camera")
    assert problem_of(check(service, good, upload())) == (422, "invalid-request")
    unknown = check(service, good, [("top", ("top.png", png()))], **TENNIS)
    assert problem_of(unknown) == (422, "unknown-camera")
    assert unknown.json()["expected"] == ["left", "right"]
    assert problem_of(check(service, good, [("left", ("left.png", b"GIF89a"))], **TENNIS)) == (422, "not-an-image")
    text = service.http.post("/check", files=[("calibration", (None, "x")), ("options", (None, json.dumps(TENNIS)))])
    assert problem_of(text) == (422, "not-a-file")
