"""What a pose is worth: the truth is best, and nothing else pays."""

import numpy as np
import pytest

from tests.scenes import apart
from tests.worker.calibration.synthetic import CROWNED, moved, paint_markings, pair, pair_markings
from worker.calibration.detection.line_profile import blurred_line
from worker.calibration.search.genome import genome_of
from worker.calibration.search.objective import BlurredResponse, Objective

pytestmark = pytest.mark.slow


def scene():
    return pair(), list(pair_markings())


def loss(objective, cameras):
    return float(objective.losses(genome_of(cameras)[None])[0])


@pytest.mark.parametrize("blur_px", [48, 16, 6, 2])
def test_the_true_poses_cost_less_than_moved_ones(blur_px):
    cameras, responses = scene()
    objective = Objective(CROWNED, cameras, responses, 0.5, blur_px=blur_px)
    truth = loss(objective, cameras)
    for turn in ((0.01, 0, 0), (0, -0.01, 0), (0, 0, 0.02)):
        assert loss(objective, [moved(cameras[0], turn), cameras[1]]) > truth
    assert truth < 0.2


def test_turning_away_from_the_markings_does_not_pay():
    cameras, responses = scene()
    objective = Objective(CROWNED, cameras, responses, 0.5, blur_px=6)
    away = [moved(c, (0.6, 0, 0)) for c in cameras]
    assert loss(objective, away) > 0.95


def test_white_all_over_earns_nothing():
    cameras, responses = scene()
    objective = Objective(CROWNED, cameras, [np.ones_like(r) for r in responses], 0.0, blur_px=6)
    assert loss(objective, cameras) > 0.9


def test_a_response_beside_a_line_costs():
    cameras, responses = scene()
    nothing = [np.zeros_like(r) for r in responses]
    beside = [np.clip(np.roll(r, 4, axis=0) + np.roll(r, -4, axis=0), 0, 1) for r in responses]
    costs = [loss(Objective(CROWNED, cameras, seen, 0.0, blur_px=4), cameras) for seen in (nothing, beside)]
    assert costs[0] == pytest.approx(1.0)
    assert costs[1] > 1.0


def test_cameras_that_agree_on_a_wrong_pitch_are_still_told_apart_from_those_that_do_not():
    cameras, responses = scene()
    objective = Objective(CROWNED, cameras, responses, 1.0, blur_px=6)
    apart = [moved(cameras[0], by=(0.5, 0, 0)), cameras[1]]
    together = [moved(c, by=(0.1, 0, 0)) for c in cameras]
    assert loss(objective, together) < loss(objective, apart)


def test_a_single_camera_has_no_stitch_term():
    cameras, responses = scene()
    alone = Objective(CROWNED, cameras[:1], responses[:1], 1.0, blur_px=6)
    assert alone.stitch_weight == 0
    assert loss(alone, cameras[:1]) < 0.15


def test_cameras_without_overlap_have_no_stitch_term():
    objective = Objective(CROWNED, apart(), [paint_markings(CROWNED, c) for c in apart()], 0.5, blur_px=6)
    assert objective.pairs == []


def test_a_population_is_judged_as_its_members_are():
    cameras, responses = scene()
    objective = Objective(CROWNED, cameras, responses, 0.5, blur_px=6)
    genomes = genome_of(cameras) + 0.01 * np.random.default_rng(0).normal(size=(5, 12))
    together = objective.losses(genomes)
    np.testing.assert_allclose(together, [objective.losses(genome[None])[0] for genome in genomes], rtol=1e-12)


@pytest.mark.parametrize("sigma", [1.0, 3.0, 10.0, 48.0])
def test_a_blurred_line_has_the_height_that_is_expected_of_it(sigma):
    picture = np.zeros((400, 700), dtype=np.float32)
    picture[:, 340:352] = 1
    blurred = BlurredResponse.from_response(picture, sigma)
    height = blurred.at(np.array([[345.5]]), np.array([[200.0]]))[0, 0]
    assert height == pytest.approx(float(blurred_line(np.array([12.0]), sigma)[0]), rel=0.05)


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
