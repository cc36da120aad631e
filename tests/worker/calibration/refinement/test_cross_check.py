"""The cross-check: two halves of the lines differ by as much as their sigmas say."""

from dataclasses import replace

import numpy as np
import pytest

from testbed.simulated_nights import SHARED_PX, Painted, SimulatedSight
from testbed.synthetic import TAPED
from tests.worker.calibration.memory.nights import LINES, PITCH, box_camera
from worker.calibration.geometry.derivatives import moved
from worker.calibration.geometry.far_marking import far_marking_shift_m
from worker.calibration.geometry.parameters import with_lens_changed
from worker.calibration.refinement.cross_check import cross_check
from worker.calibration.refinement.refine import refine

NIGHTS = 12
SQUARE = replace(PITCH, sigma=TAPED | {"skew_m": 1e-3})
"""The pitch, whose right angles are known."""


def checked(painted, rng, noise_px=0.2):
    """The cross-check of a camera that stands where it is stored."""
    camera = box_camera()
    sight = SimulatedSight(painted, [camera], noise_px * rng.normal(size=(1, len(LINES))))
    return refine(SQUARE, [camera], sight, 0.5).each[0].cross_checked()


@pytest.mark.long
def test_over_many_fields_the_halves_differ_by_what_their_sigmas_say():
    rng = np.random.default_rng(3)
    checks = [checked(Painted.drawn(PITCH, rng), rng) for _ in range(NIGHTS)]
    rms = np.sqrt(np.mean([(check.apart_m / check.expected_m) ** 2 for check in checks]))
    assert 0.4 < rms < 1.5


def test_every_second_stretch_of_line_painted_aside_shows_in_the_difference_and_in_the_sigmas():
    rng = np.random.default_rng(4)
    painted = Painted.drawn(PITCH, rng)
    odd = (np.arange(len(LINES)) // 40) % 2 == 1
    aside = Painted(painted.pitch, painted.lines, painted.there + 0.015 * odd[:, None] * painted.lines.normal)
    straight = checked(painted, np.random.default_rng(5), SHARED_PX)
    bent = checked(aside, np.random.default_rng(5), SHARED_PX)
    assert bent.apart_m > 2 * straight.apart_m
    assert bent.apart_m > 1.5 * straight.expected_m
    assert bent.apart_m < 2 * bent.expected_m


def test_a_difference_of_pose_and_lens_is_told_as_metres_where_the_camera_sees_farthest():
    camera = box_camera()
    difference = np.array([2e-4, -1e-4, 1e-4, 0.02, 0.01, -0.01, 3.0, 0.5, -0.5, 1e-3, 0.0, 0.0])
    other = moved(with_lens_changed(camera, difference[6:]), difference[:6])
    told = cross_check(PITCH, camera, difference, np.diag(difference**2))
    assert told.apart_m == pytest.approx(far_marking_shift_m(PITCH, camera, other), rel=0.03)
    assert told.expected_m > 0


def test_a_camera_with_too_few_lines_for_two_halves_has_no_cross_check():
    rng = np.random.default_rng(6)
    camera = box_camera()
    painted = Painted.drawn(PITCH, rng)
    sight = SimulatedSight(painted, [camera], rng.normal(size=(1, len(LINES))))
    whole = sight.measure

    def little(lines, cameras, search_px):
        return [found[found.index % 50 < 2] for found in whole(lines, cameras, search_px)]

    sight.measure = little
    assert refine(PITCH, [camera], sight, 0.5).each[0].cross_checked() is None
