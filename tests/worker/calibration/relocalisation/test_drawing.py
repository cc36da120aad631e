"""Cameras that are drawn at random, where a frame shows no directions."""

import numpy as np
import pytest

from testbed.synthetic import PITCH
from worker.calibration.relocalisation.drawing import AIMED_AT, HIGHEST_M, LOWEST_M, draw
from worker.calibration.relocalisation.field_map import FieldMap

ROLL_DEG = 4.0


def test_cameras_are_drawn_beside_and_behind_a_field_and_look_at_it():
    field = FieldMap.of(PITCH)
    drawn = draw(field, np.array([500.0, 900.0]), np.radians(ROLL_DEG), 600, np.random.default_rng(1))
    x, y, z = drawn.positions.T
    beside = y < -field.half_size[1]
    assert (beside | (x < -field.half_size[0])).all()
    assert 0.6 < beside.mean() < 0.75
    assert ((z > LOWEST_M) & (z < HIGHEST_M)).all()
    ahead = drawn.rotations[:, 2]
    aimed_at = drawn.positions + ahead * (z / -ahead[:, 2])[:, None]
    assert (np.abs(aimed_at[:, :2]) <= AIMED_AT * field.half_size + 1e-6).all()
    assert set(drawn.focal_px) == {500.0, 900.0}
    roll = np.degrees(np.arcsin(drawn.rotations[:, 0, 2] / np.hypot(*drawn.rotations[:, :2, 2].T)))
    assert np.std(roll) == pytest.approx(ROLL_DEG, rel=0.1)
