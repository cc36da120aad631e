"""What a change would bring: another height, more overlap, a marking that is not there."""

import numpy as np
import pytest

from testbed.synthetic import PITCH, pair
from tests.scenes import apart, chain, lone_line
from worker.calibration.planning.line_state import STATES
from worker.calibration.planning.plan import plan
from worker.calibration.planning.variations import (
    decisive_markings,
    higher,
    panned,
    raised,
    with_more_overlap,
)
from worker.calibration.planning.warnings import REFUSED, find_warnings

FRESH = STATES["fresh"]


def kinds(cameras, hidden=0.0):
    return {(warning.kind, *warning.cameras) for warning in find_warnings(plan(PITCH, cameras, FRESH, hidden))}


def test_a_raised_camera_keeps_the_ground_in_the_middle_of_its_picture_and_its_roll():
    one = pair()[0]
    other = raised(one, 3.0)
    middle = one.intrinsics.matrix[:2, 2]
    ray = one.rays(middle)
    ground = one.pose.position - ray * one.pose.position[2] / ray[2]
    np.testing.assert_allclose(other.project(ground), middle, atol=1e-6)
    assert other.pose.position[2] == pytest.approx(one.pose.position[2] + 3.0)
    assert other.pose.matrix[0, 2] == pytest.approx(one.pose.matrix[0, 2], abs=1e-9)


def test_a_panned_camera_looks_farther_to_the_left():
    one = pair()[1]
    before, after = (np.arctan2(*camera.pose.matrix[2, 1::-1]) for camera in (one, panned(one, 10.0)))
    assert np.degrees(after - before) == pytest.approx(10.0)


def test_more_height_and_more_overlap_make_a_pair_more_exact():
    planned = plan(PITCH, chain(), FRESH)
    change = higher(planned, 1)
    assert change.factor < 1
    pair_before = planned.pairs[0]
    after = with_more_overlap(planned, pair_before)
    assert after.seen.sum() > pair_before.seen.sum()
    assert after.line_m.sum() > pair_before.line_m.sum()


def test_a_camera_can_least_do_without_the_marking_that_it_loses_most_by():
    planned = plan(PITCH, [pair()[0]], FRESH)
    (markings,) = decisive_markings(planned)
    factors = [one.without.factor for one in markings]
    assert factors == sorted(factors, reverse=True)
    assert factors[0] > 1.05
    assert min(factors) > 0.999


def test_two_cameras_without_a_common_marking_are_warned_of():
    assert {("nothing-in-common", "left"), ("nothing-in-common", "right")} <= kinds(apart())
    assert not any(kind == "nothing-in-common" for kind, *_ in kinds(pair()))


def test_a_lone_line_is_warned_of_as_the_gate_would_refuse_it():
    found = {kind for kind, *_ in kinds([lone_line()])}
    assert found & set(REFUSED)
    assert not {kind for kind, *_ in kinds(pair())} & set(REFUSED)


def test_of_lines_that_people_hide_too_few_points_may_be_left_to_measure():
    few = "few-lines", lone_line().id
    assert few not in kinds([lone_line()])
    assert few in kinds([lone_line()], hidden=0.7)


def test_a_plan_with_two_cameras_moved_is_the_plan_of_all_at_their_new_poses():
    cameras = chain()
    moved = {0: panned(cameras[0], -3.0), 2: raised(cameras[2], 1.0)}
    of_changes = plan(PITCH, cameras, FRESH).planner.with_moved(moved).plan()
    anew = plan(PITCH, [moved.get(number, camera) for number, camera in enumerate(cameras)], FRESH)
    for one, other in zip(of_changes.cameras, anew.cameras, strict=True):
        np.testing.assert_allclose(one.place_m, other.place_m, rtol=1e-12)
        np.testing.assert_array_equal(one.line_m, other.line_m)
    assert [pair.stitch_m for pair in of_changes.pairs] == pytest.approx([pair.stitch_m for pair in anew.pairs])
