"""Panoramas have a ray for each pixel of theirs, a pixel for each ray of theirs, and derivatives of both."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.worker.calibration.geometry.differences import assert_alike, differences
from worker.calibration.geometry.camera import Camera, Pose, inside
from worker.calibration.geometry.derivatives import full_pixel_jacobian, moved
from worker.calibration.geometry.lens import Fisheye
from worker.calibration.geometry.panorama import Cylindrical, Equirectangular
from worker.calibration.geometry.parameters import with_lens_changed

SIZE = (2000, 640)


def lens(model, view_deg, aspect, aside):
    fx = SIZE[0] / np.radians(view_deg)
    matrix = np.array([[fx, 0, SIZE[0] / 2 + aside[0]], [0, aspect * fx, SIZE[1] / 2 + aside[1]], [0, 0, 1]])
    return model(matrix, np.empty(0), SIZE)


panoramas = st.builds(
    lens,
    st.sampled_from([Cylindrical, Equirectangular]),
    st.floats(60, 350),
    st.floats(0.8, 1.2),
    st.tuples(st.floats(-10, 10), st.floats(-300, 300)),
)
directions = st.tuples(*[st.floats(-1, 1)] * 3).map(np.array).filter(lambda one: np.hypot(one[0], one[2]) > 0.2)


def all_over(one):
    columns, rows = np.meshgrid(np.linspace(0, SIZE[0] - 1, 25), np.linspace(0, SIZE[1] - 1, 9))
    pixels = np.stack([columns, rows], axis=-1)
    return pixels[np.isfinite(one.directions(pixels)).all(axis=-1)]


@given(panoramas)
def test_a_pixel_is_where_its_own_ray_ends(one):
    pixels = all_over(one)
    np.testing.assert_allclose(one.project(5 * one.directions(pixels)), pixels, atol=1e-6)


@given(panoramas, directions)
def test_a_ray_goes_through_its_own_pixel_also_when_it_goes_backwards(one, ray):
    pixel = one.project(10 * ray)
    if np.isfinite(pixel).all():
        back = one.directions(pixel)
        np.testing.assert_allclose(back / np.linalg.norm(back), ray / np.linalg.norm(ray), atol=1e-9)


@given(st.floats(60, 350), st.floats(-np.pi, np.pi), st.floats(-1.5, 1.5))
def test_no_ray_beyond_its_view_ends_in_the_picture(view_deg, turn, height):
    for model in (Cylindrical, Equirectangular):
        one = lens(model, view_deg, 1.0, (-0.5, 0))
        ray = np.array([np.sin(turn) * np.cos(height), np.sin(height), np.cos(turn) * np.cos(height)])
        if abs(turn) > np.radians(view_deg / 2) + 1e-9:
            assert not inside(one.project(10 * ray), SIZE)


@given(panoramas)
def test_pixels_move_with_points_and_numbers(one):
    points = 20 * one.directions(all_over(one))
    # A point beside the end of the model may have a pixel, and none after a step.
    points = points[np.isfinite(one.project(points)).all(axis=-1) & (abs(np.arctan2(points[:, 0], points[:, 2])) < 3.1)]
    by_points = differences(lambda by: one.project(points + by), np.full(3, 1e-4))
    assert_alike(one.point_jacobian(points), by_points, of=(1, 2))
    camera = Camera("a", one, Pose(np.zeros(3), np.zeros(3)))
    by_numbers = differences(
        lambda change: with_lens_changed(camera, np.append(change, [0.1, 0.1])).project(points),
        np.array([1.0, 1.0, 1.0, 1e-3]),
    )
    jacobian = one.parameter_jacobian(points)
    assert_alike(jacobian[..., :4], by_numbers, of=(0, 1))
    assert not jacobian[..., 4:].any()


@given(panoramas, st.floats(-25, 10))
def test_shifting_the_picture_is_turning_the_camera_about_its_axis(one, tilt_deg):
    camera = Camera("a", one, Pose(np.array([np.radians(90 + tilt_deg), 0.0, 0.0]), np.array([0.0, -40.0, 9.0])))
    points = np.random.default_rng(0).uniform([-60, -30, 0], [60, 40, 3], size=(50, 3))
    jacobian = full_pixel_jacobian(camera, points)
    by_turn, by_shift = jacobian[..., 1], jacobian[..., 7]
    np.testing.assert_allclose(by_turn, one.focal_length_px * by_shift, rtol=1e-9, atol=1e-6)
    turned = moved(camera, np.array([0, 1e-3, 0, 0, 0, 0]))
    np.testing.assert_allclose(turned.project(points), camera.project(points) + [1e-3 * one.focal_length_px, 0])


def test_points_at_the_camera_and_on_its_axis_have_no_pixel_and_no_derivatives():
    one = lens(Cylindrical, 180, 1.0, (0, 0))
    points = np.array([[0.0, 0.0, 0.0], [0.0, 5.0, 0.0], [0.0, 0.0, -9.0], [0.001, 5.0, 0.05]])
    for of in (one.project, one.point_jacobian, one.parameter_jacobian):
        assert np.isnan(of(points)).all()


@given(st.floats(np.pi / 2, np.pi), st.floats(-np.pi, np.pi), st.floats(0.05, 0.3))
def test_a_fisheye_of_more_than_half_a_turn_folds_nothing_from_behind_into_its_picture(angle, about, narrow):
    wide = Fisheye(np.diag([SIZE[0] / 4, SIZE[0] / 4, 1.0]), np.array([-narrow, 0, 0, 0]), SIZE)
    ray = np.array([np.sin(angle) * np.cos(about), np.sin(angle) * np.sin(about), np.cos(angle)])
    assert np.isnan(wide.project(10 * ray)).all()


@pytest.mark.parametrize("shape", [(), (7,), (2, 3)])
def test_points_of_any_shape_have_the_derivatives_that_each_has_alone(shape):
    points = np.random.default_rng(0).uniform(1, 3, (*shape, 3))
    one = lens(Equirectangular, 180, 1.1, (3, -200))
    for of in (one.project, one.point_jacobian, one.parameter_jacobian, lambda p: one.directions(p[..., :2])):
        for at in np.ndindex(shape):
            np.testing.assert_allclose(of(points)[at], of(points[at]), rtol=1e-13)
