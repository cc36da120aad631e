"""How far apart two cameras put the same paint, all along what both see."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from testbed.synthetic import CROWNED, moved, pair
from tests.worker.calibration.sights import pair_observed
from worker.calibration.diagnostics.seam import Seam, SeamPlace, measure_seam
from worker.calibration.refinement.refine import evaluate_poses


@cache
def seam(by=(0.0, 0.0, 0.0)):
    """Of the pair, the right camera believed to stand beside where it does."""
    left, right = pair()
    return measure_seam(CROWNED, *evaluate_poses(CROWNED, [left, moved(right, by=by)], pair_observed()).each)


def test_cameras_in_their_places_agree_all_along_the_seam():
    places = seam().places
    assert 6 <= len(places) <= 24
    assert all(place.error_m < 0.02 + 3 * place.sigma_m for place in places)
    assert np.median([place.error_m for place in places]) < 0.01


def test_a_camera_that_stands_beside_its_place_shows_it_across_the_lines_and_not_along_them():
    halfway = [place for place in seam((0.15, 0.0, 0.0)).places if abs(place.across[0]) > 0.99]
    level = [place for place in seam((0.15, 0.0, 0.0)).places if abs(place.across[1]) > 0.99]
    assert len(halfway) >= 3
    for place in halfway:
        # It believes that what it sees is as far to the right as itself.
        assert place.error_m * place.across[0] == pytest.approx(0.15, abs=0.02 + 3 * place.sigma_m)
    assert all(place.error_m < 0.02 + 3 * place.sigma_m for place in level)


def test_the_places_are_in_order_from_end_to_end_and_the_worst_is_named():
    turned = seam((0.0, 0.0, 0.1))
    along = [place.at[1] for place in turned.places]
    assert np.corrcoef(along, np.arange(len(along)))[0, 1] > 0.9
    assert turned.worst.error_m > np.median([place.error_m for place in turned.places])


def test_a_place_that_is_measured_badly_is_not_the_worst():
    measured = [(0.02, 0.01), (0.05, 0.01), (0.04, 0.012), (0.3, 0.1)]
    places = [SeamPlace(np.zeros(2), np.array([1.0, 0.0]), error_m, sigma_m) for error_m, sigma_m in measured]
    assert Seam(places).worst is places[1]


def test_cameras_that_have_measured_nothing_in_common_have_no_seam():
    first, second = evaluate_poses(CROWNED, pair(), pair_observed()).each
    none = measure_seam(CROWNED, first, replace(second, measured=None))
    assert (none.places, none.worst) == ([], None)
