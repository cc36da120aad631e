"""How well the length of a ridge is known, by how well the lines fit with each length that was tried."""

import numpy as np
import pytest

from testbed.synthetic import CROWNED
from worker.calibration.field_fit.ridge_length import PARTS, TriedRidge, TriedRidges

OF_THE_GRID = CROWNED.length / PARTS / np.sqrt(12)


def tried(costs):
    """Ridges of so many lengths, by what each costs."""
    return TriedRidges(CROWNED, [TriedRidge(CROWNED.with_ridge_length(length), cost) for length, cost in costs.items()])


def test_a_length_that_alone_fits_is_known_as_finely_as_lengths_were_tried_and_no_better():
    ridges = tried({20.0: 1e3, 30.0: 0.0, 40.0: 1e3})
    assert (ridges.best, ridges.sigma, ridges.alike) == (pytest.approx(30.0), pytest.approx(OF_THE_GRID), (30.0, 30.0))


def test_lengths_that_fit_alike_leave_all_between_them_open():
    ridges = tried({20.0: 0.0, 30.0: 1e3, 40.0: 0.0})
    assert ridges.best == pytest.approx(20.0)
    assert ridges.sigma == pytest.approx(np.hypot(10.0, OF_THE_GRID))
    assert ridges.alike == pytest.approx((20.0, 40.0))
