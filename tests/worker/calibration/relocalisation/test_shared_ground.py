"""Poses told apart by what another camera sees of the same ground between the lines."""

from functools import cache

import numpy as np
import pytest

from testbed.synthetic import PITCH, camera, moved, mown, paint_frame, pair, worn
from worker.calibration.relocalisation.relocalise import twin
from worker.calibration.relocalisation.shared_ground import SharedGround

# Small frames show ground as well.
LEFT, RIGHT = (one.resized(640) for one in pair())
OPPOSITE = camera("opposite", (10.0, 46.0, 12.0), (-5.0, 0.0))
APART = camera("apart", (45.0, -50.0, 9.0), (60.0, -30.0)).resized(640)


CAMERAS = {one.id: one for one in (LEFT, RIGHT, OPPOSITE, APART)}


@cache
def bare(camera_id):
    return paint_frame(PITCH, CAMERAS[camera_id])


@cache
def painted(camera_id, shaded):
    return shaded(PITCH, CAMERAS[camera_id], bare(camera_id))


def ground(*cameras, shaded=worn):
    return SharedGround.of(PITCH, {one.id: painted(one.id, shaded) for one in cameras})


@pytest.mark.parametrize("other", [RIGHT, OPPOSITE], ids=["beside it", "opposite"])
@pytest.mark.parametrize("right", [0, 1])
def test_from_the_right_one_of_two_poses_the_ground_looks_as_another_camera_sees_it(other, right):
    poses = [LEFT, twin(LEFT)] if right == 0 else [twin(LEFT), LEFT]
    compared = ground(LEFT, other).compare(poses, [other])
    assert compared.right == right
    assert compared.others[right] == other.id
    assert f"as camera {other.id} sees it (correlation 0." in compared.in_words(right)


@pytest.mark.parametrize("by_m", [9.0, -18.0])
def test_a_pose_that_slid_along_the_field_sees_other_ground(by_m):
    compared = ground(LEFT, RIGHT).compare([moved(LEFT, by=(by_m, 0, 0)), LEFT], [RIGHT])
    assert compared.right == 1
    assert compared.correlations[0] < 0.1


def test_the_camera_that_sees_the_most_alike_is_named():
    compared = ground(LEFT, RIGHT, APART).compare([LEFT, twin(LEFT)], [APART, RIGHT])
    assert compared.right == 0
    assert compared.others[0] == "right"


@pytest.mark.long
def test_mown_stripes_which_look_alike_from_many_poses_decide_nothing():
    poses = [moved(LEFT, by=(by_m, 0, 0)) for by_m in (20.0, 10.0, -10.0)]
    assert ground(LEFT, RIGHT, shaded=mown).compare(poses, [RIGHT]).right is None


def test_ground_on_which_nothing_is_to_be_seen_decides_nothing():
    compared = ground(LEFT, RIGHT, shaded=lambda pitch, camera, frame: frame).compare([LEFT, twin(LEFT)], [RIGHT])
    assert compared.right is None
    assert np.abs(compared.correlations).max() < 0.2


@pytest.mark.parametrize("others", [[], [APART], [RIGHT]], ids=["nobody", "elsewhere", "without a frame"])
def test_a_camera_that_sees_no_ground_of_another_one_is_not_told(others):
    compared = ground(LEFT, APART).compare([LEFT, twin(LEFT)], others)
    assert compared.right is None
    assert np.abs(compared.correlations).max() < 0.1


def test_a_single_pose_has_to_be_seen_alike_too():
    seen = ground(LEFT, RIGHT)
    assert seen.compare([LEFT], [RIGHT]).right == 0
    assert seen.compare([twin(LEFT)], [RIGHT]).right is None


def test_frames_that_are_lit_differently_are_as_alike():
    frames = {one.id: painted(one.id, worn) for one in (LEFT, RIGHT)}
    dim = frames | {"right": (0.6 * frames["right"] + 10).astype(np.uint8)}
    as_it_is, dimmed = (
        SharedGround.of(PITCH, taken).compare([LEFT], [RIGHT]).correlations[0] for taken in (frames, dim)
    )
    assert dimmed == pytest.approx(as_it_is, abs=0.05)
