"""From which side cameras look at a field that is the same from both."""

import numpy as np
import pytest

from testbed.parameters import try_first
from testbed.synthetic import PITCH, camera, paint_frame, worn
from worker.calibration.relocalisation.field_halves import choose_sides, side_of
from worker.calibration.relocalisation.relocalise import twin
from worker.calibration.relocalisation.shared_ground import SharedGround
from worker.calibration.relocalisation.sought import ANYWHERE, Place

LEFT = camera("left", (-1.0, -48.0, 10.0), (-20.0, 0.0))
RIGHT = camera("right", (1.0, -48.0, 10.0), (20.0, 0.0))
OPPOSITE = camera("opposite", (30.0, 45.0, 12.0), (20.0, 0.0))
FACING = camera("facing", (0.5, 47.0, 10.5), (-15.0, 0.0))
UNSEEN = SharedGround.of(PITCH, {})


def anywhere(*cameras):
    return {one.id: ANYWHERE for one in cameras}


def test_the_twin_of_a_camera_sees_the_other_half_as_it_sees_this_one():
    lines = PITCH.line_points().position
    turned = lines * [-1.0, -1.0, 1.0]
    np.testing.assert_allclose(twin(LEFT).project(turned), LEFT.project(lines), atol=1e-6)
    assert twin(twin(LEFT)).pose.position.tolist() == LEFT.pose.position.tolist()


@pytest.mark.parametrize("found", [LEFT, twin(LEFT)])
def test_a_camera_alone_is_taken_to_stand_on_the_near_side_and_that_is_said(found):
    (chosen,) = choose_sides([found], anywhere(found), [], UNSEEN)
    np.testing.assert_allclose(chosen.camera.pose.position, LEFT.pose.position)
    assert chosen.decided
    assert "assumed: it stands on the near side" in chosen.remark


@pytest.mark.parametrize("others", [RIGHT, twin(RIGHT)])
def test_cameras_of_one_mount_stand_together(others):
    chosen = choose_sides([LEFT, others], anywhere(LEFT, others), [], UNSEEN)
    np.testing.assert_allclose(chosen[1].camera.pose.position, RIGHT.pose.position)
    assert all(one.decided for one in chosen)


def test_a_side_that_is_given_is_that_of_the_camera_and_needs_no_remark():
    (chosen,) = choose_sides([LEFT], {"left": Place("far")}, [], UNSEEN)
    np.testing.assert_allclose(chosen.camera.pose.position, twin(LEFT).pose.position)
    assert (chosen.decided, chosen.remark) == (True, None)


def test_cameras_stand_with_one_whose_pose_is_known():
    (chosen,) = choose_sides([LEFT], anywhere(LEFT), [twin(RIGHT)], UNSEEN)
    np.testing.assert_allclose(chosen.camera.pose.position, twin(LEFT).pose.position)
    assert chosen.decided


def test_of_two_cameras_far_apart_the_second_one_is_not_guessed():
    first, second = choose_sides([LEFT, OPPOSITE], anywhere(LEFT, OPPOSITE), [], UNSEEN)
    assert first.decided
    assert not second.decided
    assert "give its `side`" in second.remark


def seen_by(*cameras):
    return SharedGround.of(PITCH, {one.id: worn(PITCH, one, paint_frame(PITCH, one)) for one in cameras})


@pytest.mark.parametrize("found", try_first([twin(FACING), FACING]))
def test_a_camera_stands_where_the_ground_looks_as_another_one_sees_it_even_opposite_it(found):
    chosen = choose_sides([LEFT, found], anywhere(LEFT, found), [], seen_by(LEFT, FACING))
    np.testing.assert_allclose(chosen[1].camera.pose.position, FACING.pose.position)
    assert chosen[1].decided
    assert "stand on the far side: from there the ground between the lines looks as camera left" in chosen[1].remark


@pytest.mark.long
def test_a_camera_opposite_another_one_is_not_taken_to_stand_beside_it_where_the_ground_speaks_against_that():
    # Correlations of less than 0.2 decide nothing, and are more than none.
    worn_frame = worn(PITCH, FACING, paint_frame(PITCH, FACING))
    noise = np.random.default_rng(1).normal(0, 180, worn_frame.shape)
    noisy = np.clip(worn_frame + noise, 0, 255).astype(np.uint8)
    frames = {"left": worn(PITCH, LEFT, paint_frame(PITCH, LEFT)), "facing": noisy}
    ground = SharedGround.of(PITCH, frames)
    compared = ground.compare([FACING, twin(FACING)], [LEFT])
    assert compared.right is None
    assert compared.correlations[0] > 0.12
    _, second = choose_sides([LEFT, FACING], anywhere(LEFT, FACING), [], ground)
    assert not second.decided


@pytest.mark.parametrize(
    ("position", "side"),
    [((0, -50, 9), "near"), ((20, 45, 9), "far"), ((-70, 5, 9), "left"), ((70, -20, 9), "right")],
)
def test_the_side_of_a_camera_is_a_word(position, side):
    assert side_of(camera("one", position, (0.0, 0.0))) == side
