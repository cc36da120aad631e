import pytest
from pydantic import ValidationError

from service.schemas.geometry import Pose
from service.schemas.venue import VENUE_EXAMPLE, VenueIn
from service.schemas.view import VIEW_EXAMPLE


def test_the_documented_venue_is_one():
    assert VenueIn.model_validate(VENUE_EXAMPLE).to_venue().cameras[0].id == "left"


@pytest.mark.parametrize("length", [0, 4, 5, 8, 12, 14])
def test_the_distortions_of_opencv_are_taken(length):
    document = VENUE_EXAMPLE | {"cameras": [dict(VENUE_EXAMPLE["cameras"][0])]}
    matrix = VENUE_EXAMPLE["cameras"][0]["intrinsics"]["matrix"]
    document["cameras"][0]["intrinsics"] = {"matrix": matrix, "distortion": [0.01] * length}
    assert len(VenueIn.model_validate(document).cameras[0].intrinsics.distortion) == length


def test_a_matrix_of_another_resolution_is_noticed():
    document = VENUE_EXAMPLE | {"cameras": [VENUE_EXAMPLE["cameras"][0] | {"image_size": [640, 360]}]}
    with pytest.raises(ValidationError, match="does not belong to an image of 640x360"):
        VenueIn.model_validate(document)


@pytest.mark.parametrize("place", ["position", "translation"])
@pytest.mark.parametrize("height", [0.0, -7.84])
def test_a_camera_under_the_pitch_is_named(place, height):
    pose = Pose.from_position([1.675, 0.372, -0.462], [-1.48, -49.49, height - 1e-9])
    camera = VENUE_EXAMPLE["cameras"][0] | {"pose": pose.model_dump(include={"rotation", place})}
    document = VENUE_EXAMPLE | {"cameras": [camera]}
    with pytest.raises(ValidationError, match=r"camera left stands at .* z points up, .* above the pitch"):
        VenueIn.model_validate(document)


def test_cameras_have_names_of_their_own():
    document = VENUE_EXAMPLE | {"cameras": VENUE_EXAMPLE["cameras"] * 2}
    with pytest.raises(ValidationError, match="same id"):
        VenueIn.model_validate(document)


def with_zoom_counts(*counts):
    encoders = {"zoom": {"sensor_width_mm": 9.6, "counts": [*counts]}}
    return VENUE_EXAMPLE | {"cameras": [VENUE_EXAMPLE["cameras"][0] | {"encoders": encoders}]}


@pytest.mark.parametrize(
    ("counts", "words"),
    [
        ([[20, 0], [8, 9]], "sorted by their first numbers, each once: 8 follows 20"),
        ([[8, 0], [8, 9]], "sorted by their first numbers, each once: 8 follows 8"),
        ([[8, 0.5]], "counts are whole numbers, came 0.5"),
        ([[8, 2**24]], "less than or equal to 16777215"),
        ([], "at least 1"),
    ],
)
def test_counts_of_an_encoder_that_are_no_table_are_refused(counts, words):
    with pytest.raises(ValidationError, match=words):
        VenueIn.model_validate(with_zoom_counts(*counts))


def test_a_focal_length_that_is_not_in_the_table_of_the_zoom_is_warned_about():
    inside, outside = (with_zoom_counts([low, 0], [20, 65535]) for low in (6, 7))
    assert VenueIn.model_validate(inside).to_venue().lens_warnings == []
    (warning,) = VenueIn.model_validate(outside).to_venue().lens_warnings
    assert "6.633 mm, and the counts of its zoom go from 7 to 20 mm: check sensor_width_mm" in warning


def ignoring(*polygons):
    return VENUE_EXAMPLE | {"cameras": [VENUE_EXAMPLE["cameras"][0] | {"ignore": list(polygons)}]}


def test_areas_of_a_frame_to_be_ignored_are_kept_with_the_camera():
    area = [[0, 1500], [3071, 1500], [3071, 1727]]
    stored = VenueIn.model_validate(ignoring(area)).to_venue()
    assert stored.cameras[0].ignore == [area]
    assert stored.to_input().cameras[0].ignore == [area]
    assert VenueIn.model_validate(VENUE_EXAMPLE).to_venue().cameras[0].ignore == []


def test_areas_that_are_not_in_the_frame_are_refused():
    with pytest.raises(ValidationError, match=r"corner \(4000, 10\) lies outside the 3072x1728 pixels of camera left"):
        VenueIn.model_validate(ignoring([[0, 0], [4000, 10], [10, 10]]))
    with pytest.raises(ValidationError, match="at least 3"):
        VenueIn.model_validate(ignoring([[0, 0], [10, 10]]))


@pytest.mark.parametrize(
    "view",
    [
        {"width_px": 1921},
        {"width_px": 300},
        {"width_px": 1920.5},
        {"height_px": "1080"},
        {"field_of_view_deg": 0},
        {"pan_deg": 181},
        {"horizon": float("nan")},
        {"projection": "mercator"},
        {"zoom": 2},
    ],
)
def test_a_view_that_no_picture_can_have_is_refused(view):
    with pytest.raises(ValidationError, match=f"view.{next(iter(view))}"):
        VenueIn.model_validate(VENUE_EXAMPLE | {"view": view})


def test_the_choice_of_a_view_is_kept_with_the_venue():
    stored = VenueIn.model_validate(VENUE_EXAMPLE | {"view": VIEW_EXAMPLE}).to_venue()
    assert stored.view.but({"pan_deg": 3}).model_dump() == VIEW_EXAMPLE | {"pan_deg": 3, "field_of_view_deg": None}
    assert stored.to_input().view == stored.view
    assert VenueIn.model_validate(VENUE_EXAMPLE).to_venue().view is None
