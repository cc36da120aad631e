"""A field that is not as its venue says is named, and no lens is bent to make up for it."""

from dataclasses import replace

import numpy as np
import pytest

from testbed.simulated_nights import Painted, SimulatedSight
from testbed.synthetic import CROWNED as PITCH
from testbed.synthetic import camera
from worker.calibration.geometry.parameters import FieldSkew
from worker.calibration.refinement.diagnosis import find_suspicions
from worker.calibration.refinement.refine import refine

pytestmark = pytest.mark.slow

NOISE_PX = 0.2
HALF = camera("half", (10.0, -55.0, 16.0), (26.0, 0.0), 2800.0, size=(3840, 2160))
BOX = camera("box", (40.0, -55.0, 16.0), (44.0, 0.0), 6000.0, size=(3840, 2160))


def found_on(displaced, pitch=PITCH, real=HALF):
    """The real camera, and what a search and a job make of it where lines lie `displaced` (N, 3)."""
    rng = np.random.default_rng(11)
    painted = Painted.drawn(PITCH, rng)
    painted = replace(painted, there=painted.there + displaced(painted.lines))
    sight = SimulatedSight(painted, [real], NOISE_PX * rng.normal(size=(1, len(painted.lines))))
    found = real
    for _ in range(3):
        (found,) = refine(pitch, [found], sight, 0.5, stored=[found]).cameras
    return real, refine(pitch, [found], sight, 0.5, stored=[found])


def skewed(by_m):
    return lambda lines: by_m * FieldSkew("skew_m", 1.0).around(PITCH).shift


def longer(by_m):
    def displaced(lines):
        there = PITCH.resized(length=PITCH.length + by_m)
        return there.measured_points.position - lines.position

    return displaced


@pytest.mark.long
@pytest.mark.parametrize(
    ("displaced", "name", "by_m"), [(longer(0.5), "length_m", 0.5), (skewed(0.15), "skew_m", 0.15)]
)
def test_what_is_off_is_named_and_the_sigma_covers_the_error(displaced, name, by_m):
    real, said = found_on(displaced)
    (found,) = said.each
    (suspicion,) = find_suspicions(said.deviations)
    assert suspicion.quantity == name
    assert suspicion.deviation == pytest.approx(by_m, abs=3 * suspicion.sigma)
    away_m = found.camera.distance_m(real)
    assert 0.05 < away_m < 3 * found.sigma.position_m
    refined_away_m = found.refined.camera.distance_m(real)
    assert refined_away_m < 3 * found.refined.sigma.position_m
    assert refined_away_m < away_m / 2


@pytest.mark.long
def test_a_number_that_is_said_to_be_unsure_is_named_as_surely():
    _, said = found_on(longer(0.5), replace(PITCH, sigma={"length_m": 0.5}))
    (suspicion,) = find_suspicions(said.deviations)
    assert (suspicion.quantity, suspicion.deviation) == ("length_m", pytest.approx(0.5, abs=0.05))


@pytest.mark.long
def test_where_one_box_is_seen_the_pose_is_as_sure_as_the_field_is_said_to_be():
    aside = longer(0.5)
    sigmas_m = []
    for known_m in (0.03, 0.5):
        real, said = found_on(aside, replace(PITCH, sigma={"length_m": known_m}), BOX)
        away_m = said.each[0].camera.distance_m(real)
        assert away_m == pytest.approx(0.25, abs=0.05)
        sigmas_m.append(said.each[0].sigma.position_m)
    assert sigmas_m[0] < away_m / 3
    assert sigmas_m[1] > away_m / 2


def test_a_field_that_is_as_it_is_said_to_be_is_doubted_in_nothing():
    real, said = found_on(lambda lines: np.zeros((len(lines), 3)))
    assert find_suspicions(said.deviations) == []
    assert said.each[0].camera.distance_m(real) < 0.05


def test_how_far_out_of_square_a_field_is_cannot_be_written_into_it():
    skew = FieldSkew("skew_m", 0.03)
    with pytest.raises(NotImplementedError, match="skew_m"):
        skew.applied([], PITCH, 0.1)
