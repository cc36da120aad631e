"""Readings of poses: each convention in which a camera can be written is undone by the reading that names it."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.schemas.check import CheckedCamera
from service.schemas.geometry import Intrinsics
from service.schemas.geometry import Pose as PoseSchema
from testbed.spoiled_calibrations import spoiled_ways
from testbed.synthetic import CROWNED, pair, pair_markings
from worker.calibration.checking.ranking import rank_readings
from worker.calibration.checking.readings import readings
from worker.calibration.geometry.camera import Pose
from worker.calibration.relocalisation.line_view import LineView
from worker.calibration.relocalisation.sought import KNOCKED_ROLL_DEG

HALF = np.array([52.5, 34.0])
ALL = list(readings())
POSE_WAYS = {
    name: way
    for name, way in spoiled_ways().items()
    if way.causes and not way.causes & {"zoomed", "folds", "other-resolution", "distortion-order", "turned"}
}
HALF_TURN = np.diag([-1.0, -1.0, 1.0])


def is_same_on_a_symmetric_field(pose, rotation, position):
    """True for a pose, or for its twin half a turn about the middle of the field."""
    return any(
        np.allclose(pose.matrix, rotation @ turn, atol=1e-6) and np.allclose(pose.position, turn @ position, atol=1e-6)
        for turn in (np.eye(3), HALF_TURN)
    )


@pytest.mark.parametrize("name", POSE_WAYS)
@given(st.floats(-60, 60), st.floats(-80, -40), st.floats(5, 25), st.floats(-30, 30), st.floats(-5, 5))
@settings(max_examples=5, deadline=None)
def test_what_was_written_in_another_convention_is_read_by_naming_it(name, x, y, z, aim, roll):
    true = Pose.looking_at([x, y, z], [aim, 0.0, 0.0], roll)
    lens = Intrinsics(matrix=[[900, 0, 640], [0, 900, 360], [0, 0, 1]], distortion=[])
    pose = PoseSchema.from_position(true.rotation.tolist(), true.position.tolist())
    written = (
        POSE_WAYS[name].spoil(CheckedCamera(id="left", image_size=[1280, 720], intrinsics=lens, pose=pose), HALF).pose
    )
    given_pose = Pose(np.array(written.rotation), np.array(written.position))
    named = [reading for reading in ALL if set(reading.causes) == POSE_WAYS[name].causes]
    assert any(
        is_same_on_a_symmetric_field(reading.pose(given_pose, HALF), true.matrix, true.position) for reading in named
    )


def test_the_first_reading_is_the_file_at_its_word():
    given_pose = Pose(np.array([1.5, 0.2, -0.3]), np.array([-1.0, -49.0, 8.0]))
    first = ALL[0].pose(given_pose, HALF)
    assert ALL[0].causes == ()
    np.testing.assert_allclose(first.rotation, given_pose.rotation)
    np.testing.assert_allclose(first.position, given_pose.position)


def test_readings_say_in_words_what_differs():
    words = {word for reading in ALL for word in reading.words}
    assert "its places are in centimetres, not in metres" in words
    assert "x, y, z of the field are x, -z, y of its world" in words
    assert all(len(reading.words) == len(reading.causes) for reading in ALL)


def test_on_a_symmetric_field_what_is_half_turned_is_read_without_a_turn():
    given_pose = Pose(np.array([1.5, 0.2, -0.3]), np.array([-1.0, -49.0, 8.0]))
    without = {reading.causes: [] for reading in ALL}
    for reading in ALL:
        without[reading.causes].append(reading.pose(given_pose, HALF))
    for reading in (one for one in ALL if one.is_half_turn):
        pose = reading.pose(given_pose, HALF)
        simpler = tuple(cause for cause in reading.causes if cause != "world-axes")
        assert any(is_same_on_a_symmetric_field(one, pose.matrix, pose.position) for one in without[simpler])


def test_a_file_whose_origin_is_a_corner_is_told_by_the_lines_in_its_frame():
    left, paint = pair()[0], pair_markings()[0]
    from_corner = left.with_pose(replace(left.pose, position=left.pose.position - [-52.5, 34.0, 0.0]))
    view = LineView.of((255 * paint).astype(np.uint8), left.intrinsics, KNOCKED_ROLL_DEG)
    assert rank_readings(CROWNED, [from_corner], [[view]], 0)[0].causes == ("corner-origin",)
