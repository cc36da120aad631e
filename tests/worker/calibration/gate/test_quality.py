"""Quality without ground truth, and the gate."""

from dataclasses import replace

import numpy as np
import pytest

from testbed.synthetic import PITCH, moved
from tests.worker.calibration.gate.good_result import FIGURES, LEFT, good, on_ground, seen
from worker.calibration.detection.view_condition import ViewCondition
from worker.calibration.diagnostics.overlap import Overlap
from worker.calibration.gate.quality import Moved, alone_rejection, in_one_sentence
from worker.calibration.geometry.camera import Pose
from worker.calibration.refinement.uncertainty import Deviation, GroundSigma

ZOOMED = Deviation("left", "focal_length_px", 0.02 * LEFT.intrinsics.matrix[0, 0], 0.002 * 600.0, 3e-4 * 600.0)
FOGGED = ViewCondition(False, "fogged", "far half", "Fogged (far half): most likely fog.", FIGURES)


def test_a_good_result_passes_the_gate():
    assert alone_rejection(good()) is None


@pytest.mark.parametrize(
    ("change", "cause"),
    [
        (
            {"evidence": seen(0.3), "overlap": Overlap(0.3, 0.4, 0.4), "moved": Moved(1.0, 0.2, 20.0)},
            "30% of their length is where it ought to be (20% is seen anywhere); beside them is paint for 33% of it; "
            "the camera would have turned by 1.0 degrees and moved by 0.20 m; the pose is right with a probability of "
            "21%, at least 91% is needed",
        ),
        ({"view": FOGGED, "evidence": seen(0.1)}, "Fogged (far half)"),
        ({"residual_px": None}, "fewer than 30 points"),
        ({"covariance": None}, "fewer than 30 points"),
        ({"residual_px": 9.0}, "px from where the pose puts them"),
        ({"ground_sigma": None}, "no marking is in view"),
        (
            {"zoom": ZOOMED, "with_fitted_zoom": moved(LEFT, by=(0.5, 0.0, 0.0))},
            "a focal length 2.00% ± 0.20% longer than the venue says",
        ),
        ({"moved": Moved(9.0, 0.1, 90.0)}, "turned by 9.0 degrees (at most 8.0 allowed)"),
        ({"moved": Moved(20.0, 0.1, 300.0)}, "turned by 20.0 degrees (at most 8.0 allowed)"),
        ({"moved": Moved(1.0, 3.0, 300.0)}, "3.00 m"),
        ({"evidence": seen(0.8), "evidence_before": lambda: seen(0.95)}, "stored pose fits the frame better"),
    ],
)
def test_the_gate_names_the_cause(change, cause):
    assert cause in alone_rejection(replace(good(), **change)).words


def test_a_rejection_amid_lines_of_something_else_offers_to_list_them():
    spoiled = replace(good(), evidence=seen(0.3), overlap=Overlap(0.4, 0.9, 0.56))
    assert "56% of what it takes for lines on the pitch lies beside" in alone_rejection(spoiled).words
    assert "other_markings" in alone_rejection(spoiled).words
    assert "other_markings" not in alone_rejection(replace(spoiled, overlap=Overlap(0.4, 0.4, 0.1))).words


def test_a_doubt_of_the_focal_length_that_moves_no_camera_rejects_none():
    assert alone_rejection(replace(good(), zoom=ZOOMED, with_fitted_zoom=moved(LEFT, by=(0.05, 0.0, 0.0)))) is None


def test_movement_is_told_in_degrees_metres_and_pixels():
    turned = Moved.between(PITCH, LEFT, moved(LEFT, by=(0.3, 0, 0.4)))
    assert turned.rotation_deg == pytest.approx(0)
    assert turned.position_m == pytest.approx(0.5)
    assert turned.pixels > 1
    assert Moved.between(PITCH, LEFT, LEFT) == Moved(0.0, 0.0, 0.0)


def test_a_pose_from_which_no_field_is_filmed_is_doubted_before_the_sport_is():
    hanging = LEFT.with_pose(Pose.looking_at(LEFT.pose.position, (0.0, 0.0, 0.0), roll_deg=180.0))
    lost = replace(good(), evidence=seen(0.3), overlap=Overlap(0.1, 0.1, 0.9))
    assert "list it in the field's other_markings" in alone_rejection(lost).words
    words = alone_rejection(replace(lost, camera=hanging)).words
    assert "was it written in another convention" in words
    assert "other_markings" not in words


@pytest.mark.parametrize(
    ("reasons", "said"),
    [
        ([], ""),
        (["it is dark."], "it is dark."),
        (["left: it is dark.", "right: it is dark."], "left: it is dark; right: it is dark."),
        (["left: is it free?", "right: is it lit?"], "left: is it free? right: is it lit?"),
    ],
)
def test_reasons_are_joined_with_one_sign_after_each(reasons, said):
    assert in_one_sentence(reasons) == said


def test_a_place_that_is_loose_is_accepted_where_the_markings_are_not():
    loose = replace(good(), covariance=np.diag([1e-4**2] * 3 + [1.0**2] * 3), ground_sigma=on_ground(0.1, 2.0))
    assert alone_rejection(loose) is None
    told = alone_rejection(replace(good(), ground_sigma=on_ground(0.7, 2.0)))
    assert told.reason == "undetermined"
    assert "may lie 0.70 m (2.0 px) from where it is put on the ground" in told.words


def test_far_grass_is_known_well_enough_where_it_is_known_to_a_pixel():
    assert alone_rejection(replace(good(), ground_sigma=on_ground(0.7, 0.4))) is None


def test_markings_that_are_loose_at_the_rim_alone_reject_no_pose():
    metres = np.where(np.arange(100) < 4, 2.0, 0.05)
    rim = GroundSigma(metres, np.full(100, 3.0))
    assert alone_rejection(replace(good(), ground_sigma=rim)) is None
    assert rim.worst(0.25, 1.0) == (0.05, 3.0, False)
