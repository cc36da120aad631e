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
from worker.calibration.geometry.camera import Camera, Pose, inside, project, project_planes
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


@given(terms, off_axis, st.floats(-np.pi, np.pi))
def test_the_ray_of_a_rays_pixel_is_that_ray(distortion, angle, turn):
    ours = lens(distortion)
    ray = np.tan(angle) * np.array([np.cos(turn), np.sin(turn)])
    np.testing.assert_allclose(ours.undistort(ours.distort(ray)), ray, atol=1e-7 * (1 + ray @ ray))


def test_a_population_is_projected_as_its_members_are_and_as_opencv_projects_them():
    dome, rng = camera(), np.random.default_rng(2)
    rotations = dome.pose.rotation + 0.02 * rng.normal(size=(6, 3))
    positions = dome.pose.position + 0.2 * rng.normal(size=(6, 3))
    points = rng.uniform([-30, -20, 0], [30, 34, 1], size=(40, 3))
    together = project(points, rotations, positions, dome.intrinsics)
    for pixels, rotation, position in zip(together, rotations, positions, strict=True):
        pose = Pose(rotation, position)
        theirs, _ = cv2.fisheye.projectPoints(
            points[:, None], rotation, pose.translation, dome.intrinsics.matrix, dome.intrinsics.distortion
        )
        np.testing.assert_allclose(pixels, theirs[:, 0], atol=1e-8)


def test_single_precision_is_good_for_a_hundredth_of_a_pixel():
    dome = camera()
    points = np.random.default_rng(0).uniform([-52, -34, 0], [52, 34, 0.4], (3000, 3))
    planes = project_planes(
        points.T.astype(np.float32), dome.pose.rotation[None], dome.pose.position[None], dome.intrinsics
    )
    assert {plane.dtype for plane in planes} == {np.dtype(np.float32)}
    exact = dome.project(points)
    seen = inside(exact, SIZE)
    assert seen.sum() > 1000
    np.testing.assert_allclose(np.stack(planes, axis=-1)[0][seen], exact[seen], atol=0.01)


def test_what_is_beside_or_behind_the_camera_has_no_pixel():
    wide = lens(focal=300.0)
    almost = np.tan(WIDEST_FISHEYE_RAD - 1e-4)
    assert np.isfinite(wide.distort(np.array([almost, 0.0]))).all()
    assert np.isnan(wide.distort(np.array([1.1 * np.tan(WIDEST_FISHEYE_RAD), 0.0]))).all()
    assert np.isnan(camera().project(np.array([[0.0, -80.0, 0.0]]))).all()


def test_where_the_model_folds_back_there_is_no_pixel_and_no_ray():
    # t (1 - 0.2 t²) grows up to t = 1.29.
    folding = lens([-0.2, 0.0, 0.0, 0.0])
    assert np.arctan(folding.largest_radius) == pytest.approx(1 / np.sqrt(0.6), abs=1e-3)
    assert np.isnan(folding.distort(np.array([np.tan(1.35), 0.0]))).all()
    beyond = folding.matrix[0, 2] + folding.matrix[0, 0] * 0.9
    assert np.isnan(folding.undistort([beyond, 545.0])).all()


def test_a_smaller_copy_of_a_picture_keeps_every_point_in_its_place_and_its_lens():
    half = lens([0.02, 0, 0, 0]).scaled(0.5)
    assert isinstance(half, Fisheye)
    rays = np.array([[0.1, -0.2], [2.0, 0.3]])
    np.testing.assert_allclose((lens([0.02, 0, 0, 0]).distort(rays) + 0.5) / 2 - 0.5, half.distort(rays))


def test_it_sees_the_lines_that_a_pinhole_of_the_same_focal_length_cannot():
    seen = VisibleLines.from_camera(PITCH.line_points(), camera())
    assert np.isfinite(seen.width_px).all()
    assert len(seen) > 0.95 * len(PITCH.line_points())
    # The directions across lines are those that small steps on the ground have in the picture.
    step = camera().project(seen.points.position + 0.01 * seen.points.normal) - seen.pixel
    np.testing.assert_allclose(np.sum(step * seen.normal, axis=1) / 0.01, seen.px_per_metre, rtol=0.05, atol=0.05)


def test_the_network_looks_where_its_lines_are():
    regions = reachable_regions(PITCH, camera(), 60.0)
    pixels = camera().project(PITCH.line_points().position)
    pixels = pixels[inside(pixels, SIZE)]
    covered = np.zeros(len(pixels), bool)
    for region in regions:
        covered |= (
            (pixels[:, 0] >= region.left)
            & (pixels[:, 0] < region.right)
            & (pixels[:, 1] >= region.top)
            & (pixels[:, 1] < region.bottom)
        )
    assert covered.all()


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
        assert np.linalg.norm(camera.pose.position - truth.pose.position) < min(0.1, 2 * result.sigma.position_m)
        off_deg = rotation_angles_deg(camera.pose.rotation, truth.pose.rotation)
        assert off_deg < min(0.25, 2 * result.sigma.rotation_deg)
    assert found.stitch_error_px < 0.3 < found.stitch_error_before_px

    first = {name: several[0] for name, several in frames.items()}
    above = birdseye(CROWNED, after, first)
    halfway = above[:, above.shape[1] // 2 - 2 : above.shape[1] // 2 + 3].max(axis=1)
    assert np.median(halfway[above.shape[0] // 8 : -above.shape[0] // 8].min(axis=1)) > 150
    assert stitched(CROWNED, chosen_view(CROWNED, after, ViewChoice(width=960)), after, first).picture.std() > 20
    assert overlay((CROWNED, outdated[0]), (CROWNED, after[0]), first["left"]).shape == first["left"].shape
