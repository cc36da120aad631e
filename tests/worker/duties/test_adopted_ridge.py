"""A crowned pitch that its venue says is flat: rendered frames, the real network, engine, gate and store."""

import numpy as np
import pytest

from service.schemas.health import Alarms as Rules
from testbed.year import VENUE, Year, cameras, fast_motion, frames_of

pytestmark = pytest.mark.slow


def errors(year):
    """How far (m) each stored camera is from where it really is."""
    return [
        np.linalg.norm(np.subtract(stored.pose.position, truth.pose.position))
        for stored, truth in zip(year.venue.cameras, cameras(), strict=True)
    ]


@pytest.fixture
def said_to_be_flat(stock):
    """The venue and the service that looks after it."""
    with fast_motion() as clock:
        year = Year(stock, clock, Rules())
        flat = year.venue.field.model_copy(update={"ridge": None})
        stock.venues.put(year.venue.model_copy(update={"field": flat}))
        yield year


@pytest.mark.long
def test_the_ridge_is_offered_and_with_it_the_next_night_fits_better(said_to_be_flat, stock):
    year = said_to_be_flat
    frames = frames_of(cameras())
    before = year.calibrate(frames)
    assert before.accepted
    ridge = next(one for one in before.adoptable if one.name == "ridge_height_m")
    assert (ridge.given, ridge.value) == (0.0, pytest.approx(0.35, abs=3 * ridge.sigma))
    # Nothing is stored by itself.
    assert year.venue.field.ridge is None
    stock.adoption.adopt_number(VENUE, year.job, "ridge_height_m")
    off_by_m = errors(year)
    after = year.calibrate(frames)
    assert after.accepted
    assert after.adoptable == []
    assert after.stitch_error_px < before.stitch_error_px
    assert all(now < then / 3 for now, then in zip(errors(year), off_by_m, strict=True))
    for now, then in zip(after.cameras, before.cameras, strict=True):
        assert now.residual_px < then.residual_px / 2
        assert now.moved.position_m == pytest.approx(ridge.moves_m[now.id], rel=0.35)
