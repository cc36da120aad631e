"""Cameras that are proposed for a stand."""

import numpy as np
import pytest

from testbed.synthetic import PITCH
from worker.calibration.planning.line_state import STATES
from worker.calibration.planning.plan import plan
from worker.calibration.planning.stand import (
    Stand,
    field_of_view_deg,
    pan_tilt_deg,
    pinhole,
    pose_by_angles,
    propose_cameras,
)


@pytest.mark.parametrize("position", [(0.0, -49.0, 14.0), (70.0, 0.0, 18.0), (-58.0, 40.0, 16.0)])
def test_cameras_proposed_for_a_stand_see_nearly_all_of_the_field_together(position):
    cameras = propose_cameras(PITCH, Stand("mast", np.array(position), 2, (3840, 2160), 5.0))
    planned = plan(PITCH, cameras, STATES["fresh"])
    assert [camera.id for camera in cameras] == ["mast-1", "mast-2"]
    assert (planned.coverage > 0).mean() > 0.95
    assert planned.pairs[0].line_m.sum() > 20


def test_pan_tilt_and_field_of_view_are_read_as_they_were_given():
    pose = pose_by_angles(np.array([1.0, 2.0, 3.0]), -35.0, -12.0, 2.0)
    assert pan_tilt_deg(pose) == pytest.approx((-35.0, -12.0))
    (camera, *_) = propose_cameras(PITCH, Stand("mast", np.array([0.0, -49.0, 14.0]), 1, (1920, 1080), 0.0))
    assert field_of_view_deg(camera.with_lens(pinhole((1920, 1080), 64.0))) == pytest.approx(64.0)
