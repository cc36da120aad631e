"""Grades of checked cameras."""

from dataclasses import replace

import pytest

from testbed.synthetic import PITCH, moved
from tests.worker.calibration.gate.good_result import LEFT, good, on_ground
from worker.calibration.checking.check import TAKEN_AT_ITS_WORD, CheckedCamera, good_within_px
from worker.calibration.checking.grade import grade

FOLDS = "its distortion folds 900 px from the middle"


def checked(found, **changes):
    """A camera that its file puts where `LEFT` is, and its frame where it was `found`."""
    return CheckedCamera(PITCH, LEFT, True, TAKEN_AT_ITS_WORD, LEFT, replace(good(), camera=found, **changes), None)


@pytest.mark.parametrize(("lens_folds", "causes"), [(None, []), (FOLDS, [("folds", FOLDS)])])
def test_a_lens_that_folds_where_no_marking_is_is_named_beside_a_good_grade(lens_folds, causes):
    graded = grade(checked(LEFT), lens_folds)
    assert (graded.grade, graded.causes) == ("good", causes)


def test_a_turned_camera_has_drifted_for_that_alone():
    graded = grade(checked(moved(LEFT, (0.02, 0.0, 0.0))), FOLDS)
    assert (graded.grade, [name for name, _ in graded.causes]) == ("drifted", ["turned"])


@pytest.mark.parametrize(("lens_folds", "expected"), [(None, "good"), (FOLDS, "wrong")])
def test_a_shift_within_three_sigma_is_no_chance_through_a_lens_that_folds(lens_folds, expected):
    shifted = checked(moved(LEFT, (0.004, 0.0, 0.0)), ground_sigma=on_ground(0.05, 1.0))
    assert good_within_px(LEFT) < shifted.moved_px < 3.0
    graded = grade(shifted, lens_folds)
    assert (graded.grade, [name for name, _ in graded.causes]) == (expected, ["folds"] if lens_folds else [])
