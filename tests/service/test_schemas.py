import cv2
import numpy as np
import pytest
from pydantic import ValidationError

from service.schemas import VENUE_EXAMPLE, Intrinsics, Options, Pose, PoseIn, VenueIn


def test_the_documented_venue_is_one():
    assert VenueIn.model_validate(VENUE_EXAMPLE).stored().cameras[0].id == "left"


@pytest.mark.parametrize("rotation", [[0, 0, 0], [1.675, 0.372, -0.462], [0, 0, 3.14], [-9, 2, 1]])
def test_translation_and_position_agree_with_opencv(rotation):
    position = np.array([-1.48, -49.49, 7.84])
    pose = Pose.of(PoseIn(rotation=rotation, position=position.tolist()))
    matrix, _ = cv2.Rodrigues(np.array(rotation, dtype=float))
    np.testing.assert_allclose(pose.translation, -matrix @ position, atol=1e-12)
    back = Pose.of(PoseIn(rotation=rotation, translation=pose.translation))
    np.testing.assert_allclose(back.position, position, atol=1e-12)


def test_a_pose_needs_exactly_one_place():
    for places in ({}, {"position": [0, 0, 1], "translation": [0, 0, 1]}):
        with pytest.raises(ValidationError, match="exactly one"):
            PoseIn(rotation=[0, 0, 0], **places)


@pytest.mark.parametrize("length", [0, 4, 5, 8, 12, 14])
def test_the_distortions_of_opencv_are_taken(length):
    document = VENUE_EXAMPLE | {"cameras": [dict(VENUE_EXAMPLE["cameras"][0])]}
    matrix = VENUE_EXAMPLE["cameras"][0]["intrinsics"]["matrix"]
    document["cameras"][0]["intrinsics"] = {"matrix": matrix, "distortion": [0.01] * length}
    assert len(VenueIn.model_validate(document).cameras[0].intrinsics.distortion) == length


@pytest.mark.parametrize(("length", "taken"), [(0, True), (4, True), (5, False)])
def test_a_fisheye_has_no_distortion_or_four_numbers(length, taken):
    matrix = VENUE_EXAMPLE["cameras"][0]["intrinsics"]["matrix"]
    document = {"model": "fisheye", "matrix": matrix, "distortion": [0.01] * length}
    if taken:
        assert len(Intrinsics.model_validate(document).distortion) == length
    else:
        with pytest.raises(ValidationError, match="must have 0 or 4 numbers with the model fisheye"):
            Intrinsics.model_validate(document)


def test_a_matrix_of_another_resolution_is_noticed():
    document = VENUE_EXAMPLE | {"cameras": [VENUE_EXAMPLE["cameras"][0] | {"image_size": [640, 360]}]}
    with pytest.raises(ValidationError, match="does not belong to an image of 640x360"):
        VenueIn.model_validate(document)


@pytest.mark.parametrize("place", ["position", "translation"])
@pytest.mark.parametrize("height", [0.0, -7.84])
def test_a_camera_under_the_pitch_is_named(place, height):
    pose = Pose.at([1.675, 0.372, -0.462], [-1.48, -49.49, height - 1e-9])
    camera = VENUE_EXAMPLE["cameras"][0] | {"pose": pose.model_dump(include={"rotation", place})}
    document = VENUE_EXAMPLE | {"cameras": [camera]}
    with pytest.raises(ValidationError, match=r"camera left stands at .* z points up, .* above the pitch"):
        VenueIn.model_validate(document)


def test_cameras_have_names_of_their_own():
    document = VENUE_EXAMPLE | {"cameras": VENUE_EXAMPLE["cameras"] * 2}
    with pytest.raises(ValidationError, match="same id"):
        VenueIn.model_validate(document)


def test_options_have_the_documented_defaults():
    assert Options().model_dump(exclude_none=True) == {
        "preset": "esc",
        "generations": 100,
        "parents": 64,
        "offspring": 128,
        "stitch_weight": 0.5,
        "flat": False,
        "fit_focal_length": False,
        "fit_ridge": False,
        "dry_run": False,
        "priority": "routine",
    }


def test_what_only_the_finish_finds_needs_the_preset_that_has_one():
    assert Options(fit_focal_length=True, fit_ridge=True).fit_ridge
    for wrong in ({"preset": "paper", "fit_ridge": True}, {"flat": True, "fit_ridge": True}):
        with pytest.raises(ValidationError, match="fit_ridge"):
            Options.model_validate(wrong)
