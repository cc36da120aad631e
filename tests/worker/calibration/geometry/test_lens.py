"""What lenses make of rays moves as their derivatives say, for both models."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.worker.calibration.geometry.differences import assert_alike, differences
from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.lens import Fisheye, Intrinsics
from worker.calibration.geometry.parameters import with_lens_changed

SIZE = (1920, 1080)


def up_to(*limits):
    return st.tuples(*(st.floats(-limit, limit) for limit in limits))


def matrices(shortest, longest):
    focal, aspect, aside = st.floats(shortest, longest), st.floats(0.9, 1.1), up_to(5, 60, 60)
    return st.builds(
        lambda fx, ratio, of: np.array([[fx, of[0], 960 + of[1]], [0, ratio * fx, 540 + of[2]], [0, 0, 1]]),
        focal,
        aspect,
        aside,
    )


# Radial, tangential; a third term; a rational model; thin prisms; a tilted sensor.
distortions = st.builds(
    lambda radial, length, *others: np.array([*radial, *sum(others, ())])[:length],
    st.tuples(st.floats(-0.5, 0.3), st.floats(-0.1, 0.3)),
    st.sampled_from([0, 4, 5, 8, 12, 14]),
    up_to(5e-3, 5e-3),
    up_to(0.05),
    up_to(0.1, 0.05, 0.02),
    up_to(5e-3, 5e-3, 5e-3, 5e-3),
    up_to(0.1, 0.1),
)
pinholes = st.builds(lambda matrix, terms: Intrinsics(matrix, terms, SIZE), matrices(600, 8000), distortions)
fisheyes = st.builds(
    lambda matrix, terms: Fisheye(matrix, np.array(terms), SIZE), matrices(350, 2000), up_to(0.2, 0.05, 0.01, 2e-3)
)
lenses = st.one_of(pinholes, fisheyes)


def in_picture(lens):
    """Rays (N, 2) that end all over the picture and on its border, but not where the model is about to end."""
    columns, rows = np.meshgrid(np.linspace(0, SIZE[0] - 1, 13), np.linspace(0, SIZE[1] - 1, 9))
    rays = lens.undistort(np.stack([columns, rows], axis=-1).reshape(-1, 2))
    return rays[np.linalg.norm(rays, axis=1) < 0.98 * lens.largest_radius]


def renumbered(lens, changes):
    return with_lens_changed(Camera("a", lens, Pose(np.zeros(3), np.zeros(3))), changes).intrinsics


@given(lenses)
def test_pixels_move_with_their_rays(lens):
    rays = in_picture(lens)
    expected = differences(lambda by: lens.distort(rays + by), np.full(2, 1e-4))
    assert_alike(lens.jacobian(rays), expected, of=(1, 2))


@given(lenses)
def test_pixels_move_with_the_numbers_of_the_lens(lens):
    rays = in_picture(lens)
    steps = np.array([1.0, 1.0, 1.0, 1e-3, 1e-5, 1e-5])
    expected = differences(lambda changes: renumbered(lens, changes).distort(rays), steps)
    assert_alike(lens.jacobian_by_parameters(rays), expected, of=(0, 1))


@given(fisheyes, st.floats(-300, -5), st.floats(-np.pi, np.pi))
def test_on_its_axis_a_fisheye_is_its_matrix(lens, magnitude, turn):
    for ray in (np.zeros(2), 10**magnitude * np.array([np.cos(turn), np.sin(turn)])):
        np.testing.assert_allclose(lens.jacobian(ray), lens.matrix[:2, :2], atol=1e-6)
        np.testing.assert_array_equal(lens.jacobian_by_parameters(ray)[:, 1:3], np.eye(2))
        np.testing.assert_allclose(lens.jacobian_by_parameters(ray)[:, 4:], 0.0, atol=1e-9)


@given(lenses, st.floats(1.001, 3.0), st.floats(-np.pi, np.pi))
def test_beyond_its_end_a_model_has_no_derivatives(lens, beyond, turn):
    ray = beyond * lens.largest_radius * np.array([np.cos(turn), np.sin(turn)])
    for of in (lens.distort, lens.jacobian, lens.jacobian_by_parameters):
        assert np.isnan(of(ray)).all()


@given(st.sampled_from([Intrinsics, Fisheye]), up_to(0.5, 0.3, 0.1, 0.1), st.floats(0.01, 1), st.floats(-np.pi, np.pi))
def test_no_model_folds_what_lies_farther_aside_back_into_the_picture(model, terms, strength, turn):
    terms = strength * np.array(terms)
    radial = terms if model is Fisheye else np.array([*terms[:2], 0, 0, terms[2]])
    lens = model(np.array([[900.0, 0, 960], [0, 900, 540], [0, 0, 1]]), radial, SIZE)
    # To all sides of the camera and behind it.
    angles = np.radians(np.arange(0.05, 180, 0.05))
    outwards = np.array([np.cos(turn), np.sin(turn)])
    pixels = lens.project(10 * np.column_stack([np.outer(np.sin(angles), outwards), np.cos(angles)]))
    aside = (pixels - [960, 540]) @ outwards
    seen = np.isfinite(aside)
    assert (np.diff(aside[seen], prepend=0) > 0).all()
    assert not seen[np.argmin(seen) :].any()
    # All but the ray at the very end, which rounding may put beyond it.
    within = pixels[seen][:-1]
    np.testing.assert_allclose(lens.distort(lens.undistort(within)), within, atol=2e-3)


@pytest.mark.parametrize("shape", [(), (7,), (2, 3)])
def test_rays_of_any_shape_have_the_derivatives_that_each_has_alone(shape):
    rays = np.random.default_rng(0).uniform(-0.3, 0.3, (*shape, 2))
    matrix = np.array([[1200.0, 1.0, 960], [0, 1210, 540], [0, 0, 1]])
    full = np.array([-0.28, 0.09, 1e-3, -2e-3, 0.01, 0.02, 0, 0, 1e-3, 0, 2e-3, 0, 0.01, 0.02])
    for lens in (Intrinsics(matrix, full, SIZE), Fisheye(matrix, full[:4], SIZE)):
        for of in (lens.jacobian, lens.jacobian_by_parameters):
            assert of(rays).shape[:-2] == shape
            for at in np.ndindex(shape):
                np.testing.assert_allclose(of(rays)[at], of(rays[at]), rtol=1e-13)
