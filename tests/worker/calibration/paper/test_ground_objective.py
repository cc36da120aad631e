"""The paper's objective: the truth is best there too."""

import pytest

from testbed.parameters import try_first
from testbed.synthetic import CROWNED, moved, pair, pair_markings
from worker.calibration.paper.ground_objective import BROAD, NARROW, GroundObjective
from worker.calibration.search.genome import genome_of


def loss(objective, cameras):
    return float(objective.losses(genome_of(cameras)[None])[0])


@pytest.mark.parametrize("blurs", try_first([BROAD, NARROW]))
def test_the_papers_objective_prefers_the_truth_too(blurs):
    cameras, responses = pair(), list(pair_markings())
    objective = GroundObjective(CROWNED, cameras, responses, 0.5, blurs)
    truth = loss(objective, cameras)
    assert truth < loss(objective, [moved(c, (0.005, 0, 0)) for c in cameras])
    assert truth < 0.7


@pytest.mark.long
def test_the_papers_objective_sees_a_crown_through_its_planes():
    cameras, responses = pair(), list(pair_markings())
    with_roof = GroundObjective(CROWNED, cameras, responses, 0.5, BROAD)
    without = GroundObjective(CROWNED.flat(), cameras, responses, 0.5, BROAD)
    assert loss(with_roof, cameras) < loss(without, cameras)
