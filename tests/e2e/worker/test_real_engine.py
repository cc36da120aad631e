"""The real engine and the real network behind the front door, on rendered frames of reduced size."""

import json
from functools import cache

import cv2
import numpy as np
import pytest

from models.training.pitches.render import Conditions, render_frame
from tests.e2e.running import Service
from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import Intrinsics
from worker.calibration.geometry.rotation import rotation_angles_deg

SIZE = (960, 540)
PITCH = Field(105.0, 68.0, 0.12, np.array([[-18.5, 0.0, 0.35], [18.5, 0.0, 0.35]]))
MOVED_M = np.array([0.06, -0.05, 0.04])
TURNED = np.array([0.006, -0.005, 0.004])


def cameras() -> list[Camera]:
    lens = Intrinsics(
        np.array([[615.0, 0, 480.5], [0, 615.0, 267.5], [0, 0, 1]]), np.array([-0.3, 0.08, 0, 0, 0]), SIZE
    )
    return [
        Camera("left", lens, Pose.looking_at([-0.9, -48.0, 12.0], [-22.0, -12.0, 0.0])),
        Camera("right", lens, Pose.looking_at([0.8, -48.0, 12.0], [22.0, -12.0, 0.0])),
    ]


@cache
def frames() -> dict[str, bytes]:
    rng = np.random.default_rng(0)
    return {c.id: encoded(render_frame(PITCH, c, Conditions.fair(22), rng).frame) for c in cameras()}


def encoded(frame: np.ndarray) -> bytes:
    return cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, 92])[1].tobytes()


def venue(name: str, right_turn=TURNED) -> dict:
    return {
        "id": name,
        "name": "Rendered pitch",
        "field": {"length_m": 105, "width_m": 68, "line_width_m": 0.12, "ridge": PITCH.ridge.tolist()},
        "cameras": [
            {
                "id": c.id,
                "image_size": list(SIZE),
                "intrinsics": {
                    "matrix": c.intrinsics.matrix.tolist(),
                    "distortion": c.intrinsics.distortion.tolist(),
                },
                "pose": {
                    "rotation": (c.pose.rotation + (TURNED if c.id == "left" else right_turn)).tolist(),
                    "position": (c.pose.position + MOVED_M).tolist(),
                },
            }
            for c in cameras()
        ],
    }


@pytest.fixture
def service(service_with_engine):
    return service_with_engine


def calibrated(service: Service, document: dict, files: dict[str, bytes], **options) -> dict:
    service.http.put(f"/venues/{document['id']}", json=document).raise_for_status()
    parts = [(name, (f"{name}.jpg", data)) for name, data in files.items()]
    answer = service.http.post(
        f"/venues/{document['id']}/calibrate",
        files=[*parts, ("options", (None, json.dumps({"seed": 1, **options})))],
    )
    assert answer.status_code == 202, answer.text
    return service.end(answer.json()["id"])


def stored_position(service: Service, name: str, index: int = 0) -> list[float]:
    return service.http.get(f"/venues/{name}").json()["cameras"][index]["pose"]["position"]


def test_outdated_poses_are_found_again_and_stored(service, name):
    job = calibrated(service, venue(name), frames())
    result = job["result"]
    assert result["rejected_because"] is None
    for truth, camera in zip(cameras(), result["cameras"], strict=True):
        assert np.linalg.norm(np.array(camera["pose"]["position"]) - truth.pose.position) < 0.12
        assert rotation_angles_deg(camera["pose"]["rotation"], truth.pose.rotation) < 0.15
    assert result["stitch_error_px"] < 1 < result["stitch_error_before_px"]
    assert stored_position(service, name) == result["cameras"][0]["pose"]["position"]
    for picture in ("preview", "birdseye", "overlay/left", "overlay/right"):
        data = service.http.get(f"/jobs/{job['id']}/{picture}.jpg").raise_for_status().content
        assert cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR).std() > 20


def test_a_black_frame_is_rejected_by_the_name_of_its_camera_and_the_stored_pose_stays(service, name):
    dark = {**frames(), "right": encoded(np.zeros((SIZE[1], SIZE[0], 3), np.uint8))}
    result = calibrated(service, venue(name), dark)["result"]
    assert result["rejected_because"].startswith("camera right: ")
    assert stored_position(service, name, 1) == venue(name)["cameras"][1]["pose"]["position"]


def test_a_camera_that_looks_elsewhere_than_it_is_stored_is_found_by_its_frame_and_taken(service, name):
    stored = venue(name, right_turn=np.array([1.2, 0.0, 0.0]))
    service.http.put(f"/venues/{name}", json=stored).raise_for_status()
    files = [(camera, (f"{camera}.jpg", frame)) for camera, frame in frames().items()]
    options = ("options", (None, json.dumps({"cameras": ["right"], "seed": 1})))
    job = service.http.post(f"/venues/{name}/find", files=[*files, options]).raise_for_status().json()
    job = service.end(job["id"])
    assert job["result"]["rejected_because"] is None
    (found,) = job["result"]["cameras"]
    assert all(f"candidate/right/{number}" in job["links"] for number in range(1, len(found["candidates"]) + 1))
    picture = service.http.get(job["links"]["candidate/right/1"]).raise_for_status().content
    assert cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR).shape == (SIZE[1], SIZE[0], 3)
    taken = service.http.post(f"/venues/{name}/adopt-found", json={"job": job["id"]}).raise_for_status().json()
    left, right = taken["cameras"]
    truth = cameras()[1].pose
    assert np.linalg.norm(np.array(right["pose"]["position"]) - truth.position) < 0.15
    assert rotation_angles_deg(right["pose"]["rotation"], truth.rotation) < 0.2
    assert right["intrinsics"]["matrix"] == stored["cameras"][1]["intrinsics"]["matrix"]
    assert left["pose"]["position"] == stored["cameras"][0]["pose"]["position"]


def test_a_stored_pose_that_looks_at_the_sky_is_refused_by_the_name_of_its_camera_and_the_other_is_calibrated(
    service, name
):
    job = calibrated(service, venue(name, right_turn=np.array([1.2, 0.0, 0.0])), frames())
    left, right = job["result"]["cameras"]
    assert (left["accepted"], right["accepted"]) == (True, False)
    assert right["refusal"] == "/refusals/no-markings-in-view"
    assert "first pose" in right["rejected_because"]
    assert service.http.get("/readyz").status_code == 200


def test_the_measures_of_a_pitch_are_found_and_drawn(service, name):
    document = venue(name)
    document["field"] = {"length_m": 104, "width_m": 67.4, "line_width_m": 0.12}
    service.http.put(f"/venues/{name}", json=document).raise_for_status()
    parts = [(camera, (f"{camera}.jpg", data)) for camera, data in frames().items()]
    answer = service.http.post(
        f"/venues/{name}/field/fit", files=[*parts, ("options", (None, json.dumps({"seed": 1})))]
    )
    job = service.end(answer.json()["id"])
    result = job["result"]
    assert result["rejected_because"] is None
    truth = {"length_m": PITCH.length, "width_m": PITCH.width, "ridge_height_m": PITCH.ridge_height}
    for measure in result["measures"]:
        if measure["name"] in truth:
            assert measure["known"]
            assert abs(measure["value"] - truth[measure["name"]]) < 3 * measure["sigma"]
    data = service.http.get(job["links"]["overlay/left"]).raise_for_status().content
    assert cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR).std() > 20
