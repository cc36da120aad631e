"""The poses of a clip leave frame by frame, each format as its readers take it, with the time that the frame has."""

import csv
import json
from dataclasses import replace
from fractions import Fraction

import cv2
import jsonschema_rs
import numpy as np
import pytest

from service.formats import opentrackio
from service.formats.clip import ClipPoses, TrackedCamera
from service.formats.opentrackio import SteadyAngles
from service.schemas.geometry import Pose
from service.schemas.problems import Problem
from tests.service.formats.cameras import ALL_OF_OPENCV_8, farthest, seen_points, shot
from tests.service.formats.test_formats import AS_PUBLISHED_PX, SCHEMA, project_by_opentrackio, read_freed, turn

FRAMES = 60
AXES = "x y z pan tilt roll"


def turning(number, frame):
    """A camera that turns a little with every frame."""
    still = shot(ALL_OF_OPENCV_8, number=number)
    rotation = (np.array(still.camera.pose.rotation) + [0.0, 1e-4 * frame, 0.0]).tolist()
    pose = Pose.from_position(rotation, still.camera.pose.position)
    return replace(still, camera=still.camera.model_copy(update={"pose": pose}))


@pytest.fixture
def written(tmp_path):
    with ClipPoses(tmp_path / "final.cut", [shot(), shot(number=2)], AXES) as poses:
        for frame in range(FRAMES):
            status = "coasted" if frame == 7 else "measured"
            cameras = [TrackedCamera(turning(n, frame), status, (0.02, 0.03), (0.002, 0.004)) for n in (1, 2)]
            poses.add(cameras, Fraction(30000, 1001))
    return tmp_path


def test_a_sample_for_each_camera_and_frame_is_valid_and_reprojects(written):
    samples = [json.loads(line) for line in (written / "final.cut.jsonl").read_text().splitlines()]
    assert len(samples) == 2 * FRAMES
    validator = jsonschema_rs.Draft202012Validator(SCHEMA)
    for number, sample in enumerate(samples):
        validator.validate(sample)
        assert (sample["timing"]["sequenceNumber"], sample["sourceNumber"]) == (number // 2, 1 + number % 2)
    assert len({sample["sampleId"] for sample in samples}) == len(samples)
    camera = turning(2, 59)
    world, pixels = seen_points(camera)
    assert farthest(project_by_opentrackio(samples[-1], world), pixels) < AS_PUBLISHED_PX


def test_samples_say_the_rate_exactly_the_timecode_of_their_frame_and_how_they_are_known(written):
    samples = [json.loads(line) for line in (written / "final.cut.jsonl").read_text().splitlines()]
    last = samples[-1]["timing"]
    assert last["sampleRate"] == {"num": 30000, "denom": 1001}
    assert [last["timecode"][part] for part in ("hours", "minutes", "seconds", "frames")] == [0, 0, 1, 29]
    assert [sample["tracker"]["status"] for sample in samples[12:16]] == 2 * ["measured"] + 2 * ["coasted"]


def test_timecode_goes_on_after_an_hour_and_starts_anew_after_a_day():
    for number, expected in ((25 * 3661 + 3, [1, 1, 1, 3]), (25 * 86400, [0, 0, 0, 0])):
        sample = json.loads(
            opentrackio.write_frame(shot(), opentrackio.Frame(number, Fraction(25), "measured"), SteadyAngles())
        )
        jsonschema_rs.Draft202012Validator(SCHEMA).validate(sample)
        assert [sample["timing"]["timecode"][part] for part in ("hours", "minutes", "seconds", "frames")] == expected


def test_a_rate_that_timecode_cannot_count_is_refused():
    with pytest.raises(Problem, match="up to 120 frames a second; the clip has 240"):
        opentrackio.write_frame(shot(), opentrackio.Frame(0, Fraction(240), "measured"), SteadyAngles())


@pytest.mark.parametrize("about", ["z", "y"], ids=["pan", "roll"])
def test_angles_go_on_over_half_a_turn(about):
    """A camera that looks towards the near side, or hangs upside down, and sways."""
    angles, found = SteadyAngles(), []
    for degrees in (179.99, 180.01, 180.5, 179.5):
        ahead = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
        rotation = cv2.Rodrigues(ahead @ turn(about, degrees).T)[0].ravel().tolist()
        frame = opentrackio.Frame(0, Fraction(25), "measured")
        sample = json.loads(opentrackio.write_frame(shot(rotation=rotation), frame, angles))
        found.append(sample["transforms"][0]["rotation"][{"z": "pan", "y": "roll"}[about]])
    assert found == pytest.approx([179.99, 180.01, 180.5, 179.5], abs=1e-6)


def test_freed_has_a_packet_for_each_camera_and_frame(written):
    packets = (written / "final.cut.d1").read_bytes()
    assert len(packets) == 29 * 2 * FRAMES
    first, last = (read_freed(packets[29 * at : 29 * (at + 1)]) for at in (0, 2 * FRAMES - 1))
    assert (first[0], last[0]) == (1, 2)
    sample = json.loads(opentrackio.write(turning(2, 59)))["transforms"][0]
    theirs = [sample["rotation"][angle] for angle in ("pan", "tilt", "roll")]
    np.testing.assert_allclose(last[1] * [-1, 1, 1], theirs, atol=1 / 32768)
    np.testing.assert_allclose(last[2], list(sample["translation"].values()), atol=1 / 64_000)


def test_the_table_has_poses_and_how_sure_they_are(written):
    with (written / "final.cut.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * FRAMES
    assert (rows[15]["frame"], rows[15]["camera"], rows[15]["status"]) == ("7", "camera-2", "coasted")
    assert float(rows[-1]["rotation_y_rad"]) == pytest.approx(turning(2, 59).camera.pose.rotation[1], abs=1e-8)
    assert float(rows[0]["motion_sigma_position_m"]) == 0.004


def test_a_lens_that_opentrackio_cannot_hold_is_refused_before_there_are_files(tmp_path):
    with pytest.raises(Problem, match="no place for s1"):
        ClipPoses(tmp_path / "poses", [shot([*ALL_OF_OPENCV_8, 0.001, 0, 0, 0])], AXES)
    assert not list(tmp_path.iterdir())
