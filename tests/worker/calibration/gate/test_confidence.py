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

SHARE = st.floats(0, 1)


@given(SHARE, SHARE, SHARE, SHARE)
def test_confidence_is_a_probability_that_grows_with_each_witness(agreement, iou, more_agreement, more_iou):
    less = confidence_of(min(agreement, more_agreement), min(iou, more_iou))
    more = confidence_of(max(agreement, more_agreement), max(iou, more_iou))
    assert 0 < less <= more < 1


def test_no_witness_alone_makes_a_pose_sure():
    # In a hall of several sports lines are found wherever a pose puts them.
    assert confidence_of(0.87, 0.15) < 0.9
    assert confidence_of(0.15, 0.87) < 0.9
    assert confidence_of(0.87, 0.87) > 0.99


@pytest.mark.parametrize(("share", "iou", "least", "most"), [(0.95, 0.9, 0.99, 1), (0.4, 0.2, 0, 0.1)])
def test_an_answer_says_how_probable_it_is(share, iou, least, most):
    result = replace(good(), evidence=seen(share), overlap=Overlap(iou, share, 0.1))
    assert least < camera_to_schema(result).confidence < most


def test_an_answer_about_a_frame_that_cannot_be_used_has_no_confidence():
    fogged = ViewCondition(False, "fogged", None, "Fogged: most likely fog.", FIGURES)
    assert camera_to_schema(replace(good(), view=fogged)).confidence is None


def test_an_answer_says_how_well_the_field_is_known_at_the_worst_marking():
    assert camera_to_schema(good()).sigma.ground_m == pytest.approx(0.05)
    assert camera_to_schema(replace(good(), ground_sigma=None)).sigma.ground_m is None
