"""Floors of halls are taken to be as even as they are, and turf as uneven as it is."""

from dataclasses import replace

import numpy as np
import pytest

from fields.template import TURF_M, load
from testbed.simulated_nights import Painted, SimulatedSight
from testbed.synthetic import camera
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.ground import Ground
from worker.calibration.geometry.parameters import field_parameters, lens_parameters, with_lens_changed
from worker.calibration.refinement.refine import refine

pytestmark = pytest.mark.slow

NIGHTS = 12
HALL = Field(40.0, 20.0, 0.05, None, load("handball"))


def hall_camera():
    """On a gallery beside the court, over one half of it."""
    return camera("hall", (-4.0, -19.0, 6.0), (-8.0, 0.0), focal=1400.0, size=(1920, 1080))


def finished(court, painted, rng, real=None):
    sight = SimulatedSight(painted, [real or hall_camera()], 0.2 * rng.normal(size=(1, len(painted.lines))))
    return refine(court, [hall_camera()], sight, 0.5).each[0]


def drawn_as_expected(court, rng):
    """A painted court and a camera whose numbers are all off by what is expected of them."""
    painted = Painted.drawn(court, rng)
    there = painted.there + sum(p.expected * rng.normal() * p.shift for p in field_parameters(court))
    lens = np.array([p.expected * rng.normal() for p in lens_parameters([hall_camera()])])
    return replace(painted, there=there), with_lens_changed(hall_camera(), lens)


@pytest.mark.long
def test_in_a_hall_errors_are_as_large_as_the_sigmas_say():
    rng = np.random.default_rng(2)
    nights = [drawn_as_expected(HALL, rng) for _ in range(NIGHTS)]
    ends = [finished(HALL, painted, rng, camera) for painted, camera in nights]
    assert (
        0.4
        < np.sqrt(np.mean([(end.camera.distance_m(hall_camera()) / end.sigma.position_m) ** 2 for end in ends]))
        < 1.5
    )


@pytest.mark.long
def test_a_floor_leaves_less_doubt_than_turf_would():
    as_turf = replace(HALL, template=replace(HALL.template, uneven=TURF_M))
    rng = np.random.default_rng(3)
    painted = Painted.drawn(HALL, rng)
    floor, turf = (finished(court, painted, np.random.default_rng(4)) for court in (HALL, as_turf))
    assert floor.sigma.position_m < 0.8 * turf.sigma.position_m


@pytest.mark.parametrize("sport", ["handball", "ice-hockey", "tennis"])
def test_hard_floors_are_thought_more_even_than_turf(sport):
    size = {name: extent.default for name, extent in load(sport).size.items()}
    court = Field(size["length"], size["width"], size["line"], None, load(sport))
    assert Ground.under(court.line_points()).usual_m < TURF_M / 1.5


def test_sand_is_less_even_than_turf():
    assert load("beach-volleyball").uneven > TURF_M
