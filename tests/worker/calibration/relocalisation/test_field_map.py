"""The markings of a field as a search over all poses needs them."""

import numpy as np
import pytest

from fields.template import Template
from testbed.synthetic import PITCH
from tests.worker.calibration.sports import field
from worker.calibration.geometry.field import Field
from worker.calibration.relocalisation.field_map import FieldMap

LOPSIDED = Field(
    20.0,
    10.0,
    0.05,
    template=Template(
        marking=[
            {"name": "border", "line": [[-10, -5], [10, -5], [10, 5], [-10, 5], [-10, -5]]},
            {"name": "line", "line": [[-4, -5], [-4, 5]]},
        ]
    ),
)


def test_every_point_lies_on_paint():
    markings = FieldMap.of(PITCH)
    beside, _ = markings.to_paint(*markings.points[:, :2].T.astype(float))
    assert np.linalg.norm(beside, axis=0).max() < 2 * markings.cell_m


def test_places_beside_the_field_are_as_far_from_paint_as_they_are():
    markings = FieldMap.of(PITCH)
    beside, _ = markings.to_paint(np.array([0.0]), np.array([-38.0]))
    assert np.linalg.norm(beside) == pytest.approx(4.0, abs=3 * markings.cell_m)


def test_places_beyond_the_map_are_not_on_it():
    _, on_map = FieldMap.of(PITCH).to_paint(np.array([500.0, 0.0]), np.array([0.0, 0.0]))
    assert on_map.tolist() == [False, True]


def test_straight_lines_are_known_by_where_they_run():
    markings = FieldMap.of(PITCH)
    assert {-52.44, 0.0, 52.44} <= set(markings.lines_along_y.round(2))
    assert {-33.94, 33.94} <= set(markings.lines_along_x.round(2))


@pytest.mark.parametrize("sport", ["basketball", "ice-hockey", "tennis", "volleyball"])
def test_fields_of_two_equal_halves_are_symmetric(sport):
    assert FieldMap.of(field(sport)).is_symmetric


def test_a_field_with_a_line_in_one_half_is_not():
    assert not FieldMap.of(LOPSIDED).is_symmetric
