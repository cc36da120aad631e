"""The paper's search on the ground."""

import numpy as np
import pytest

from demo.render import outdated
from testbed.synthetic import CROWNED, pair, pair_markings
from worker.calibration.geometry.rotation import rotation_angles_deg
from worker.calibration.paper.search import ON_THE_GROUND, search_on_ground
from worker.calibration.search.search import Strategy

pytestmark = pytest.mark.slow


@pytest.mark.long
def test_a_camera_is_caught_that_is_as_far_off_as_the_papers():
    camera, markings = pair()[0], pair_markings()[0]
    start = camera.with_pose(outdated(camera.pose, 0.162, 2.1, np.random.default_rng(3)))
    strategy = Strategy(24, 48, 30)

    found = search_on_ground(
        CROWNED, [start], [markings], ON_THE_GROUND, strategy, 0.5, np.random.default_rng(0), lambda *_: None
    ).cameras[0]

    assert rotation_angles_deg(found.pose.rotation, camera.pose.rotation) < 0.5


@pytest.mark.long
def test_all_generations_are_used_even_where_nothing_moves():
    steps = []
    found = search_on_ground(
        CROWNED,
        pair()[:1],
        [np.zeros_like(pair_markings()[0])],
        ON_THE_GROUND,
        Strategy(2, 2, 30),
        0.5,
        np.random.default_rng(0),
        lambda number, loss: steps.append((number, loss)),
    )
    assert [number for number, _ in steps] == list(range(1, 31))
    assert len({loss for _, loss in steps}) == 1
    assert found.generations == 30
