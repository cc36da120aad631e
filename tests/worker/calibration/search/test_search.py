"""The levels of a search: who hands over to whom, and when."""

import numpy as np

from tests.demo.render import outdated
from tests.worker.calibration.synthetic import CROWNED, pair, pair_markings
from worker.calibration.geometry.rotation import rotation_angles_deg
from worker.calibration.search.genome import genome_of
from worker.calibration.search.search import ON_THE_GROUND, Level, Strategy, search


class Bowl:
    """A loss that is least at `bottom` and known to a step of `coarseness`."""

    def __init__(self, bottom, coarseness):
        self.bottom, self.coarseness = bottom, coarseness

    def losses(self, genomes):
        return np.floor(np.linalg.norm(genomes - self.bottom, axis=1) / self.coarseness) * self.coarseness


def searched(levels, generations):
    cameras, steps = pair(), []
    strategy = Strategy(16, 32, generations, 0.5)
    rng = np.random.default_rng(0)
    found = search(
        CROWNED,
        cameras,
        [None] * len(cameras),
        levels,
        strategy,
        rng,
        lambda number, loss: steps.append((number, loss)),
    )
    return found, steps


def level(coarseness, patience=None, by=0.05):
    bottom = genome_of(pair()) + by
    return Level(1.0, lambda *_: Bowl(bottom, coarseness), patience)


def test_a_level_in_which_nothing_moves_ends_early_and_the_next_one_begins():
    found, steps = searched([level(1e3, patience=6), level(1e-6)], 40)
    assert found.generations == 6 + 20
    assert [number for number, _ in steps] == list(range(1, 27))


def test_a_level_without_patience_uses_all_its_generations():
    found, _ = searched([level(1e3)], 40)
    assert found.generations == 40


def test_the_best_never_gets_worse_within_a_level():
    _, steps = searched([level(1e-6)], 30)
    losses = [loss for _, loss in steps]
    assert losses == sorted(losses, reverse=True)


def test_generations_are_shared_among_the_levels():
    found, _ = searched([level(1e-6), level(1e-6), level(1e-6)], 10)
    assert found.generations == 10


def test_the_papers_objective_catches_a_camera_that_is_as_far_off_as_the_papers():
    camera, markings = pair()[0], pair_markings()[0]
    start = camera.with_pose(outdated(camera.pose, 0.162, 2.1, np.random.default_rng(3)))
    strategy = Strategy(24, 48, 30, 0.5)

    found = search(
        CROWNED, [start], [markings], ON_THE_GROUND, strategy, np.random.default_rng(0), lambda *_: None
    ).cameras[0]

    assert rotation_angles_deg(found.pose.rotation, camera.pose.rotation) < 0.5
