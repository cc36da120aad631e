"""How far apart two cameras put the same pixels on the ground, at the far touchline."""

import pytest

from testbed.synthetic import PITCH, camera, moved
from tests.scenes import unposed
from worker.calibration.geometry.camera import Pose
from worker.calibration.geometry.far_marking import far_marking_shift_m
from worker.calibration.geometry.parameters import with_focal_length

HEIGHT_M, AWAY_M = 10.0, 84.0
CAMERA = camera("left", (0.0, 34.0 - AWAY_M, HEIGHT_M), (0.0, 0.0), focal=2000.0, size=(3840, 2160))


def test_a_camera_and_itself_put_them_at_the_same_place():
    assert far_marking_shift_m(PITCH, CAMERA, CAMERA) == pytest.approx(0.0, abs=1e-6)


def test_a_camera_that_is_shifted_shifts_them_by_as_much():
    assert far_marking_shift_m(PITCH, CAMERA, moved(CAMERA, by=(0.03, 0.04, 0.0))) == pytest.approx(0.05, abs=1e-9)


def test_a_camera_that_is_higher_puts_the_far_touchline_farther_by_how_flat_it_sees_it():
    higher = moved(CAMERA, by=(0.0, 0.0, 0.02))
    # Straight ahead by 84 m per 10 m of height, and as much along the line to its sides in view.
    assert far_marking_shift_m(PITCH, CAMERA, higher) == pytest.approx(0.02 * AWAY_M / HEIGHT_M, rel=0.1)


def test_a_focal_length_that_is_a_little_longer_says_how_much_that_is_on_the_ground():
    longer = with_focal_length(CAMERA, 0.001 * 2000)
    ten_times = with_focal_length(CAMERA, 0.01 * 2000)
    little, much = (far_marking_shift_m(PITCH, CAMERA, other) for other in (longer, ten_times))
    assert 0.02 < little < 0.5
    assert much == pytest.approx(10 * little, rel=0.2)


def test_a_camera_that_sees_no_marking_puts_nothing_anywhere():
    assert far_marking_shift_m(PITCH, unposed(CAMERA), unposed(CAMERA)) is None


def test_pixels_that_the_other_camera_sees_above_the_horizon_are_nowhere():
    upwards = CAMERA.with_pose(Pose.looking_at(CAMERA.pose.position, [0.0, 100.0, 100.0]))
    assert far_marking_shift_m(PITCH, CAMERA, upwards) is None
