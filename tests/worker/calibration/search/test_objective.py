"""What a pose is worth: the truth is best, and nothing else pays."""

import numpy as np
import pytest

from testbed.synthetic import CROWNED, moved, pair, pair_markings
from worker.calibration.detection.line_profile import blurred_line
from worker.calibration.search.genome import genome_of
from worker.calibration.search.objective import BlurredResponse, Objective

pytestmark = pytest.mark.slow


def scene():
    """A camera, and the segmentation of its frame."""
    return pair()[0], pair_markings()[0]


def loss(objective, camera):
    return float(objective.losses(genome_of([camera])[None])[0])


@pytest.mark.parametrize("blur_px", [48, 16, 6, 2])
def test_the_true_pose_costs_less_than_moved_ones(blur_px):
    camera, response = scene()
    objective = Objective.build(CROWNED, camera, response, blur_px)
    truth = loss(objective, camera)
    for turn in ((0.01, 0, 0), (0, -0.01, 0), (0, 0, 0.02)):
        assert loss(objective, moved(camera, turn)) > truth
    assert truth < 0.2


def test_turning_away_from_the_markings_does_not_pay():
    camera, response = scene()
    objective = Objective.build(CROWNED, camera, response, blur_px=6)
    assert loss(objective, moved(camera, (0.6, 0, 0))) > 0.95


def test_white_all_over_earns_nothing():
    camera, response = scene()
    assert loss(Objective.build(CROWNED, camera, np.ones_like(response), blur_px=6), camera) > 0.9


def test_a_response_beside_a_line_costs():
    camera, response = scene()
    nothing = np.zeros_like(response)
    beside = np.clip(np.roll(response, 4, axis=0) + np.roll(response, -4, axis=0), 0, 1)
    costs = [loss(Objective.build(CROWNED, camera, seen, blur_px=4), camera) for seen in (nothing, beside)]
    assert costs[0] == pytest.approx(1.0)
    assert costs[1] > 1.0


def test_a_camera_that_sees_no_markings_has_nothing_to_lose():
    camera, response = scene()
    away = moved(camera, (2.0, 0, 0))
    assert loss(Objective.build(CROWNED, away, response, blur_px=6), away) == 1.0


def test_a_population_is_judged_as_its_members_are():
    camera, response = scene()
    objective = Objective.build(CROWNED, camera, response, blur_px=6)
    genomes = genome_of([camera]) + 0.01 * np.random.default_rng(0).normal(size=(5, 6))
    together = objective.losses(genomes)
    np.testing.assert_allclose(together, [objective.losses(genome[None])[0] for genome in genomes], rtol=1e-12)


@pytest.mark.parametrize("sigma", [1.0, 3.0, 10.0, 48.0])
def test_a_blurred_line_has_the_height_that_is_expected_of_it(sigma):
    picture = np.zeros((400, 700), dtype=np.float32)
    picture[:, 340:352] = 1
    blurred = BlurredResponse.from_response(picture, sigma)
    height = blurred.at(np.array([[345.5]]), np.array([[200.0]]))[0, 0]
    assert height == pytest.approx(float(blurred_line(np.array([12.0]), sigma)[0]), rel=0.05)


@pytest.mark.parametrize("sigma", [1.0, 10.0, 48.0])
def test_a_blurred_line_stays_where_it_was_however_coarsely_it_is_kept(sigma):
    picture = np.zeros((400, 704), dtype=np.float32)
    picture[:, 336:368] = 1
    edges = np.array([[336.0, 367.0]]), np.array([[200.0, 200.0]])
    ((left, right),) = BlurredResponse.from_response(picture, sigma).at(*edges)
    assert left == pytest.approx(right, rel=1e-3)


def test_outside_the_picture_there_is_nothing():
    blurred = BlurredResponse.from_response(np.ones((100, 100), dtype=np.float32), 2.0)
    column, row = np.array([[-50.0, 20.0, np.nan, np.inf]]), np.array([[20.0, 1e9, np.nan, 3.0]])
    np.testing.assert_array_equal(blurred.at(column, row), 0)


def test_the_size_of_a_picture_does_not_move_its_surround():
    rng = np.random.default_rng(8)
    whole = np.zeros((128, 192), dtype=np.float32)
    whole[:117, :173] = rng.random((117, 173))
    odd = whole[:117, :173]
    bands = [
        BlurredResponse.from_response(one, 4.0).minus(BlurredResponse.from_response(one, 16.0)) for one in (whole, odd)
    ]
    column, row = np.meshgrid(np.arange(0.0, 160.0, 7.0), np.arange(0.0, 110.0, 7.0))

    of_whole, of_odd = (band.at(column, row) for band in bands)

    assert of_odd == pytest.approx(of_whole, abs=1e-6)
