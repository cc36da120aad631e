"""How far a camera has moved from its anchor, in metres at the farthest marking in view."""

from dataclasses import replace

import numpy as np
import pytest

from testbed.synthetic import BARREL, PITCH, camera
from tests.scenes import unposed
from tests.worker.calibration.gate.good_result import good
from worker.calibration.gate.displacement import farthest_place, measure_displacement, sight_axes
from worker.calibration.geometry import derivatives
from worker.calibration.refinement.uncertainty import Deviation, Sigma

ANCHOR = camera("left", (0.0, -44.0, 10.0), (0.0, 10.0), focal=900.0, distortion=BARREL)
SMALL_RAD = 1e-4


def answered(change, **known):
    """The answer of the finish for a camera that has moved by a change (6,) from the anchor."""
    return replace(good(), camera=derivatives.moved(ANCHOR, np.array(change, dtype=float)), **known)


def distance_m(place):
    return float(np.linalg.norm((place - ANCHOR.pose.position)[:2]))


def test_the_farthest_place_lies_on_the_far_touchline_and_in_the_picture():
    place = farthest_place(PITCH, ANCHOR)
    assert place[1] == pytest.approx(34.0, abs=PITCH.line_width)
    assert ANCHOR.sees(ANCHOR.project(place))


def test_a_camera_that_sees_no_marking_has_no_farthest_place():
    assert farthest_place(PITCH, unposed(ANCHOR)) is None


def test_a_camera_at_its_anchor_has_not_moved():
    found = measure_displacement(PITCH, ANCHOR, answered([0] * 6))
    assert found.shift == pytest.approx([0.0, 0.0], abs=1e-9)


def test_a_pan_moves_the_far_touchline_across_the_line_of_sight_by_distance_times_angle():
    # About the world's vertical: the far place turns about the camera's foot. Seen from a camera that is turned to the
    # left, the same pixel lies further left on the ground.
    up_in_camera = ANCHOR.pose.matrix @ [0.0, 0.0, 1.0]
    found = measure_displacement(PITCH, ANCHOR, answered([*(-SMALL_RAD * up_in_camera), 0, 0, 0]))
    assert found.shift == pytest.approx([-SMALL_RAD * distance_m(found.place), 0.0], rel=1e-3, abs=1e-6)


def test_a_tilt_moves_it_along_the_line_of_sight_by_far_more():
    away = sight_axes(ANCHOR, farthest_place(PITCH, ANCHOR))[1]
    right_in_camera = ANCHOR.pose.matrix @ [away[1], -away[0], 0.0]
    found = measure_displacement(PITCH, ANCHOR, answered([*(-SMALL_RAD * right_in_camera), 0, 0, 0]))
    height, distance = ANCHOR.pose.position[2], distance_m(found.place)
    expected = SMALL_RAD * (distance**2 + height**2) / height
    assert found.shift == pytest.approx([0.0, expected], rel=5e-3, abs=1e-6)


def test_a_camera_that_is_shifted_moves_it_by_as_much():
    found = measure_displacement(PITCH, ANCHOR, answered([0, 0, 0, 0.03, 0.04, 0.0]))
    assert np.hypot(*found.shift) == pytest.approx(0.05, rel=1e-6)


def test_the_shift_is_positive_to_the_right_and_away_from_the_camera():
    # By hand, and not by `sight_axes`: a camera that stands further ahead has all of its ground further ahead.
    place, foot = farthest_place(PITCH, ANCHOR)[:2], ANCHOR.pose.position[:2]
    ahead = (place - foot) / np.linalg.norm(place - foot)
    right = np.array([ahead[1], -ahead[0]])
    assert ANCHOR.project(np.array([[*(place + right), 0.0]]))[0, 0] > ANCHOR.project(np.array([[*place, 0.0]]))[0, 0]
    for step, expected in ((ahead, [0.0, 0.04]), (right, [0.04, 0.0])):
        found = measure_displacement(PITCH, ANCHOR, answered([0, 0, 0, *(0.04 * step), 0.0]))
        assert found.shift == pytest.approx(expected, abs=1e-6)


@pytest.mark.long
def test_sigma_is_that_of_the_pose_at_that_place():
    rng = np.random.default_rng(3)
    root = rng.normal(size=(6, 6)) * np.repeat([2e-5, 3e-3], 3)[:, None]
    covariance = root @ root.T
    stated = measure_displacement(PITCH, ANCHOR, answered([0] * 6, covariance=covariance)).sigma
    changes = rng.multivariate_normal(np.zeros(6), covariance, size=300)
    shifts = np.array([measure_displacement(PITCH, ANCHOR, answered(change)).shift for change in changes])
    assert stated == pytest.approx(shifts.std(axis=0), rel=0.15)


def test_repeatability_is_the_stated_part_of_sigma_and_never_more_than_all_of_it():
    all_of_it = measure_displacement(PITCH, ANCHOR, answered([0] * 6, repeatability=Sigma(9.0, 9.0)))
    whole = good().sigma
    half = Sigma(whole.rotation_deg / 2, whole.position_m / 4)
    part = measure_displacement(PITCH, ANCHOR, answered([0] * 6, repeatability=half))
    assert all_of_it.repeatability == pytest.approx(all_of_it.sigma)
    assert part.repeatability == pytest.approx(part.sigma / 2)


def test_a_focal_length_is_told_beside_the_anchors_with_what_it_would_move():
    zoom = Deviation("left", "focal_length_px", 9.0, 1.8, 0.3)
    found = measure_displacement(PITCH, ANCHOR, answered([0] * 6, zoom=zoom))
    assert (found.focal.value, found.focal.sigma) == pytest.approx((0.01, 0.002))
    longer = ANCHOR.with_lens(replace(ANCHOR.intrinsics, matrix=ANCHOR.intrinsics.matrix * [[1.001], [1.001], [1]]))
    kept_centre = longer.intrinsics.matrix.copy()
    kept_centre[:2, 2] = ANCHOR.intrinsics.matrix[:2, 2]
    longer = ANCHOR.with_lens(replace(ANCHOR.intrinsics, matrix=kept_centre))
    seen = measure_displacement(PITCH, ANCHOR, replace(good(), camera=longer))
    assert np.hypot(*seen.shift) == pytest.approx(0.001 * found.focal_shift_m, rel=0.02)


def test_a_lens_that_was_found_with_the_pose_has_no_focal_length_of_its_own_sigma():
    assert measure_displacement(PITCH, ANCHOR, answered([0] * 6, zoom=None)).focal is None


def test_a_pose_without_a_covariance_or_that_looks_at_the_sky_has_no_displacement():
    assert measure_displacement(PITCH, ANCHOR, answered([0] * 6, covariance=None)) is None
    assert measure_displacement(PITCH, ANCHOR, answered([np.radians(-60.0), 0, 0, 0, 0, 0])) is None
