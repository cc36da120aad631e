"""The derivatives of a pose and a lens are those of small changes of them, for both lens models."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.worker.calibration.geometry.differences import assert_alike, differences
from worker.calibration.geometry.camera import Camera, Pose, inside
from worker.calibration.geometry.derivatives import (
    change_between,
    ground_jacobian,
    lens_jacobian,
    moved,
    pixel_jacobian,
)
from worker.calibration.geometry.lens import Fisheye, Intrinsics

pytestmark = pytest.mark.slow

SIZE = (1920, 1080)
MATRIX = np.array([[1250.0, 2.0, 970], [0, 1240, 530], [0, 0, 1]])
LENSES = {
    "opencv": Intrinsics(
        MATRIX, np.array([-0.28, 0.09, 1e-3, -2e-3, 0.01, 0.02, 0, 0, 1e-3, 0, 2e-3, 0, 0.01, 0.02]), SIZE
    ),
    "fisheye": Fisheye(MATRIX * [[0.5, 0.5, 1], [1, 0.5, 1], [1, 1, 1]], np.array([-0.02, 0.004, -0.002, 3e-4]), SIZE),
    "tele": Intrinsics(MATRIX * [[6, 1, 1], [1, 6, 1], [1, 1, 1]], np.array([-0.1, 0.0, 0.0, 0.0]), SIZE),
}
POSE_STEPS = np.array([1e-4] * 3 + [1e-3] * 3)
lenses = st.sampled_from(sorted(LENSES))
angles, aside, heights = st.floats(-20, 20), st.floats(-30, 30), st.floats(4, 25)


def camera(name, x, height, target, roll_deg):
    return Camera(name, LENSES[name], Pose.looking_at([x, -46.0, height], [target, 0.0, 0.0], roll_deg))


def in_view(one):
    """Points (N, 3) of the ground and above it that the camera sees, and still does from a little beside.

    Where a fisheye's field of view ends inside the picture, a point may be in view and no longer after a step.
    """
    points = np.random.default_rng(0).uniform([-50, -34, 0], [50, 34, 2.5], size=(600, 3))
    points = np.concatenate([points[inside(one.project(points), SIZE)], on_border(one)])
    return points[np.isfinite(by_pose(one, points)).all(axis=(1, 2))]


def on_border(one):
    """Points (N, 3) of the ground that the camera sees on the border of its picture."""
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]) * (np.array(SIZE) - 1.0)
    rays = one.rays(np.concatenate([np.linspace(first, last, 20) for first, last in pairwise(corners)]))
    rays = rays[rays[:, 2] < -0.02]
    return one.pose.position - rays * (one.pose.position[2] / rays[:, 2:])


def by_pose(one, points):
    return differences(lambda change: moved(one, change).project(points), POSE_STEPS)


@settings(max_examples=15)
@given(lenses, aside, heights, aside, angles)
def test_pixels_move_as_they_do_after_small_changes_of_the_pose(name, x, height, target, roll):
    one = camera(name, x, height, target, roll)
    points = in_view(one)
    assert_alike(pixel_jacobian(one, points), by_pose(one, points), of=(0, 1))


@settings(max_examples=15)
@given(lenses, aside, heights, aside, angles)
def test_what_is_seen_on_the_ground_moves_as_a_pose_that_is_a_little_wrong_puts_it(name, x, height, target, roll):
    one = camera(name, x, height, target, roll)
    points = in_view(one) * [1.0, 1.0, 0.1]
    points = points[inside(one.project(points), SIZE, margin=5)]
    pixels = one.project(points)

    def put(change):
        believed = moved(one, change)
        rays = believed.rays(pixels)
        start = believed.pose.position
        return (start + rays * ((points[:, 2] - start[2]) / rays[:, 2])[:, None])[:, :2]

    jacobian = ground_jacobian(one, points)
    np.testing.assert_allclose(jacobian, differences(put, POSE_STEPS), rtol=1e-4, atol=1e-2)


def test_points_on_a_grid_have_the_derivatives_that_they_have_in_a_row():
    one = camera("opencv", 0.0, 10.0, 5.0, 2.0)
    points = in_view(one)[:60]
    for jacobian in (pixel_jacobian, ground_jacobian, lens_jacobian):
        np.testing.assert_array_equal(jacobian(one, points.reshape(6, 10, 3)).reshape(60, 2, 6), jacobian(one, points))


def test_what_the_camera_cannot_see_has_no_derivatives():
    one = camera("fisheye", 0.0, 10.0, 0.0, 0.0)
    behind = np.array([[0.0, -80.0, 0.0], [0.0, -46.0, 10.0]])
    assert np.isnan(pixel_jacobian(one, behind)).all()
    assert np.isnan(lens_jacobian(one, behind)).all()


@given(lenses, aside, st.lists(st.floats(-0.5, 0.5), min_size=6, max_size=6).map(np.array))
def test_a_change_is_found_again_between_the_poses_before_and_after(name, x, change):
    one = camera(name, x, 10.0, 0.0, 1.0)
    assert change_between(one, moved(one, change)) == pytest.approx(change, abs=1e-9)
