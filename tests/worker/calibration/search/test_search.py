"""The levels of a search: who hands over to whom, and when."""

import numpy as np
import pytest

from testbed.synthetic import CROWNED, moved, pair, pair_markings
from worker.calibration.search.search import COARSE_TO_FINE, PATIENCE, Strategy, search

LEVELS = len(COARSE_TO_FINE)

pytestmark = pytest.mark.slow


def searched(responses, generations):
    cameras, steps, ends = [moved(camera, (0.01, -0.01, 0.0)) for camera in pair()], [], []
    found = search(
        CROWNED,
        cameras,
        responses,
        Strategy(16, 32, generations),
        np.random.default_rng(0),
        lambda number, loss: steps.append((number, loss)),
        lambda *_: ends.append(len(steps)),
    )
    return found, steps, ends


def test_a_level_in_which_nothing_moves_ends_early_and_the_next_one_begins():
    blank = [np.zeros_like(markings) for markings in pair_markings()]
    found, steps, ends = searched(blank, 40)
    assert found.generations == LEVELS * PATIENCE
    assert [number for number, _ in steps] == list(range(1, LEVELS * PATIENCE + 1))
    assert ends == [PATIENCE * number for number in range(1, LEVELS + 1)]


def test_the_best_never_gets_worse_within_a_level():
    _, steps, ends = searched(pair_markings(), 30)
    losses = [loss for _, loss in steps]
    for begin, end in zip([0, *ends], ends, strict=False):
        assert losses[begin] > losses[end - 1]
        assert losses[begin:end] == sorted(losses[begin:end], reverse=True)


def test_generations_are_shared_among_the_levels():
    found, _, ends = searched(pair_markings(), 10)
    assert found.generations == 10
    assert ends == [4, 7, 10]


def test_where_a_camera_is_found_does_not_depend_on_its_neighbours():
    cameras, responses = [moved(camera, (0.01, -0.01, 0.0)) for camera in pair()], pair_markings()
    ends = [
        search(
            CROWNED,
            cameras[:number],
            responses[:number],
            Strategy(16, 32, 30),
            np.random.default_rng(0),
            lambda *_: None,
        )
        .cameras[0]
        .pose
        for number in (1, 2)
    ]
    np.testing.assert_array_equal(ends[0].position, ends[1].position)
    np.testing.assert_array_equal(ends[0].rotation, ends[1].rotation)
