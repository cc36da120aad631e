"""Quality without ground truth, and the gate."""

from dataclasses import fields, replace

import numpy as np
import pytest

from tests.worker.calibration.synthetic import CROWNED, PITCH, moved, pair, pair_markings
from worker.calibration.finish.uncertainty import Deviation, Sigma
from worker.calibration.judge.quality import CameraResult, Gate, Movement, alone_rejection, markings_iou
from worker.calibration.see.evidence import Evidence
from worker.calibration.see.view import ViewCondition, ViewFigures

LEFT = pair(())[0]


def scene():
    return LEFT, pair_markings(())[0]


def seen(share: float, by_chance: float = 0.2) -> Evidence:
    """That much of a hundred pieces of one line."""
    pieces = np.arange(100)
    found = pieces < 100 * share
    return Evidence(pieces, np.zeros(100, int), np.ones(100), found, np.full(100, by_chance))


FIGURES = ViewFigures(*[0.5] * len(fields(ViewFigures)))
IN_VIEW = ViewCondition(True, None, None, "The field can be seen.", FIGURES)
ZOOMED = Deviation("left", "focal_length_px", 0.02 * LEFT.intrinsics.matrix[0, 0], 0.002 * 600.0, 3e-4 * 600.0)
FOGGED = ViewCondition(False, "fogged", "far half", "Fogged (far half): most likely fog.", FIGURES)


def good():
    return CameraResult(
        camera=LEFT,
        evidence=seen(0.95),
        residual_px=0.2,
        covariance=np.diag([0.005**2] * 3 + [0.05**2] * 3),
        repeatability=Sigma(0.01, 0.01),
        zoom=None,
        likelier=None,
        view=IN_VIEW,
        iou=0.9,
        evidence_before=seen(0.3),
        moved=Movement(0.5, 0.1, 12.0),
    )


def test_the_true_pose_explains_the_markings():
    one, response = scene()
    assert markings_iou(CROWNED, one, response) > 0.7


def test_a_moved_pose_explains_fewer():
    one, response = scene()
    assert markings_iou(CROWNED, moved(one, (0.02, 0, 0)), response) < 0.4


def test_markings_beside_the_expected_ones_count_against_a_pose():
    one, response = scene()
    cluttered = response.copy()
    cluttered[300:330:4, 200:700] = 1
    assert markings_iou(CROWNED, one, cluttered) < markings_iou(CROWNED, one, response)


def test_what_is_off_the_pitch_does_not_count():
    one, response = scene()
    lettering = response.copy()
    lettering[:60] = 1  # sky
    assert markings_iou(CROWNED, one, lettering) == pytest.approx(markings_iou(CROWNED, one, response))


def test_a_black_segmentation_explains_nothing():
    one, response = scene()
    assert markings_iou(CROWNED, one, np.zeros_like(response)) == 0


def test_a_pose_that_sees_no_pitch_explains_nothing():
    one, response = scene()
    assert markings_iou(CROWNED, moved(one, (2.0, 0, 0)), response) == 0


def test_a_good_result_passes_the_gate():
    assert alone_rejection(good(), Gate()) is None


@pytest.mark.parametrize(
    ("change", "cause"),
    [
        (
            {"evidence": seen(0.4)},
            "40% of their length is where it ought to be, at least 68% are needed (20% is seen anywhere)",
        ),
        ({"view": FOGGED, "evidence": seen(0.1)}, "Fogged (far half)"),
        ({"residual_px": None}, "fewer than 30 points"),
        ({"covariance": None}, "fewer than 30 points"),
        ({"residual_px": 9.0}, "px from where the pose puts them"),
        ({"covariance": np.diag([0.02**2] * 3 + [0.01**2] * 3)}, "sigma 1.98 degrees (at most 1.0 allowed)"),
        ({"covariance": np.diag([1e-4**2] * 3 + [1.0**2] * 3)}, "1.73 m (at most 0.5)"),
        (
            {"zoom": ZOOMED, "likelier": moved(LEFT, by=(0.5, 0.0, 0.0))},
            "a focal length 2.00% ± 0.20% longer than the venue says",
        ),
        ({"moved": Movement(20.0, 0.1, 300.0)}, "turned by 20.0 degrees (at most 8.0 allowed)"),
        ({"moved": Movement(1.0, 3.0, 300.0)}, "3.00 m"),
        ({"evidence": seen(0.8), "evidence_before": seen(0.95)}, "stored pose fits the frame better"),
    ],
)
def test_the_gate_names_the_cause(change, cause):
    assert cause in alone_rejection(replace(good(), **change), Gate())


def test_a_doubt_of_the_focal_length_that_moves_no_camera_rejects_none():
    assert alone_rejection(replace(good(), zoom=ZOOMED, likelier=moved(LEFT, by=(0.05, 0.0, 0.0))), Gate()) is None


def test_movement_is_told_in_degrees_metres_and_pixels():
    one, _ = scene()
    turned = Movement.between(PITCH, one, moved(one, by=(0.3, 0, 0.4)))
    assert turned.rotation_deg == pytest.approx(0)
    assert turned.position_m == pytest.approx(0.5)
    assert turned.pixels > 1
    assert Movement.between(PITCH, one, one) == Movement(0.0, 0.0, 0.0)
