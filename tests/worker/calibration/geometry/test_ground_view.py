"""What a camera shows at places of the ground is what its picture has there."""

from __future__ import annotations

import numpy as np
import pytest

from testbed.synthetic import CROWNED, PITCH, pair
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.ground_view import ground_grid, ground_view
from worker.calibration.geometry.lens import Intrinsics

CAMERAS = pair()


def test_the_far_side_is_at_the_top_of_a_grid_on_the_ground() -> None:
    grid = ground_grid(3, 2, 0.5, centre=(1.0, 2.0))
    assert grid.shape == (5, 7, 2)
    assert grid[0, 0] == pytest.approx([-0.5, 3.0])
    assert grid[-1, -1] == pytest.approx([2.5, 1.0])


def test_a_ground_view_samples_the_image_where_the_camera_sees_the_point() -> None:
    one = CAMERAS[0]
    x, y = np.meshgrid(np.arange(960.0), np.arange(540.0))
    ramp = np.stack([x, y], axis=-1).astype(np.float32)
    grid = ground_grid(40, 40, 0.05, centre=(-10.0, 0.0))
    values, valid = ground_view(CROWNED, one, ramp, grid)
    assert valid.all()
    expected = one.project(CROWNED.lift(grid).reshape(-1, 3)).reshape(values.shape)
    # OpenCV interpolates pictures of several channels at steps of 1/32 px.
    assert np.abs(values - expected).max() < 0.02


def test_a_ground_view_is_blind_where_the_camera_or_its_lens_model_is() -> None:
    bent = Camera(
        "bent",
        Intrinsics(CAMERAS[0].intrinsics.matrix, np.array([-0.9, 0.2, 0.0, 0.0]), CAMERAS[0].intrinsics.size),
        CAMERAS[0].pose,
    )
    assert bent.intrinsics.largest_radius < 2
    values, valid = ground_view(PITCH, bent, np.ones((540, 960), np.float32), ground_grid(60, 40, 1.0))
    assert not valid.all()
    assert valid.any()
    assert np.isfinite(values).all()
    assert values[valid] == pytest.approx(1.0)
