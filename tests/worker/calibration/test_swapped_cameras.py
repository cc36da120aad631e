"""Frames under the name of another camera are told from views that are blocked, dark or moved."""

import numpy as np
import pytest

from testbed.synthetic import CROWNED, camera, moved, paint_markings, pair
from tests.worker.calibration.outdated_pair import WIND, frames, in_wind, outdated, run
from worker.calibration.geometry.camera import Pose

pytestmark = pytest.mark.slow

OTHER_CAMERA = "other-camera"


def reasons(found):
    return [one.refusal and one.refusal.reason for one in found.cameras]


def test_exchanged_cameras_are_named_each_after_the_other_and_are_no_knock():
    found = run(cameras=in_wind(), pictures={"left": frames()["right"], "right": frames()["left"]})
    assert reasons(found) == [OTHER_CAMERA, OTHER_CAMERA]
    assert [one.view.cause for one in found.cameras] == [OTHER_CAMERA, OTHER_CAMERA]
    assert "camera left: the frame looks like camera right's" in found.rejected_because
    assert "camera right: the frame looks like camera left's" in found.rejected_because
    assert "are cables or addresses exchanged?" in found.cameras[0].rejected_because
    assert not any(one.knocked for one in found.cameras)
    for one, before in zip(found.cameras, in_wind(), strict=True):
        np.testing.assert_array_equal(one.camera.pose.position, before.pose.position)


@pytest.mark.long
def test_a_frame_that_was_sent_for_two_cameras_is_refused_for_the_one_it_is_not_of():
    found = run(pictures={"left": frames()["right"], "right": frames()["right"]})
    assert reasons(found) == [OTHER_CAMERA, None]
    assert "was a frame of right sent for both" in found.cameras[0].rejected_because


@pytest.mark.long
def test_cameras_that_are_near_are_not_searched_for_beside_a_frame_that_was_sent_twice():
    left, right = pair()
    third = camera("third", (30.0, -46.0, 12.0), (38.0, -6.0))
    stored = [moved(one, *WIND) for one in (left, right, third)]
    found = run(cameras=stored, pictures={**frames(), "third": frames()["right"]})
    assert reasons(found) == [None, None, OTHER_CAMERA]
    assert found.path == "near"


@pytest.mark.long
@pytest.mark.parametrize("spoiled", [np.zeros_like, lambda frame: np.full_like(frame, 128)])
def test_a_spoiled_frame_is_not_called_anothers(spoiled):
    found = run(pictures={**frames(), "left": (spoiled(frames()["left"][0]),)})
    assert found.cameras[0].refusal.reason != OTHER_CAMERA
    assert found.cameras[1].accepted


@pytest.mark.long
def test_a_camera_that_was_turned_to_where_its_neighbour_looks_is_not_called_the_neighbour():
    """Both hang on one mast, a metre apart: what tells them apart is where the view was taken from."""
    left, right = pair()
    right = right.with_pose(Pose.looking_at((-0.2, -48.0, 10.0), (20.0, 0.0, 0.0)))
    turned = left.with_pose(Pose.looking_at(left.pose.position, (20.0, 0.0, 0.0)))
    pictures = {"left": (painted(turned),), "right": (painted(right),)}
    found = run(cameras=[left, right], pictures=pictures, recover="never")
    assert found.cameras[0].refusal.reason != OTHER_CAMERA
    assert found.cameras[1].accepted


@pytest.mark.long
def test_cameras_of_other_frame_sizes_are_not_compared():
    left, _ = outdated()
    small = camera("right", (1.0, -48.0, 10.0), (20.0, 0.0), focal=400, size=(640, 360))
    pictures = {"left": frames()["right"], "right": (painted(small),)}
    found = run(cameras=[left, small], pictures=pictures, recover="never")
    assert found.cameras[0].refusal.reason != OTHER_CAMERA


def painted(view):
    grass, white = np.array([60, 130, 70], np.float32), np.array([235, 240, 235], np.float32)
    paint = paint_markings(CROWNED, view)[..., None]
    return (grass + (white - grass) * paint).astype(np.uint8)
