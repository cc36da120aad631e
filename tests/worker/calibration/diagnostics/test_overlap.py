"""What the segmentation finds of the expected markings, and beside them."""

import pytest

from testbed.synthetic import CROWNED, moved
from tests.worker.calibration.sights import left_view
from worker.calibration.diagnostics.overlap import overlap_of


@pytest.mark.parametrize(
    ("turn", "bright", "least", "most"),
    [(0.0, 1.0, 0.7, 1.0), (0.02, 1.0, 0.0, 0.4), (0.0, 0.0, 0.0, 0.0), (2.0, 1.0, 0.0, 0.0)],
    ids=["true", "moved", "black segmentation", "no pitch in view"],
)
def test_a_pose_explains_the_markings_where_it_puts_them(turn, bright, least, most):
    one, response = left_view()
    assert least <= overlap_of(CROWNED, moved(one, (turn, 0, 0)), bright * response).iou <= most


def test_markings_beside_the_expected_ones_count_against_a_pose():
    one, response = left_view()
    cluttered = response.copy()
    cluttered[300:330:4, 200:700] = 1
    assert overlap_of(CROWNED, one, cluttered).iou < overlap_of(CROWNED, one, response).iou


def test_what_is_off_the_pitch_does_not_count():
    one, response = left_view()
    lettering = response.copy()
    lettering[:60] = 1  # sky
    assert overlap_of(CROWNED, one, lettering).iou == pytest.approx(overlap_of(CROWNED, one, response).iou)


def test_the_two_sides_of_the_overlap_tell_missing_lines_from_other_lines():
    one, response = left_view()
    clean = overlap_of(CROWNED, one, response)
    assert clean.found > 0.9
    assert clean.unexpected < 0.1
    cluttered, hidden = response.copy(), response.copy()
    cluttered[300:330:4, 200:700] = 1
    hidden[:, 480:] = 0
    assert overlap_of(CROWNED, one, cluttered).found == pytest.approx(clean.found, abs=0.05)
    assert overlap_of(CROWNED, one, cluttered).unexpected > 0.3
    assert overlap_of(CROWNED, one, hidden).found < clean.found - 0.2
    assert overlap_of(CROWNED, one, hidden).unexpected < 0.1
