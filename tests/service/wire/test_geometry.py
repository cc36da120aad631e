import cv2
import numpy as np
import pytest
from pydantic import ValidationError

from service.wire.geometry import Intrinsics, Pose, PoseIn
from service.wire.venue import VENUE_EXAMPLE


@pytest.mark.parametrize("rotation", [[0, 0, 0], [1.675, 0.372, -0.462], [0, 0, 3.14], [-9, 2, 1]])
def test_translation_and_position_agree_with_opencv(rotation):
    position = np.array([-1.48, -49.49, 7.84])
    pose = Pose.of(PoseIn(rotation=rotation, position=position.tolist()))
    matrix, _ = cv2.Rodrigues(np.array(rotation, dtype=float))
    np.testing.assert_allclose(pose.translation, -matrix @ position, atol=1e-12)
    back = Pose.of(PoseIn(rotation=rotation, translation=pose.translation))
    np.testing.assert_allclose(back.position, position, atol=1e-12)


def test_a_pose_needs_a_place():
    with pytest.raises(ValidationError, match="position or translation"):
        PoseIn(rotation=[0, 0, 0])


def test_a_pose_with_both_places_is_kept_to_the_last_digit_where_they_agree_to_a_micrometre():
    pose = Pose.at([1.675, 0.372, -0.462], [-1.48, -49.49, 7.84])
    assert Pose.of(PoseIn.model_validate(pose.model_dump())) == pose
    rounded = pose.model_copy(update={"translation": [round(component, 7) for component in pose.translation]})
    assert Pose.of(PoseIn.model_validate(rounded.model_dump())) == rounded


def test_a_pose_whose_two_places_differ_is_refused():
    pose = Pose.at([1.675, 0.372, -0.462], [-1.48, -49.49, 7.84])
    moved = pose.model_dump() | {"position": [-1.48, -49.49, 7.8401]}
    with pytest.raises(ValidationError, match=r"translation is 0\.0001 m from -R·position: leave out"):
        PoseIn.model_validate(moved)


@pytest.mark.parametrize(("length", "taken"), [(0, True), (4, True), (5, False)])
def test_a_fisheye_has_no_distortion_or_four_numbers(length, taken):
    matrix = VENUE_EXAMPLE["cameras"][0]["intrinsics"]["matrix"]
    document = {"model": "fisheye", "matrix": matrix, "distortion": [0.01] * length}
    if taken:
        assert len(Intrinsics.model_validate(document).distortion) == length
    else:
        with pytest.raises(ValidationError, match="must have 0 or 4 numbers with the model fisheye"):
            Intrinsics.model_validate(document)
