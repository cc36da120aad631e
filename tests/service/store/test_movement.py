"""What the service says a camera moved, against the engine."""

import math
from typing import get_args

import cv2
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Intrinsics, Pose, PosedCamera
from service.schemas.names import PANORAMAS, LensModel
from service.store import movement
from worker.calibration.gate.quality import Moved
from worker.jobs.from_schemas import camera_of, pitch_of

FIELD = FieldOfPlay(length_m=105, width_m=68)
LENSES = {
    "none": [],
    "barrel": [-0.3402, 0.1042, 0, 0, 0],
    "tangential": [-0.2, 0.05, 0.002, -0.003, 0.01],
    "rational": [0.1, -0.02, 0.001, 0.001, 0.003, 0.4, -0.03, 0.002],
    "thin prism": [-0.2, 0.05, 0.001, 0.001, 0, 0, 0, 0, 0.004, -0.002, 0.003, 0.001],
    "tilted": [-0.2, 0.05, 0.001, 0.001, 0, 0, 0, 0, 0, 0, 0, 0, 0.03, -0.02],
    "fisheye": [0.02, -0.003, 0.001, -0.0002],
    "cylindrical": [],
    "equirectangular": [],
}


def camera(lens="barrel", turned=(0, 0, 0), by=(0, 0, 0), skew=0.0) -> PosedCamera:
    rotation, position = np.array([1.675, 0.372, -0.462]) + turned, np.array([-1.48, -49.49, 7.84]) + by
    return PosedCamera(
        id="left",
        image_size=[3072, 1728],
        intrinsics=Intrinsics(
            model=lens if lens in get_args(LensModel) else "opencv",
            matrix=[[2122.4, 0.0 if lens in PANORAMAS else skew, 1634.8], [0, 2122.4, 877.7], [0, 0, 1]],
            distortion=LENSES[lens],
        ),
        pose=Pose.from_position(rotation.tolist(), position.tolist()),
    )


@pytest.mark.parametrize("skew", [0.0, 12.0])
@pytest.mark.parametrize("lens", LENSES)
def test_points_of_the_pitch_are_where_the_engine_has_them(lens, skew):
    shot = camera(lens, skew=skew)
    points = np.array([[x, y] for x in (-30.0, -10, 0) for y in (-20, 0, 30)])
    expected = camera_of(shot).project(np.column_stack([points, np.zeros(len(points))]))
    np.testing.assert_allclose(movement.pixels(shot, points), expected, atol=1e-6)


@pytest.mark.parametrize("lens", ["none", "barrel", "fisheye", "cylindrical"])
@pytest.mark.parametrize(
    ("turned", "by"), [((0.001, 0, 0), (0, 0, 0)), ((0.004, -0.006, 0.002), (0.05, 0.1, -0.02)), ((0, 0, 0), (0, 0, 0))]
)
def test_a_movement_is_what_the_engine_calls_one(lens, turned, by):
    before, after = camera(lens), camera(lens, turned, by)
    told = movement.moved(FIELD, before, after)
    expected = Moved.between(pitch_of(FIELD), camera_of(before), camera_of(after))
    assert told.rotation_deg == pytest.approx(expected.rotation_deg, abs=1e-9)
    assert told.position_m == pytest.approx(expected.position_m)
    # Other points of the same lines.
    assert told.pixels == pytest.approx(expected.pixels, rel=0.03, abs=1e-9)


def test_what_cannot_be_compared_in_pixels_is_not():
    there = camera()
    sky = camera(turned=(-1.5, 0, 0))
    assert movement.moved(FIELD, sky, there).pixels is None
    small = there.model_copy(update={"image_size": [1536, 864]})
    assert movement.moved(FIELD, small, there).pixels is None


def test_a_point_that_a_lens_formula_folds_back_into_the_picture_is_not_in_view():
    # k1 alone turns back where r is 1 / sqrt(3 * 0.34), 44 degrees from the axis.
    shot = camera().model_copy(
        update={"intrinsics": Intrinsics(matrix=camera().intrinsics.matrix, distortion=[-0.34, 0, 0, 0])}
    )
    beside, before = movement.pixels(shot, np.array([[40.0, -49.0], [-20.0, 0.0]]))
    assert np.isnan(beside).all()
    assert np.isfinite(before).all()


