"""What streaks alone say of where the expected lines are."""

import numpy as np
import pytest

from testbed.synthetic import CROWNED, moved, pair, pair_markings
from worker.calibration.detection.contrast import Channels
from worker.calibration.detection.ridge_response import ridge_response
from worker.calibration.geometry.camera import inside
from worker.calibration.geometry.visibility import VisibleLines

REACH_PX = 90.0


def scene(ground, paint):
    one, share = pair(())[0], pair_markings(())[0][..., None]
    grain = np.random.default_rng(2).normal(0, 4, (*share.shape[:2], 3))
    picture = np.array(ground) + (np.array(paint) - np.array(ground)) * share + grain
    return one, Channels([np.clip(picture, 0, 255).astype(np.uint8)])


def seen_from(one):
    return VisibleLines.from_camera(CROWNED.line_points(), one)


@pytest.mark.parametrize(
    ("ground", "paint"),
    [((120,) * 3, (230,) * 3), ((200,) * 3, (30,) * 3), ((60, 110, 170), (200, 110, 40))],
    ids=["white on grey", "black on light", "blue on wood"],
)
def test_lines_of_any_colour_answer_where_they_are_and_the_ground_does_not(ground, paint):
    one, channels = scene(ground, paint)
    response = ridge_response(channels, seen_from(moved(one, (0.01, 0.01, 0.0))), REACH_PX)
    pixels = one.project(CROWNED.line_points().position)
    column, row = np.rint(pixels[inside(pixels, one.intrinsics.size, 2)]).astype(int).T
    assert np.median(response[row, column]) > 0.5
    assert response.mean() < 0.05
    assert 0 <= response.min() <= response.max() <= 1


def test_nothing_answers_beyond_the_reach_of_the_expected_lines():
    one, channels = scene((120,) * 3, (230,) * 3)
    lines = seen_from(one)
    left = lines[lines.pixel[:, 0] < 100]
    response = ridge_response(channels, left, REACH_PX)
    assert response[:, :100].max() > 0.5
    assert response[:, 250:].max() == 0
