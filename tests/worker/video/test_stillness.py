"""Pictures that are the same again and again are noticed, and those of a camera that works never are."""

import numpy as np
import pytest

from worker.video.stillness import Stillness

RATE = 25.0
WORKING = [np.random.default_rng(number).integers(16, 236, (64, 96), np.uint8) for number in range(50)]


def shown(stillness, pictures, begin_s=0.0):
    return [stillness.shows_new(picture, begin_s + number / RATE) for number, picture in enumerate(pictures)]


def test_each_picture_of_a_camera_that_works_shows_something_new():
    stillness = Stillness()
    assert all(shown(stillness, WORKING))
    assert not stillness.is_frozen


def test_a_picture_that_is_the_same_as_the_one_before_shows_nothing_new():
    one, other = WORKING[:2]
    stillness = Stillness()
    assert shown(stillness, [one, one.copy(), other, other.copy(), one]) == [True, False, True, False, True]
    assert not stillness.is_frozen


def test_a_change_of_one_value_is_a_change():
    changed = WORKING[0].copy()
    changed[1, 1] += 1
    assert shown(Stillness(), [WORKING[0], changed]) == [True, True]


@pytest.mark.parametrize("whole_every", [12, 25, 1000])
def test_a_frozen_picture_is_noticed_within_two_seconds_also_where_whole_pictures_change_it_a_little(whole_every):
    stillness = Stillness()
    frozen = [WORKING[number // whole_every % 2] for number in range(200)]
    shown(stillness, WORKING)
    told = shown(stillness, frozen, begin_s=2.0)
    assert stillness.is_frozen
    assert not any(told[50:])


def test_a_camera_that_works_again_is_noticed_within_a_second():
    stillness = Stillness()
    shown(stillness, [*WORKING[:2], *200 * WORKING[:1]])
    assert stillness.is_frozen
    told = shown(stillness, WORKING, begin_s=202 / RATE)
    assert not stillness.is_frozen
    assert all(told[25:])
