import cv2
import numpy as np
import pytest
from pydantic import ValidationError

from service.schemas.geometry import Intrinsics, Pose, PoseIn
from service.schemas.names import PANORAMAS
from service.schemas.venue import VENUE_EXAMPLE


@pytest.mark.parametrize("rotation", [[0, 0, 0], [1.675, 0.372, -0.462], [0, 0, 3.14], [-9, 2, 1]])
def test_translation_and_position_agree_with_opencv(rotation):
    position = np.array([-1.48, -49.49, 7.84])
    pose = Pose.from_input(PoseIn(rotation=rotation, position=position.tolist()))
    matrix, _ = cv2.Rodrigues(np.array(rotation, dtype=float))
    np.testing.assert_allclose(pose.translation, -matrix @ position, atol=1e-12)
    back = Pose.from_input(PoseIn(rotation=rotation, translation=pose.translation))
    np.testing.assert_allclose(back.position, position, atol=1e-12)


def test_a_pose_needs_a_place():
    with pytest.raises(ValidationError, match="position or translation"):
        PoseIn(rotation=[0, 0, 0])


def test_a_pose_with_both_places_is_kept_to_the_last_digit_where_they_agree_to_a_micrometre():
    pose = Pose.from_position([1.675, 0.372, -0.462], [-1.48, -49.49, 7.84])
    assert Pose.from_input(PoseIn.model_validate(pose.model_dump())) == pose
    rounded = pose.model_copy(update={"translation": [round(component, 7) for component in pose.translation]})
    assert Pose.from_input(PoseIn.model_validate(rounded.model_dump())) == rounded


def test_a_pose_whose_two_places_differ_is_refused():
    pose = Pose.from_position([1.675, 0.372, -0.462], [-1.48, -49.49, 7.84])
    moved = pose.model_dump() | {"position": [-1.48, -49.49, 7.8401]}
    with pytest.raises(ValidationError, match=r"translation is 0\.0001 m from -R·position: leave out"):
        PoseIn.model_validate(moved)


def test_a_translation_that_repeats_the_position_is_named_as_such():
    place = [-1.48, -49.49, 7.84]
    with pytest.raises(ValidationError, match="translation is the same as position: OpenCV's tvec is"):
        PoseIn(rotation=[1.675, 0.372, -0.462], position=place, translation=place)


@pytest.mark.parametrize(("length", "taken"), [(0, True), (4, True), (5, False)])
def test_a_fisheye_has_no_distortion_or_four_numbers(length, taken):
    matrix = VENUE_EXAMPLE["cameras"][0]["intrinsics"]["matrix"]
    document = {"model": "fisheye", "matrix": matrix, "distortion": [0.01] * length}
    if taken:
        assert len(Intrinsics.model_validate(document).distortion) == length
    else:
        with pytest.raises(ValidationError, match="must have 0 or 4 numbers with the model fisheye"):
            Intrinsics.model_validate(document)


@pytest.mark.parametrize("model", PANORAMAS)
def test_a_panorama_has_no_distortion_no_skew_and_a_sigma_of_its_matrix_alone(model):
    lens = {"model": model, "matrix": [[1222.0, 0, 1919.5], [0, 1260.0, 40.0], [0, 0, 1]], "distortion": []}
    assert Intrinsics.model_validate(lens | {"sigma": {"fx": 4.0, "cy": 2.0, "aspect": 0.01}}).panorama == model
    for change, why in (
        ({"distortion": [0.1, 0, 0, 0]}, f"distortion must have 0 numbers with the model {model}"),
        ({"matrix": [[1222.0, 2.0, 1919.5], *lens["matrix"][1:]]}, f"skew must be 0 with the model {model}, came 2"),
        ({"sigma": {"k1": 0.01}}, f"sigma has k1: with the model {model} it takes fx, fy, aspect, cx, cy \\["),
    ):
        with pytest.raises(ValidationError, match=why):
            Intrinsics.model_validate(lens | change)


MATRIX = VENUE_EXAMPLE["cameras"][0]["intrinsics"]["matrix"]
KNOWN = {"fx": 4.0, "fy": 4.5, "aspect": 1e-3, "cx": 6.0, "cy": 5.0, "k1": 2e-3, "k4": 0.1}


@pytest.mark.parametrize("model", ["opencv", "fisheye"])
def test_a_lens_says_how_well_each_of_its_numbers_is_known_or_nothing_of_it(model):
    lens = {"model": model, "matrix": MATRIX, "distortion": []}
    assert Intrinsics.model_validate(lens | {"sigma": KNOWN}).sigma == KNOWN
    for nothing in ({}, {"sigma": None}, {"sigma": {}}):
        assert not Intrinsics.model_validate(lens | nothing).sigma


@pytest.mark.parametrize(
    ("model", "sigma", "why"),
    [
        ("opencv", {"f": 4.0}, "sigma has f: with the model opencv it takes fx, fy, aspect, cx, cy, k1"),
        ("fisheye", {"k1": 0.1, "p1": 0.1, "k5": 0.1}, "sigma has p1, k5: with the model fisheye"),
        ("opencv", {"fx": 0.0}, "greater than or equal to 0.000000001"),
        ("opencv", {"fx": -4.0}, "greater than or equal to 0.000000001"),
        ("opencv", {"fx": 1e300}, "less than or equal to 1000000"),
        ("opencv", {"fx": float("nan")}, "finite number"),
        ("opencv", {"fx": "4"}, "valid number"),
    ],
)
def test_a_deviation_of_no_number_of_the_lens_or_of_no_size_is_refused(model, sigma, why):
    with pytest.raises(ValidationError, match=why):
        Intrinsics.model_validate({"model": model, "matrix": MATRIX, "distortion": [], "sigma": sigma})


def test_the_same_lens_is_as_well_known_as_was_said_last_and_another_one_as_before():
    lens = Intrinsics(matrix=MATRIX, distortion=[])
    known = lens.model_copy(update={"sigma": {"fx": 4.0}})
    longer = lens.model_copy(update={"matrix": [[2200.0, 0, 1634.8], *MATRIX[1:]]})
    assert (lens.with_sigma_of(known), known.with_sigma_of(lens)) == (known, lens)
    assert (lens.with_sigma_of(longer), known.with_sigma_of(longer)) == (lens, known)