@given(
    st.sampled_from(["opencv", "fisheye"]),
    st.lists(st.floats(-0.4, 0.4), min_size=4, max_size=4),
    st.floats(1e-3, 1),
    st.floats(-math.pi, math.pi),
)
@example("fisheye", [0.02386051, -0.0100491, -0.00472673, -0.00176851], 1.0, 0.3)
@example("opencv", [-0.004, 0.0, 0.0, 0.0], 1.0, 0.3)
def test_no_lens_folds_what_lies_farther_aside_back_into_the_picture(model, terms, strength, bearing):
    radial = [strength * term for term in terms]
    lens = Intrinsics(
        model=model,
        matrix=[[900, 0, 960], [0, 900, 540], [0, 0, 1]],
        distortion=radial if model == "fisheye" else [*radial[:2], 0, 0, radial[2]],
    )
    # Straight down from 10 m, from right below to far behind the horizon.
    down = PosedCamera.model_construct(
        id="left", image_size=[1920, 1080], intrinsics=lens, pose=Pose.from_position([math.pi, 0, 0], [0, 0, 10])
    )
    away = 10 * np.tan(np.radians(np.arange(0.05, 89.99, 0.05)))
    places = movement.pixels(down, np.outer(away, [math.cos(bearing), math.sin(bearing)])) - [960, 540]
    aside = (places * [math.cos(bearing), -math.sin(bearing)]).sum(axis=1)
    seen = np.isfinite(aside)
    assert (np.diff(aside[seen], prepend=0) > 0).all()
    assert not seen[np.argmin(seen) :].any() or seen.all()


@pytest.mark.parametrize("lens", ["none", "barrel"])
def test_masks_follow_a_turned_camera_on_the_ground_and_far_away(lens):
    before, after = camera(lens), camera(lens, turned=(0.004, -0.006, 0.002), by=(0.05, 0.1, -0.02))
    motion = picture_motion(before, after)
    ground = np.array([[-30.0, 0.0], [-10.0, -20.0], [0.0, 30.0]])
    was, now = movement.pixels(before, ground), movement.pixels(after, ground)
    np.testing.assert_allclose(mapped(motion["ground"], was), now, atol=motion["ground_residual_px"])
    assert motion["ground_residual_px"] < {"none": 1e-3, "barrel": 4.0}[lens]
    assert np.linalg.norm(now - was, axis=1).min() > 5
    # Towards places 10 km away nothing but the turn counts.
    far = np.array([[2000.0, 10_000.0], [-3000.0, 10_000.0]])
    was, now = movement.pixels(before, far), movement.pixels(after, far)
    np.testing.assert_allclose(mapped(motion["far"], was), now, atol=motion["far_residual_px"] + 0.1)


def test_a_camera_that_stands_still_has_a_picture_that_stands_still():
    motion = picture_motion(camera(), camera())
    for name in ("ground", "far"):
        np.testing.assert_allclose(motion[name], np.eye(3), atol=1e-6)


@pytest.mark.parametrize("lens", ["none", "barrel", "fisheye"])
def test_a_camera_that_turned_away_shows_nothing_of_its_old_picture(lens):
    away = camera(lens)
    turned = cv2.Rodrigues(np.array([0, np.pi, 0]))[0] @ cv2.Rodrigues(np.array(away.pose.rotation))[0]
    pose = Pose.from_position(cv2.Rodrigues(turned)[0].ravel().tolist(), away.pose.position)
    motion = picture_motion(away, away.model_copy(update={"pose": pose}))
    assert set(motion.values()) == {None}


def test_a_picture_that_shows_a_strip_of_the_old_one_has_its_motion():
    before, after = camera("none"), camera("none", turned=(0, -1.0, 0))
    motion = picture_motion(before, after)
    assert motion["far"] is not None
    assert motion["far_residual_px"] < 1e-3


def test_a_camera_that_looks_at_the_sky_has_no_ground():
    up = camera("none", turned=(-0.9, 0, 0))
    assert picture_motion(up, up)["ground"] is None


def picture_motion(before, after):
    """Homographies and residuals from one state of a camera to another."""
    return movement.picture_motion(FIELD, (1, before), (2, after)).model_dump(
        exclude={"since", "revision", "image_size"}
    )


def mapped(homography, places):
    x, y, w = np.array(homography) @ np.column_stack([places, np.ones(len(places))]).T
    return np.column_stack([x / w, y / w])
