"""A pose in another convention is named as what it is when it is put."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from service.intake.pose_warnings import warnings_of
from service.schemas.geometry import Pose
from service.schemas.venue import VenueIn

DEMO = VenueIn.model_validate_json((Path(__file__).parents[3] / "demo" / "venue.json").read_bytes())


def warned(change):
    """Warnings about the demo's left camera, with the parts that `change` makes of its true pose."""
    document = DEMO.model_dump(mode="json", exclude_none=True)
    camera = document["cameras"][0]
    camera |= change(Pose.from_input(DEMO.cameras[0].pose))
    sent = VenueIn.model_validate(document)
    return warnings_of([one.pose for one in sent.cameras], sent.to_venue())


def test_nothing_is_said_of_poses_that_look_at_the_field():
    assert warnings_of([camera.pose for camera in DEMO.cameras], DEMO.to_venue()) == []


def camera_to_world(pose):
    """Pose in the convention of Blender and COLMAP's viewers: the camera's axes and its place in the world."""
    return {"pose": {"rotation": [-c for c in pose.rotation], "translation": pose.position}}


CONVENTIONS = {
    "the inverse": (
        camera_to_world,
        "rotation goes from camera to world: send the inverse, world to camera (the negative of the vector), and what "
        "is sent as translation as position",
    ),
    "the rotation inverted": (
        lambda pose: {"pose": {"rotation": [-c for c in pose.rotation], "position": pose.position}},
        "if its rotation goes from camera to world: send the inverse, world to camera (the negative of the vector)",
    ),
    "tvec as position": (
        lambda pose: {"pose": {"rotation": pose.rotation, "position": pose.translation}},
        "its position is OpenCV's tvec: send it as translation",
    ),
    "centimetres": (
        lambda pose: {"pose": {"rotation": pose.rotation, "position": [40 * c for c in pose.position]}},
        "its place is in centimetres: send metres",
    ),
    "feet": (
        lambda pose: {"pose": {"rotation": pose.rotation, "position": [c / 0.3048 for c in pose.position]}},
        "124 m from the field; if its place is in feet: send metres",
    ),
}


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_the_convention_that_explains_a_pose_is_named(convention):
    change, named = CONVENTIONS[convention]
    (warning,) = warned(change)
    assert warning.startswith("camera left: ")
    assert named in warning


def test_a_pose_that_no_convention_explains_is_told_as_well():
    (warning,) = warned(lambda pose: {"pose": {"rotation": [0.1, 0.05, 0.0], "position": pose.position}})
    assert "sees 0 m of markings, and so it does however it is read" in warning


def test_a_mount_that_hangs_upside_down_and_sees_the_field_is_not_doubted():
    turned = cv2.Rodrigues(np.diag([-1.0, -1.0, 1.0]) @ cv2.Rodrigues(np.array(DEMO.cameras[0].pose.rotation))[0])[0]
    assert warned(lambda pose: {"pose": {"rotation": turned.ravel().tolist(), "position": pose.position}}) == []


def test_a_picture_whose_sides_are_exchanged_is_named():
    (warning,) = warned(lambda _: {"image_size": DEMO.cameras[0].image_size[::-1]})
    assert "is image_size exchanged?" in warning


def drawn_venues(count):
    """A camera each, beside a football field, on any side of it, that looks at some place of its inner half."""
    rng = np.random.default_rng(3)
    for _ in range(count):
        side, end = rng.choice([-1, 1], 2)
        beside, behind = [rng.uniform(-45, 45), side * rng.uniform(40, 75)], [end * rng.uniform(60, 90), 0.0]
        place = np.array([*(beside if rng.random() < 0.7 else behind), rng.uniform(5, 25)])
        forward = np.array([rng.uniform(-35, 35), rng.uniform(-20, 20), 0.0]) - place
        right = np.cross(forward, [0, 0, 1])
        axes = np.array([one / np.linalg.norm(one) for one in (right, np.cross(forward, right), forward)])
        yield cv2.Rodrigues(axes)[0].ravel().tolist(), place, rng.uniform(1200, 4000)


def said_of(rotation, place, focal):
    intrinsics = {"matrix": [[focal, 0, 1920], [0, focal, 1080], [0, 0, 1]], "distortion": []}
    camera = {
        "id": "one",
        "image_size": [3840, 2160],
        "intrinsics": intrinsics,
        "pose": {"rotation": rotation, "position": place.tolist()},
    }
    document = {"id": "drawn", "field": {"length_m": 105, "width_m": 68}, "cameras": [camera]}
    sent = VenueIn.model_validate(document)
    return warnings_of([one.pose for one in sent.cameras], sent.to_venue())


def test_cameras_that_stand_where_cameras_do_are_never_doubted():
    assert [said_of(*drawn) for drawn in drawn_venues(60)] == [[]] * 60


def test_places_in_feet_are_named_but_for_cameras_so_near_that_they_might_be_metres():
    said = [said_of(rotation, place / 0.3048, focal) for rotation, place, focal in drawn_venues(60)]
    assert sum(any("is in feet: send metres" in line for line in lines) for lines in said) >= 57
    assert all("feet" in line for lines in said for line in lines)


@pytest.mark.parametrize("corner", [(-52.5, -34), (52.5, -34), (-52.5, 34), (52.5, 34)])
def test_a_place_counted_from_a_corner_is_named_where_the_camera_would_hang_over_the_field(corner):
    said = [said_of(rotation, place - [*corner, 0.0], focal) for rotation, place, focal in drawn_venues(60)]
    named = ["counted from a corner of the field: count it from the centre" in line for lines in said for line in lines]
    assert named.count(True) >= 6
    # Now and then, another reading explains the same place.
    assert named.count(False) <= named.count(True) / 3
