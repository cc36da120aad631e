"""Confidence: how probable a pose is the explanation of its frame, by its two witnesses."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.worker.calibration.gate.good_result import FIGURES, good, seen
from worker.calibration.detection.view_condition import ViewCondition
from worker.calibration.diagnostics.overlap import Overlap
from worker.calibration.gate.confidence import confidence_of
from worker.jobs.to_schemas import camera_to_schema

SHARE, PAINT, MOTION = st.floats(0, 1), st.floats(0, 100), st.none() | st.floats(1, 100)
REFUSED_BELOW = 10 / 11


@given(SHARE, SHARE, PAINT, PAINT, MOTION)
def test_confidence_is_a_probability_that_grows_with_lines_and_falls_with_paint_beside_them(
    a, b, paint, more_paint, motion
):
    less = confidence_of(min(a, b), max(paint, more_paint), motion)
    more = confidence_of(max(a, b), min(paint, more_paint), motion)
    assert 0 < less <= more < 1


@given(SHARE, PAINT, st.floats(1, 100), st.floats(1, 100))
def test_confidence_falls_with_how_far_a_camera_would_have_moved(share, paint, motion, more):
    assert confidence_of(share, paint, max(motion, more)) <= confidence_of(share, paint, min(motion, more))


def test_few_lines_make_a_pose_sure_where_the_camera_stands_as_stored_and_not_far_from_there():
    assert confidence_of(0.7, 0.1, 1.0) > 0.99
    assert confidence_of(0.7, 0.1, 10.0) < REFUSED_BELOW
    assert confidence_of(0.95, 0.1, 10.0) > REFUSED_BELOW


def test_lines_that_are_found_amid_much_other_paint_make_no_pose_sure():
    # In a hall of several sports lines are found wherever a pose puts them.
    assert confidence_of(0.87, 5.0, 10.0) < REFUSED_BELOW
    assert confidence_of(0.87, 5.0, None) < 0.1


def test_a_network_that_sees_nothing_speaks_against_no_pose():
    assert Overlap(iou=0.0, found=0.0, unexpected=0.0).unexplained == 0
    assert Overlap(iou=0.0, found=0.0, unexpected=1.0).unexplained == float("inf")
    assert confidence_of(0.95, float("inf"), None) < 0.01


@pytest.mark.parametrize(("share", "iou", "least", "most"), [(0.95, 0.9, 0.99, 1), (0.25, 0.2, 0, 0.5)])
def test_an_answer_says_how_probable_it_is(share, iou, least, most):
    result = replace(good(), evidence=seen(share), overlap=Overlap(iou, share, 0.1))
    assert least < camera_to_schema(result).confidence < most


def test_an_answer_about_a_frame_that_cannot_be_used_has_no_confidence():
    fogged = ViewCondition(False, "fogged", None, "Fogged: most likely fog.", FIGURES)
    assert camera_to_schema(replace(good(), view=fogged)).confidence is None


def test_an_answer_says_how_well_the_field_is_known_at_the_worst_marking():
    assert camera_to_schema(good()).sigma.ground_m == pytest.approx(0.05)
    assert camera_to_schema(replace(good(), ground_sigma=None)).sigma.ground_m is None
