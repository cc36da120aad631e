"""Hypotheses that are drawn onto the paint of a view, and lenses that bend more than the one that undistorted it."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from testbed.synthetic import PITCH, camera, paint_frame
from tests.worker.calibration.outdated_pair import white_on_green
from worker.calibration.detection.segmentation import Region
from worker.calibration.geometry.rotation import rotation_matrices
from worker.calibration.relocalisation.agreement import HALF_WIDTH_PX, agreement, straightened
from worker.calibration.relocalisation.alignment import aligned
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.hypotheses import LENS_KNOWN, LENS_SOUGHT, Hypotheses
from worker.calibration.relocalisation.line_view import LineView
from worker.calibration.relocalisation.sought import MOUNTED_ROLL_DEG

TOLERANCE_PX = 5.0
MAP = FieldMap.of(PITCH)
BENT = (-0.18, 0.03, 0.0, 0.0, 0.0)


@cache
def view_of(distortion, undistorted_by):
    """A camera beside a football field, and its lines through a lens that may bend otherwise than its own."""
    truth = camera("one", (-6.0, -52.0, 16.0), (-10.0, 0.0), distortion=distortion)
    response = white_on_green(paint_frame(PITCH, truth), [Region(0, 0, *truth.intrinsics.size)])
    lens = replace(truth.intrinsics, distortion=np.array(undistorted_by))
    return truth, LineView.of(response, lens, MOUNTED_ROLL_DEG)


def hypothesis(view, truth, turned=(0.0, 0.0, 0.0), moved=(0.0, 0.0, 0.0), zoomed=1.0):
    rotation = rotation_matrices(np.array(turned)) @ truth.pose.matrix
    position = truth.pose.position + np.array(moved)
    return Hypotheses.unbent(rotation[None], position[None], np.array([zoomed * view.focal_px]))


def score(view, hypotheses, tolerance_px=TOLERANCE_PX):
    return agreement(MAP, view, hypotheses, tolerance_px)


def on_paint(view, start, lens, rounds=3):
    found, scores = start, score(view, start)
    for _ in range(rounds):
        found, scores = aligned(MAP, view, found, scores, TOLERANCE_PX, lens)
    return found, scores


@pytest.mark.parametrize(
    ("turned", "moved"), [((0.006, 0.0, 0.0), (0.0, 0.0, 0.0)), ((0.004, -0.006, 0.004), (0.5, 0.4, -0.3))]
)
def test_a_hypothesis_beside_the_paint_is_drawn_onto_it(turned, moved):
    truth, view = view_of((), (0.0, 0.0, 0.0, 0.0))
    start = hypothesis(view, truth, turned, moved)
    found, (reached,) = on_paint(view, start, LENS_KNOWN)
    at_truth = score(view, hypothesis(view, truth))[0]
    assert score(view, start)[0] < at_truth - 0.1
    assert reached > at_truth - 0.03
    assert found.focal_px[0] == view.focal_px


def test_a_focal_length_that_is_sought_is_found_with_the_pose():
    truth, view = view_of((), (0.0, 0.0, 0.0, 0.0))
    start = hypothesis(view, truth, (0.003, 0.0, 0.0), (0.2, 0.0, 0.0), zoomed=1.02)
    found, (reached,) = on_paint(view, start, LENS_SOUGHT)
    assert reached > score(view, hypothesis(view, truth))[0] - 0.03
    assert abs(found.focal_px[0] / view.focal_px - 1) < 0.015


def test_a_lens_that_bends_more_than_that_of_the_view_is_found_with_the_pose():
    truth, view = view_of(BENT, (0.0, 0.0, 0.0, 0.0))
    start = hypothesis(view, truth)
    found, (reached,) = on_paint(view, start, LENS_SOUGHT)
    kept, (unbent,) = on_paint(view, start, LENS_KNOWN)
    # k1 at half the width of the frame; what k2 takes off is felt towards the corners.
    truly = BENT[0] * (truth.intrinsics.size[0] / 2 / truth.intrinsics.focal_length_px) ** 2
    assert found.bends[0] < 0.3 * truly < 0
    assert reached > unbent + 0.05
    assert kept.bends[0] == 0.0


def test_hypotheses_never_agree_less_than_before():
    truth, view = view_of((), (0.0, 0.0, 0.0, 0.0))
    rng = np.random.default_rng(2)
    starts = Hypotheses.joined(
        [hypothesis(view, truth, 0.05 * rng.normal(size=3), 3 * rng.normal(size=3)) for _ in range(30)]
    )
    before = score(view, starts)
    _, after = aligned(MAP, view, starts, before, TOLERANCE_PX, LENS_SOUGHT)
    assert (after >= before).all()
    assert (after > before).any()


def test_a_bend_of_a_hypothesis_is_as_good_as_a_view_that_is_undistorted_by_it():
    truth, undistorted = view_of(BENT, BENT)
    _, bent = view_of(BENT, (0.0, 0.0, 0.0, 0.0))
    truly = BENT[0] * (truth.intrinsics.size[0] / 2 / truth.intrinsics.focal_length_px) ** 2
    as_bent = replace(hypothesis(bent, truth), bends=np.array([0.9 * truly]))
    assert score(bent, as_bent)[0] > score(bent, hypothesis(bent, truth))[0] + 0.1
    assert score(bent, as_bent)[0] == pytest.approx(score(undistorted, hypothesis(undistorted, truth))[0], abs=0.1)


@given(st.floats(-0.06, 0.06), st.floats(-1.2, 1.2), st.floats(-1.0, 1.0))
def test_places_that_were_bent_and_straightened_are_where_they_were(bend, x, y):
    place = HALF_WIDTH_PX * np.array([[x, y]], np.float32)
    bent = place * np.float32(1 + bend * (x * x + y * y))
    assert np.linalg.norm(straightened(bent, np.array([bend]))[0] - place) < 0.06 * HALF_WIDTH_PX * abs(bend) + 0.01
