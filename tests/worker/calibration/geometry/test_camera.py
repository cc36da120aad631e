"""Cameras: distortion and projection, against OpenCV and against themselves."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from worker.calibration.geometry.camera import Camera, Pose, inside, project, project_planes
from worker.calibration.geometry.lens import DISTORTION_LENGTHS, Fisheye, Intrinsics


def lens(distortion=(), size=(3000, 1800)):
    return Intrinsics(np.array([[2000.0, 0, 1500], [0, 2010, 900], [0, 0, 1]]), np.array(distortion, dtype=float), size)


@pytest.mark.parametrize("length", DISTORTION_LENGTHS)
def test_projection_is_opencvs_for_every_length_of_the_distortion(length):
    rng = np.random.default_rng(length)
    distortion = np.array([-0.34, 0.1, 0.001, -0.002, 0.01, 0.02, 0.01, 0.001, 2e-3, 1e-3, -1e-3, 2e-3, 0.02, -0.01])
    camera = Camera("a", lens(distortion[:length]), Pose.looking_at([0, -50, 10], [3, 0, 0], roll_deg=2))
    points = rng.uniform([-25, -30, 0], [25, 34, 1], size=(200, 3))
    theirs, _ = cv2.projectPoints(
        points, camera.pose.rotation, camera.pose.translation, camera.intrinsics.matrix, distortion[:length]
    )
    ours = camera.project(points)
    assert np.isfinite(ours).all()
    np.testing.assert_allclose(ours, theirs[:, 0], atol=1e-8)


@given(
    st.tuples(st.floats(-0.4, 0.1), st.floats(0, 0.15), st.floats(-2e-3, 2e-3), st.floats(-2e-3, 2e-3)),
    st.floats(5, 40),
    st.floats(-40, 40),
)
def test_the_ray_through_a_projected_point_meets_the_point_again(distortion, height, aside):
    camera = Camera("a", lens(distortion), Pose.looking_at([aside, -60, height], [0, 0, 0]))
    points = np.random.default_rng(0).uniform([-52, -34, 0], [52, 34, 0], size=(50, 3))
    pixels = camera.project(points)
    directions = (points - camera.pose.position) @ camera.pose.matrix.T
    radius = np.linalg.norm(directions[:, :2], axis=1) / directions[:, 2]
    # At the very end of a lens model all rays end in one pixel and none can be told from its neighbour.
    seen = inside(pixels, camera.intrinsics.size) & (radius < 0.97 * camera.intrinsics.largest_radius)
    rays = camera.rays(pixels[seen])
    met = camera.pose.position + rays * (-camera.pose.position[2] / rays[:, 2:])
    np.testing.assert_allclose(met, points[seen], atol=1e-6)


def test_a_point_where_the_lens_model_folds_back_has_no_pixel():
    # r (1 - 0.4 r²) grows up to r = 0.91 and would put a point at r = 1.5 back into the picture.
    intrinsics = lens([-0.4, 0.0, 0.0, 0.0])
    assert intrinsics.largest_radius == pytest.approx(1 / np.sqrt(1.2), abs=2e-3)
    assert np.isfinite(intrinsics.distort(np.array([0.9, 0.0]))).all()
    assert np.isnan(intrinsics.distort(np.array([1.5, 0.0]))).all()


def test_a_population_is_projected_as_its_members_are():
    rng = np.random.default_rng(2)
    pose = Pose.looking_at([0, -50, 10], [3, 0, 0])
    rotations = pose.rotation + 0.01 * rng.normal(size=(5, 3))
    positions = pose.position + 0.1 * rng.normal(size=(5, 3))
    points = rng.uniform([-25, -30, 0], [25, 34, 1], size=(20, 3))
    together = project(points, rotations, positions, lens([-0.3, 0.1, 0, 0]))
    for pixels, rotation, position in zip(together, rotations, positions, strict=True):
        alone = Camera("a", lens([-0.3, 0.1, 0, 0]), Pose(rotation, position)).project(points)
        np.testing.assert_array_equal(pixels, alone)


def test_a_pose_read_from_opencvs_translation_stands_where_it_should():
    pose = Pose.looking_at([4, -50, 10], [3, 0, 0])
    np.testing.assert_allclose(Pose.from_translation(pose.rotation, pose.translation).position, [4, -50, 10])


def test_a_camera_sees_its_target_in_the_principal_point():
    camera = Camera("a", lens(), Pose.looking_at([4, -50, 10], [3, 0, 0], roll_deg=3))
    np.testing.assert_allclose(camera.project(np.array([[3.0, 0.0, 0.0]]))[0], [1500, 900])


def test_a_smaller_copy_of_a_picture_keeps_every_point_in_its_place():
    full = lens([-0.3, 0.1, 0, 0])
    half = full.scaled(0.5)
    rays = np.array([[0.1, -0.2], [0.4, 0.3]])
    np.testing.assert_allclose((full.distort(rays) + 0.5) / 2 - 0.5, half.distort(rays))


def test_a_smaller_copy_of_a_picture_has_a_lens_that_is_known_as_well():
    known = {"fx": 4.0, "cy": 2.0, "aspect": 1e-3, "k1": 0.01}
    assert replace(lens(), sigma=known).scaled(0.5).sigma == known | {"fx": 2.0, "cy": 1.0}


@pytest.mark.parametrize(
    "intrinsics",
    [
        lens([-0.34, 0.1, 0.001, -0.002, 0.01]),
        Fisheye(lens().matrix, np.array([-0.02, 0.004, -0.002, 3e-4]), lens().size),
    ],
    ids=["pinhole", "fisheye"],
)
def test_single_precision_is_good_for_a_hundredth_of_a_pixel(intrinsics):
    camera = Camera("a", intrinsics, Pose.looking_at([-1.0, -48.0, 9.0], [-20.0, 0, 0]))
    points = np.random.default_rng(0).uniform([-52, -34, 0], [52, 34, 0.4], (3000, 3))
    rotations, positions = camera.pose.rotation[None], camera.pose.position[None]
    planes = project_planes(points.T.astype(np.float32), rotations, positions, camera.intrinsics)
    assert {plane.dtype for plane in planes} == {np.dtype(np.float32)}
    exact = camera.project(points)
    seen = inside(exact, camera.intrinsics.size)
    assert seen.sum() > 300
    np.testing.assert_allclose(np.stack(planes, axis=-1)[0][seen], exact[seen], atol=0.01)
