"""A few pieces of line that together say almost as much of a pose as all of them."""

import numpy as np

from testbed.synthetic import CROWNED, pair
from worker.calibration.geometry.derivatives import pixel_jacobian
from worker.calibration.geometry.visibility import VisibleLines
from worker.calibration.tracking.line_observations import most_telling

PRIOR = np.diag(np.repeat([0.03, 1.0], 3) ** -2.0)


def pieces():
    """What the left camera sees of the pitch: how pieces move with its pose, and the ten metres that each is of."""
    camera = pair()[0]
    seen = VisibleLines.from_camera(CROWNED.line_points(), camera)
    jacobian = np.einsum("mij,mi->mj", pixel_jacobian(camera, seen.points.position), seen.normal)
    return jacobian, seen.index // 40, seen.pixel


def sigmas(jacobian):
    return np.sqrt(np.diag(np.linalg.inv(PRIOR + jacobian.T @ jacobian)))


def test_they_say_more_than_as_many_that_were_taken_at_even_distances():
    jacobian, patch, _ = pieces()
    chosen = most_telling(jacobian, patch, PRIOR, 60)
    even = np.linspace(0, len(jacobian) - 1, 60).astype(int)
    assert len(np.unique(chosen)) == 60
    assert (sigmas(jacobian[chosen]) < sigmas(jacobian[even])).all()


def test_they_lie_in_most_places_that_have_lines():
    jacobian, patch, pixel = pieces()
    chosen = most_telling(jacobian, patch, PRIOR, 200)
    counts = np.bincount(np.unique(patch, return_inverse=True)[1][chosen])
    assert np.mean(counts > 0) > 0.8
    assert np.ptp(pixel[chosen], axis=0) @ [1, 1] > 0.95 * np.ptp(pixel, axis=0) @ [1, 1]


def test_where_there_are_fewer_all_of_them_are_taken():
    jacobian, patch, _ = pieces()
    assert most_telling(jacobian[:7], patch[:7], PRIOR, 60).tolist() == list(range(7))
