"""What a job tells of how far its cameras have moved from their anchors."""

from dataclasses import replace

import numpy as np
import pytest

from service.schemas.geometry import PosedCamera
from service.schemas.trend import Anchor
from testbed.synthetic import PITCH, camera
from tests.worker.calibration.gate.good_result import good
from worker.calibration.gate.displacement import measure_displacement
from worker.calibration.geometry.camera import Pose
from worker.calibration.refinement.uncertainty import Deviation
from worker.jobs.to_schemas import displacement_to_schema, lens_to_schema, pose_to_schema

CAMERA = camera("left", (0.0, -44.0, 10.0), (0.0, 10.0), focal=900.0)
ANCHOR = Anchor(
    revision=3,
    posed=PosedCamera(
        id="left", image_size=[960, 540], intrinsics=lens_to_schema(CAMERA.intrinsics), pose=pose_to_schema(CAMERA.pose)
    ),
)


def found(by=(0.0, 0.0, 0.0), **known):
    pose = Pose(CAMERA.pose.rotation, CAMERA.pose.position + by)
    return replace(good(), camera=CAMERA.with_pose(pose), **known)


def test_a_camera_is_compared_with_its_anchor():
    told = displacement_to_schema(PITCH, found(by=(0.03, 0.04, 0.0)), ANCHOR)
    assert (told.anchor, told.rotation_deg, told.position_m) == (3, 0.0, pytest.approx(0.05))
    assert np.hypot(told.across_m, told.away_m) == pytest.approx(0.05)
    assert told.sigma_across_m >= told.repeatability_across_m > 0


def test_what_is_known_of_a_displacement_is_told_of_the_direction_that_it_is_known_in():
    moved = measure_displacement(PITCH, CAMERA, found(by=(0.03, 0.04, 0.0)))
    told = displacement_to_schema(PITCH, found(by=(0.03, 0.04, 0.0)), ANCHOR)
    for name, known in {"": moved.shift, "sigma_": moved.sigma, "repeatability_": moved.repeatability}.items():
        assert (getattr(told, f"{name}across_m"), getattr(told, f"{name}away_m")) == pytest.approx(tuple(known))
        assert known[0] != pytest.approx(known[1])


def test_a_camera_without_an_anchor_is_its_own():
    told = displacement_to_schema(PITCH, found(by=(0.03, 0.04, 0.0)), None)
    assert (told.anchor, told.rotation_deg, told.position_m) == (None, 0.0, 0.0)
    assert (told.across_m, told.away_m) == pytest.approx((0.0, 0.0), abs=1e-9)
    assert told.sigma_away_m > 0


def test_the_focal_length_is_told_where_the_lines_were_asked_for_it():
    zoom = Deviation("left", "focal_length_px", -0.9, 0.45, 0.3)
    told = displacement_to_schema(PITCH, found(zoom=zoom), ANCHOR)
    assert (told.focal_length, told.sigma_focal_length) == pytest.approx((-0.001, 0.0005))
    assert told.focal_length_m > 0
    assert displacement_to_schema(PITCH, found(), ANCHOR).focal_length is None


@pytest.mark.parametrize("covariance", [None, np.diag([np.inf] * 3 + [0.1] * 3)])
def test_a_pose_that_nobody_knows_the_sigma_of_is_not_compared(covariance):
    assert displacement_to_schema(PITCH, found(covariance=covariance), ANCHOR) is None
