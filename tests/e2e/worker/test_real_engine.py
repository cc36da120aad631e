"""The real engine and the real network behind the front door, on rendered frames of reduced size."""

import json

import cv2
import numpy as np
import pytest

from testbed import demo_pair
from testbed.rendered_pair import PITCH, SIZE, cameras, frames, venue
from testbed.running import Service
from worker.calibration.geometry.rotation import rotation_angles_deg


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
    job = calibrated(service, demo_pair.venue(name), demo_pair.frames())
    result = job["result"]
    assert result["rejected_because"] is None
    for truth, camera in zip(demo_pair.cameras(), result["cameras"], strict=True):
        assert np.linalg.norm(np.array(camera["pose"]["position"]) - truth.pose.position) < 0.12
        assert rotation_angles_deg(camera["pose"]["rotation"], truth.pose.rotation) < 0.15
    assert result["stitch_error_px"] < 1 < result["stitch_error_before_px"]
    assert stored_position(service, name) == result["cameras"][0]["pose"]["position"]
    for picture in ("preview", "birdseye", "overlay/left", "overlay/right"):
        data = service.http.get(f"/jobs/{job['id']}/{picture}.jpg").raise_for_status().content
        assert cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR).std() > 20


@pytest.mark.long
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


@pytest.mark.long
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
