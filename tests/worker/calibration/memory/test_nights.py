"""Sequences of nights, each of which begins where the last one ended: none makes the engine confidently wrong."""

import pytest

from testbed.parameters import try_first
from tests.worker.calibration.memory.nights import nights_of
from worker.calibration.memory.camera_memory import ANCHOR_JOBS

pytestmark = pytest.mark.slow

FARTHEST_M, SIGMAS = 0.3, 3.0


def wrong(result, real):
    off = result.camera.distance_m(real)
    return result.accepted and (off > max(SIGMAS * result.sigma.position_m, 0.005) or off > FARTHEST_M)


@pytest.mark.long
def test_a_lens_that_is_right_is_accepted_every_night_and_nothing_is_said_of_it():
    done = nights_of(lambda _: 0.0, 12)
    assert all(result.accepted for result, _ in done)
    assert not any(result.lens_change.notable for result, _ in done[1:])


@pytest.mark.parametrize("step", try_first([0.003, 0.001, -0.01]))
def test_a_zoom_between_two_nights_is_told_at_once_and_by_how_much(step):
    done = nights_of(lambda night: step * (night >= 4), 6)
    assert not any(wrong(*one) for one in done)
    changed = [result.lens_change for result, _ in done[4:]]
    assert all(change.notable for change in changed)
    for change in changed:
        assert change.longer == pytest.approx(step, abs=max(0.0003, 0.06 * abs(step)))


@pytest.mark.long
def test_a_lens_that_creeps_by_half_a_thousandth_a_night_never_takes_the_pose_with_it():
    done = nights_of(lambda night: 0.0005 * night, 18)
    assert not any(wrong(*one) for one in done)
    named = next(n for n, (result, _) in enumerate(done) if result.lens_change and result.lens_change.notable)
    assert max(result.camera.distance_m(real) for result, real in done[:named]) < 0.1
    for result, real in done[ANCHOR_JOBS:]:
        if result.accepted:
            assert result.refined.camera.distance_m(real) < 3 * result.refined.sigma.position_m


@pytest.mark.long
def test_the_refined_pose_is_nearer_than_the_one_for_a_lens_that_is_off():
    done = nights_of(lambda _: 0.002, 3)
    for result, real in done:
        assert result.refined.camera.distance_m(real) < 0.5 * result.camera.distance_m(real)
