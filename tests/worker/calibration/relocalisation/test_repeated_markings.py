"""Cameras slid along a field whose markings repeat."""

import numpy as np
import pytest

from testbed.synthetic import camera
from tests.worker.calibration.sports import field
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.hypotheses import Hypotheses
from worker.calibration.relocalisation.repeated_markings import slid_along_field

YARD_LINES_M = 4.572
SIDELINE = camera("one", (5.0, -40.0, 15.0), (5.0, 0.0))


def slid(sport):
    start = Hypotheses.unbent(
        SIDELINE.pose.matrix[None], np.array([SIDELINE.pose.position]), np.array([SIDELINE.intrinsics.focal_length_px])
    )
    return slid_along_field(FieldMap.of(field(sport)), start)


def test_a_camera_of_american_football_is_slid_by_every_number_of_yard_lines():
    moves = slid("american-football").positions - SIDELINE.pose.position
    along = moves[(moves[:, 1] == 0) & (moves[:, 2] == 0), 0]
    for lines in (-3, -1, 1, 2, 10):
        assert abs(along - lines * YARD_LINES_M).min() < 0.03


@pytest.mark.parametrize("sport", ["american-football", "basketball", "tennis"])
def test_slid_cameras_look_where_they_looked_and_stand_elsewhere_on_the_field(sport):
    moved = slid(sport)
    moves = moved.positions - SIDELINE.pose.position
    assert len(moved) > 0
    assert (np.count_nonzero(moves, axis=1) == 1).all()
    assert np.all(moves[:, 2] == 0)
    assert np.all(moved.rotations == SIDELINE.pose.matrix)


def test_a_camera_of_a_rink_is_slid_from_each_circle_to_each_other_one():
    moves = np.round(slid("ice-hockey").positions - SIDELINE.pose.position, 6).tolist()
    for along, across in ((0, 14), (20, 7), (-20, 7), (40, 0), (-40, 14)):
        assert [along, across, 0] in moves
        assert [-along, -across, 0] in moves
