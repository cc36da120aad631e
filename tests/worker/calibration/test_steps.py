"""Cameras refined from where a search has found them."""

import numpy as np
import pytest

from testbed.synthetic import CROWNED, pair, pair_frames
from worker.calibration import steps
from worker.calibration.detection.contrast import Channels
from worker.calibration.geometry.derivatives import moved
from worker.calibration.problem import Problem
from worker.calibration.records import Options, ProgressReporter
from worker.calibration.refinement.refine import Observations, refine
from worker.calibration.steps import refine_poses

pytestmark = pytest.mark.slow

# A camera that is turned (degrees) and moved (m), and how many of its lines a finish finds that begins there.
BESIDE_LINES = [((1.0, 0.8, -0.6), (-0.6, -0.3, 0.0), 0.54), ((-0.4, -0.8, -0.6), (-0.7, 0.6, 0.8), 0.84)]


def seen():
    return Observations.of_lines_alone([Channels([pair_frames()[0]])])


def refined_as_in_a_job(begun):
    problem = Problem(CROWNED, [pair()[0]], None, Options(), [None])
    (found,) = refine_poses(problem, [begun], seen(), ProgressReporter(lambda _: None, lambda: False)).each
    return found


@pytest.mark.long
@pytest.mark.parametrize(("turned_deg", "moved_m", "agreement"), BESIDE_LINES)
def test_lines_beside_which_a_finish_ended_are_found_from_there(turned_deg, moved_m, agreement):
    left = pair()[0]
    begun = moved(left, np.append(np.radians(turned_deg), moved_m))
    (once,) = refine(CROWNED, [begun], seen(), 0.0).each
    assert once.evidence.agreement == pytest.approx(agreement, abs=0.05)
    assert once.camera.distance_m(left) > 0.25
    found = refined_as_in_a_job(begun)
    assert found.evidence.agreement > 0.95
    assert found.camera.distance_m(left) < 0.02


def test_a_finish_that_finds_its_lines_is_not_begun_again(monkeypatch):
    begun = []
    monkeypatch.setattr(steps, "refine", lambda *given, **named: begun.append(given) or refine(*given, **named))
    beside = moved(pair()[0], np.array([0.002, 0.002, 0.0, 0.05, 0.0, 0.0]))
    assert refined_as_in_a_job(beside).evidence.agreement > 0.95
    assert len(begun) == 1
