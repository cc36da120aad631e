"""What tracking learns of each piece of line fades: the mean of about an hour, known less where it is not seen."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from worker.calibration.tracking.learned_offsets import FORGOTTEN_IN_S, LearnedOffsets

BESIDE_PX, NOISE_PX = 1.0, 0.1
ONE = np.array([0])
SECONDS = st.floats(0.0, 40 * FORGOTTEN_IN_S)


def seen(times: int, offset: float = 0.5) -> LearnedOffsets:
    """Two pieces of which the first was seen so many times, so far beside its place."""
    offsets = LearnedOffsets(2, BESIDE_PX, NOISE_PX)
    for _ in range(times):
        offsets.learn(ONE, np.array([offset]))
    return offsets


def sigma(offsets: LearnedOffsets) -> np.ndarray:
    return np.sqrt(offsets.variance)


def test_a_piece_is_known_by_its_sights_and_another_one_as_before():
    offsets = seen(100)
    assert offsets.mean == pytest.approx([0.5, 0.0], abs=0.001)
    assert sigma(offsets) == pytest.approx([NOISE_PX / 10, BESIDE_PX], rel=0.001)
    assert offsets.are_known.tolist() == [True, False]


def test_a_piece_that_moves_for_good_is_where_it_is_after_some_hours():
    offsets = seen(100, offset=0.0)
    every_s, means = 10.0, []
    for _ in range(round(5 * FORGOTTEN_IN_S / every_s)):
        offsets.forget(every_s)
        offsets.learn(ONE, np.array([0.8]))
        means.append(offsets.mean[0])
    assert means == sorted(means)
    assert means[-1] == pytest.approx(0.8, abs=0.02)


def test_a_piece_that_is_seen_all_the_time_has_the_mean_of_about_an_hour():
    offsets, every_s = LearnedOffsets(1, BESIDE_PX, NOISE_PX), 1.0
    for _ in range(round(10 * FORGOTTEN_IN_S / every_s)):
        offsets.forget(every_s)
        offsets.learn(ONE, np.array([0.3]))
    assert sigma(offsets) == pytest.approx([NOISE_PX / np.sqrt(FORGOTTEN_IN_S / every_s)], rel=0.01)


def test_a_piece_that_was_not_seen_for_a_day_counts_as_never_seen():
    offsets = seen(1000)
    offsets.forget(24 * 3600.0)
    assert not offsets.are_known.any()
    assert offsets.mean == pytest.approx([0.0, 0.0], abs=1e-4)
    assert sigma(offsets) == pytest.approx([BESIDE_PX, BESIDE_PX], abs=1e-4)


@given(SECONDS, SECONDS, st.integers(0, 1000))
def test_it_fades_by_the_time_that_passes_however_that_is_divided(one, other, times):
    at_once, in_two = seen(times), seen(times)
    at_once.forget(one + other)
    in_two.forget(one)
    in_two.forget(other)
    np.testing.assert_allclose(in_two.mean, at_once.mean, rtol=1e-9)
    np.testing.assert_allclose(in_two.variance, at_once.variance, rtol=1e-9)


@given(SECONDS, st.integers(0, 1000), st.floats(-5.0, 5.0))
def test_sigma_never_shrinks_by_time_alone_nor_grows_beyond_what_was_known_at_first(seconds, times, offset):
    offsets = seen(times, offset)
    before, known = sigma(offsets), abs(offsets.mean)
    offsets.forget(seconds)
    assert np.all(sigma(offsets) >= before * (1 - 1e-12))
    assert np.all(sigma(offsets) <= BESIDE_PX * (1 + 1e-12))
    assert np.all(abs(offsets.mean) <= known * (1 + 1e-12))
