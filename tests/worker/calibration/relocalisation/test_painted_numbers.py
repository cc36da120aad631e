"""Cameras at yard lines that look alike, and the numbers beside these."""

from dataclasses import replace

import numpy as np
import pytest

from testbed.numbers import with_numbers
from testbed.synthetic import camera, moved, paint_frame, paint_markings
from tests.worker.calibration.gate.good_result import seen
from tests.worker.calibration.sports import field
from worker.calibration.detection.contrast import Channels
from worker.calibration.diagnostics.overlap import Overlap
from worker.calibration.refinement.uncertainty import GroundSigma, Sigma
from worker.calibration.relocalisation.candidate import Candidate
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.paint import Paint
from worker.calibration.relocalisation.painted_numbers import place_by_numbers
from worker.calibration.relocalisation.relocalise import NotFound, Relocalisation
from worker.calibration.relocalisation.sought import Place, SoughtCamera, SoughtLens

GRIDIRON = field("american-football")
MAP = FieldMap.of(GRIDIRON)
STAND = camera("one", (-12.0, -62.0, 28.0), (-15.0, 0.0), focal=1500.0)
YARD_M = 0.9144
NOT_UNIQUE = NotFound("not-unique", "two poses explain the lines")
RESPONSE = paint_markings(GRIDIRON, STAND)
PAINT = Paint.of(np.rint(255 * RESPONSE).astype(np.uint8))


def slid(yards):
    return moved(STAND, by=(yards * YARD_M, 0.0, 0.0))


def candidate(one):
    sure = GroundSigma(np.full(9, 0.01), np.full(9, 0.1))
    explains = np.ones(len(PAINT.middles), bool)
    return Candidate(one, 0.9, explains, seen(0.95), Overlap(0.8, 0.95, 0.0), 0.3, Sigma(0.01, 0.01), sure)


def placed(painted, *cameras, place=None, refusal=NOT_UNIQUE):
    sought = SoughtCamera("one", [SoughtLens.known(STAND.intrinsics)])
    sought = sought if place is None else replace(sought, place=place)
    found = Relocalisation([candidate(one) for one in cameras], refusal)
    return place_by_numbers(GRIDIRON, MAP, found, sought, Channels([paint_frame(painted, STAND)]), RESPONSE)


@pytest.mark.parametrize("feet_m", [12 * YARD_M, 7 * YARD_M])
@pytest.mark.parametrize("yards", [5, -10, 20])
def test_a_camera_moves_to_the_yard_lines_whose_numbers_are_seen_however_far_these_are_from_the_sideline(yards, feet_m):
    best = placed(with_numbers(GRIDIRON, feet_m), slid(yards)).candidates[0].camera
    assert best.distance_m(STAND) < 0.1


def test_poses_that_put_other_numbers_there_are_no_rivals_any_more():
    found = placed(with_numbers(GRIDIRON, 12 * YARD_M), STAND, slid(5), slid(10))
    assert found.refusal is None
    assert found.candidates[0].camera.distance_m(STAND) < 0.1
    assert "the numbers on the field tell" in found.remarks[0]


def test_a_field_without_paint_of_numbers_leaves_open_which_yard_lines_are_seen():
    assert placed(GRIDIRON, slid(5), STAND) is None


def test_a_camera_is_not_moved_to_where_it_cannot_stand():
    here = Place(position=slid(5).pose.position, radius_m=2.0)
    assert placed(with_numbers(GRIDIRON, 12 * YARD_M), slid(5), place=here) is None


def test_a_camera_refused_for_another_reason_is_left_as_it_is():
    refusal = NotFound("few-lines", "too few points of lines could be measured")
    assert placed(with_numbers(GRIDIRON, 12 * YARD_M), slid(5), refusal=refusal) is None
