"""Real views are usable until something is done to them."""

import json

import cv2
import numpy as np
import pytest

from service.schemas.field import FieldOfPlay
from service.schemas.venue import Camera
from testbed import spoiling
from testbed.real_pair import FOLDER
from worker.calibration.detection.view_condition import look_at
from worker.jobs.from_schemas import camera_of, pitch_of

pytestmark = pytest.mark.real
FIELDS = FOLDER.parent / "fields"
SPOILED = {
    "dark": spoiling.darkened,
    "fogged": spoiling.fogged,
    "blinded": spoiling.blinded,
    "blocked": lambda frame: spoiling.blocked(frame, (40, 30, 30), 0.7),
}


def cases():
    listed = FIELDS / "cases.json"
    return json.loads(listed.read_text()) if listed.is_file() else []


@pytest.mark.parametrize("case", cases(), ids=lambda case: case["name"])
def test_frames_of_many_fields_are_usable(case):
    pose = case["camera"]["pose"]
    turn = cv2.Rodrigues(np.array(pose["rotation"]))[0]
    lens = {name: case["camera"][name] for name in ("id", "image_size", "intrinsics")}
    translation = (-turn @ np.array(pose["position"])).tolist()
    camera = camera_of(Camera.model_validate(lens | {"pose": pose | {"translation": translation}}))
    seen = look_at(cv2.imread(str(FIELDS / case["image"])), pitch_of(FieldOfPlay.model_validate(case["field"])), camera)
    assert seen.usable, seen.words


@pytest.mark.parametrize("number", [0, 1, 2])
def test_frames_are_usable_from_outdated_poses(real_pair, number):
    for camera in real_pair.started("paper", number):
        seen = look_at(real_pair.frames()[camera.id][0], real_pair.pitch, camera)
        assert seen.usable, seen.words
        assert seen.figures.lines_found > 0.5


@pytest.mark.parametrize("cause", SPOILED)
def test_what_is_done_to_real_frames_is_named(real_pair, cause):
    for camera in real_pair.started("paper", 0):
        seen = look_at(SPOILED[cause](real_pair.frames()[camera.id][0]), real_pair.pitch, camera)
        assert seen.cause == cause, seen
