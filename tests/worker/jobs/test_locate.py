"""First poses of several cameras, whose points or lenses were given under each other's name."""

import numpy as np
import pytest

from fields.landmarks import UnknownLandmark
from service.schemas import geometry
from service.schemas.field import FieldOfPlay
from service.schemas.options import ClickedPoint
from tests.worker.calibration.onboarding.test_first_pose import NAMED
from worker.calibration.geometry.camera import Camera, Pose, inside
from worker.calibration.geometry.lens import Intrinsics
from worker.jobs.from_schemas import JobFailedError
from worker.jobs.locate_all import locate_all
from worker.jobs.to_schemas import pose_to_schema

pytestmark = pytest.mark.slow

FIELD = FieldOfPlay(length_m=105, width_m=68, ridge=[[-18.5, 0, 0.3], [18.5, 0, 0.3]])
LEFT = Pose.looking_at([-3.0, -50.0, 11.0], [-16.0, -6.0, 0.0], roll_deg=1.0)
RIGHT = Pose.looking_at([3.0, -50.0, 11.0], [16.0, -6.0, 0.0], roll_deg=-1.0)


def lens(focal_px, size=(1920, 1080), centre=(10, -10)):
    width, height = size
    matrix = [[focal_px, 0, width / 2 + centre[0]], [0, focal_px, height / 2 + centre[1]], [0, 0, 1]]
    return Intrinsics(np.array(matrix), np.array([-0.3, 0.09, 0, 0, 0]), size)


def clicked(lens, pose, seed):
    """All points that a camera sees, clicked carelessly."""
    camera = Camera("camera", lens, pose)
    rng = np.random.default_rng(seed)
    border = np.array(lens.size) - 1.0
    found = []
    for name, place in NAMED.items():
        (pixel,) = camera.project(place[None])
        if inside(pixel[None], lens.size)[0]:
            noisy = np.clip(pixel + rng.normal(0, 1.5, 2), 0, border)
            found.append(ClickedPoint(world=name, pixel=noisy.tolist()))
    return found


def located(lenses, points, stored=None):
    ended = locate_all(FIELD, lenses, points, {}, stored or {})
    return {name: end if isinstance(end, JobFailedError) else end.result for name, end in ended.items()}


ONE, OTHERS = lens(1250), {"another focal length": lens(1310), "twice the size": lens(2500, (3840, 2160))}


@pytest.mark.long
@pytest.mark.parametrize("other", OTHERS.values(), ids=OTHERS)
def test_points_exchanged_between_cameras_of_other_lenses_are_refused_as_such(other):
    found = located({"left": ONE, "right": other}, {"left": clicked(other, RIGHT, 1), "right": clicked(ONE, LEFT, 2)})
    for end in found.values():
        why = end.error.detail if isinstance(end, JobFailedError) else end.rejected_because
        assert "points of left fit the lens of right (" in why
        assert "the points of the two cameras are exchanged, or else their lenses" in why
        assert isinstance(end, JobFailedError) or not end.accepted


@pytest.mark.long
def test_of_three_cameras_the_two_that_were_exchanged_are_named():
    tele = lens(2600)
    points = {"left": clicked(OTHERS["another focal length"], RIGHT, 1), "right": clicked(ONE, LEFT, 2)}
    points["middle"] = clicked(tele, LEFT, 3)
    found = located({"left": ONE, "right": OTHERS["another focal length"], "middle": tele}, points)
    assert {name: end.accepted for name, end in found.items()} == {"left": False, "right": False, "middle": True}


@pytest.mark.long
def test_a_lens_that_was_measured_badly_is_no_exchange():
    found = located(
        {"left": lens(1190, centre=(90, -70)), "right": lens(1400)},
        {"left": clicked(ONE, LEFT, 1), "right": clicked(lens(1400), RIGHT, 2)},
    )
    assert all(result.accepted for result in found.values())
    assert found["left"].lens is not None


def stored():
    return {name: pose_to_schema(pose) for name, pose in (("left", LEFT), ("right", RIGHT))}


def test_points_of_a_camera_with_the_same_lens_are_told_by_the_stored_poses():
    found = located(
        {"left": ONE, "right": ONE}, {"left": clicked(ONE, RIGHT, 1), "right": clicked(ONE, LEFT, 2)}, stored()
    )
    for name, other in (("left", "right"), ("right", "left")):
        (words,) = [warning for warning in found[name].warnings if "is stored" in warning]
        assert words.startswith(f"this is where camera {other} is stored (0.")
        assert words.endswith(f"were the points clicked in a picture of {other}?")


def test_a_camera_that_stands_as_it_is_stored_or_as_none_is_warned_of_nothing():
    moved = geometry.Pose.from_position(stored()["left"].rotation, [-20.0, -55.0, 14.0])
    for known in (
        stored(),
        stored() | {"left": moved, "right": moved},
        {"right": stored()["left"]},
    ):
        (result,) = located({"left": ONE}, {"left": clicked(ONE, LEFT, 1)}, known).values()
        assert result.accepted
        assert not any("is stored" in warning for warning in result.warnings)


def test_a_label_that_does_not_exist_is_no_exchange():
    point = ClickedPoint(world="left penalty box", pixel=[5, 5])
    found = located(
        {"left": ONE, "right": ONE}, {"left": [*clicked(ONE, LEFT, 1), point], "right": clicked(ONE, LEFT, 2)}
    )
    assert found["left"].kind == "unknown-landmark"
    assert isinstance(found["left"].__cause__, UnknownLandmark)
    assert found["right"].accepted
