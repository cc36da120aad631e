"""Rotations, against OpenCV and against themselves."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from worker.calibration.geometry.rotation import rotation_angles_deg, rotation_matrices, rotation_vectors

vectors = st.lists(st.floats(-3, 3, allow_subnormal=False), min_size=3, max_size=3).map(np.array)


@given(vectors)
def test_a_rotation_matrix_is_the_one_of_opencv(vector):
    np.testing.assert_allclose(rotation_matrices(vector), cv2.Rodrigues(vector)[0], atol=1e-12)


@given(vectors)
def test_a_rotation_survives_the_way_to_a_matrix_and_back(vector):
    matrix = rotation_matrices(vector)
    np.testing.assert_allclose(rotation_matrices(rotation_vectors(matrix)), matrix, atol=1e-9)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-8, np.pi - 1e-9, np.pi])
def test_rotations_stay_exact_near_zero_and_near_half_a_turn(angle):
    vector = angle * np.array([2.0, -1.0, 2.0]) / 3
    matrix = rotation_matrices(vector)
    np.testing.assert_allclose(rotation_matrices(rotation_vectors(matrix)), matrix, atol=1e-12)
    assert np.linalg.norm(rotation_vectors(matrix)) == pytest.approx(angle, abs=1e-9)


def test_rotations_of_a_whole_population_are_those_of_its_members():
    some = np.random.default_rng(1).normal(size=(4, 2, 3))
    together = rotation_vectors(rotation_matrices(some))
    for i, j in np.ndindex(4, 2):
        np.testing.assert_array_equal(together[i, j], rotation_vectors(rotation_matrices(some[i, j])))


def test_the_angle_between_two_rotations_is_that_of_the_one_that_joins_them():
    first = np.array([0.3, -1.0, 0.5])
    turn = np.radians(7.0) * np.array([0.0, 0.6, 0.8])
    second = rotation_vectors(rotation_matrices(turn) @ rotation_matrices(first))
    assert rotation_angles_deg(first, second) == pytest.approx(7.0)
