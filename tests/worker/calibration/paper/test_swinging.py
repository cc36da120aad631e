"""Cameras that swing about the ground that they look at."""

import numpy as np
import pytest

from testbed.synthetic import pair
from worker.calibration.geometry.camera import Pose
from worker.calibration.paper.swinging import from_swinging, looked_at, swinging
from worker.calibration.search.genome import genome_of, with_genome


def test_swinging_genomes_come_back_as_they_were():
    rng = np.random.default_rng(0)
    genomes = genome_of(pair()) + 0.1 * rng.normal(size=(7, 12))
    pivots = rng.normal(size=(2, 3))
    assert from_swinging(swinging(genomes, pivots), pivots) == pytest.approx(genomes)


def test_a_turn_of_a_swinging_genome_moves_the_camera_and_leaves_the_ground_it_looks_at_where_it_is_seen():
    camera = pair()[0]
    pivot = looked_at(camera)
    turned = swinging(genome_of([camera]), pivot[None])
    turned[:3] += [0.02, -0.01, 0.03]
    swung = with_genome([camera], from_swinging(turned, pivot[None]))[0]
    assert swung.distance_m(camera) > 0.3
    assert swung.project(pivot) == pytest.approx(camera.project(pivot))


def test_a_camera_looks_at_the_ground_in_its_axis_and_one_that_looks_up_at_none():
    camera = pair()[0]
    principal_point = camera.intrinsics.matrix[:2, 2]
    assert camera.project(looked_at(camera)) == pytest.approx(principal_point)
    upwards = camera.with_pose(Pose.looking_at([1.0, 2.0, 10.0], [0.0, 40.0, 30.0]))
    assert looked_at(upwards) == pytest.approx([1.0, 2.0, 0.0])
