"""The fisheye model, against OpenCV's fisheye module and against itself, through all that the engine does with it."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from testbed.synthetic import CROWNED, PITCH, moved, paint_frame
from tests.worker.calibration.outdated_pair import white_on_green
from worker.calibration.calibrate import calibrate
from worker.calibration.detection.segmentation import reachable_regions
from worker.calibration.geometry.camera import Camera, Pose, inside
from worker.calibration.geometry.lens import FISHEYE_DISTORTION_LENGTHS, WIDEST_FISHEYE_RAD, Fisheye
from worker.calibration.geometry.rotation import rotation_angles_deg
from worker.calibration.geometry.visibility import VisibleLines
from worker.calibration.records import Options
from worker.calibration.rendering.overlays import overlay
from worker.calibration.rendering.stitched_pictures import birdseye, stitched
from worker.calibration.stitching.views import ViewChoice, chosen_view

pytestmark = pytest.mark.slow

SIZE = (1920, 1080)
# Of wide action and dome cameras, and a lens of the opposite sign.
terms = st.tuples(st.floats(-0.05, 0.05), st.floats(-0.02, 0.02), st.floats(-5e-3, 5e-3), st.floats(-1e-3, 1e-3))
off_axis = st.floats(0.0, 80.0).map(np.radians)


def lens(distortion=(), focal=620.0, skew=0.0):
    return Fisheye(np.array([[focal, skew, 955], [0, 1.01 * focal, 545], [0, 0, 1]]), np.array(distortion), SIZE)


def camera(distortion=(-0.02, 0.004, -0.002, 3e-4), target=(0.0, 0.0, 0.0)):
    return Camera("dome", lens(distortion), Pose.looking_at([2.0, -40.0, 9.0], target, roll_deg=1.5))


@given(terms, off_axis, st.floats(-np.pi, np.pi), st.sampled_from(FISHEYE_DISTORTION_LENGTHS), st.floats(-2.0, 2.0))
def test_a_ray_ends_where_opencvs_fisheye_puts_it(distortion, angle, turn, length, skew):
    ray = np.tan(angle) * np.array([np.cos(turn), np.sin(turn)])
    ours = lens(distortion[:length], skew=skew)
    padded = np.array([*distortion[:length], *[0.0] * (4 - length)])
    theirs, _ = cv2.fisheye.projectPoints(
        np.array([[[*ray, 1.0]]]), np.zeros(3), np.zeros(3), ours.matrix, padded, alpha=skew / ours.matrix[0, 0]
    )
    np.testing.assert_allclose(ours.distort(ray), theirs[0, 0], atol=1e-8)


def test_what_is_beside_the_camera_has_no_pixel():
    wide = lens(focal=300.0)
    assert np.isfinite(wide.distort(np.array([np.tan(WIDEST_FISHEYE_RAD - 1e-4), 0.0]))).all()
    assert np.isnan(wide.distort(np.array([1.1 * np.tan(WIDEST_FISHEYE_RAD), 0.0]))).all()


def test_it_sees_the_lines_that_a_pinhole_of_the_same_focal_length_cannot():
    seen = VisibleLines.from_camera(PITCH.line_points(), camera())
    assert np.isfinite(seen.width_px).all()
    assert len(seen) > 0.95 * len(PITCH.line_points())
    # The directions across lines are those that small steps on the ground have in the picture.
    step = camera().project(seen.points.position + 0.01 * seen.points.normal) - seen.pixel
    np.testing.assert_allclose(np.sum(step * seen.normal, axis=1) / 0.01, seen.px_per_metre, rtol=0.05, atol=0.05)


def test_the_network_looks_where_its_lines_are():
    pixels = camera().project(PITCH.line_points().position)
    x, y = pixels[inside(pixels, SIZE)].T
    regions = reachable_regions(PITCH, camera(), 60.0)
    assert np.any([(x >= r.left) & (x < r.right) & (y >= r.top) & (y < r.bottom) for r in regions], axis=0).all()


def pair():
    """Two fisheyes above the near touchline, each with most of the pitch in view."""
    matrix = np.array([[330.0, 0, 479.5], [0, 330.0, 269.5], [0, 0, 1]])
    glass = Fisheye(matrix, np.array([-0.015, 0.003, -0.001, 0.0]), (960, 540))
    return [
        Camera(name, glass, Pose.looking_at([side * 1.0, -44.0, 11.0], [side * 16.0, -8.0, 0.0]))
        for name, side in (("left", -1), ("right", 1))
    ]


@pytest.mark.long
def test_outdated_poses_of_fisheyes_are_found_again_and_drawn():
    cameras = pair()
    frames = {camera.id: (paint_frame(CROWNED, camera),) for camera in cameras}
    outdated = [moved(camera, (0.008, -0.006, 0.005), (0.08, -0.06, 0.05)) for camera in cameras]
    found = calibrate(CROWNED, outdated, frames, white_on_green, Options(seed=1))
    assert found.rejected_because is None
    after = [result.camera for result in found.cameras]
    for truth, camera, result in zip(cameras, after, found.cameras, strict=True):
        assert camera.distance_m(truth) < min(0.1, 2 * result.sigma.position_m)
        off_deg = rotation_angles_deg(camera.pose.rotation, truth.pose.rotation)
        assert off_deg < min(0.25, 2 * result.sigma.rotation_deg)
    assert found.stitch_error_px < 0.3 < found.stitch_error_before_px

    first = {name: several[0] for name, several in frames.items()}
    above = birdseye(CROWNED, after, first)
    halfway = above[:, above.shape[1] // 2 - 2 : above.shape[1] // 2 + 3].max(axis=1)
    assert np.median(halfway[above.shape[0] // 8 : -above.shape[0] // 8].min(axis=1)) > 150
    assert stitched(CROWNED, chosen_view(CROWNED, after, ViewChoice(width=960)), after, first).picture.std() > 20
    assert overlay((CROWNED, outdated[0]), (CROWNED, after[0]), first["left"]).shape == first["left"].shape
