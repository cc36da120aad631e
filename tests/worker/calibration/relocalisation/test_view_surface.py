"""Surfaces on which the lines of a frame are laid out: a plane, and those of panoramas."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from testbed.synthetic import PITCH, camera, paint_frame
from tests.worker.calibration.outdated_pair import white_on_green
from worker.calibration.detection.segmentation import Region
from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.panorama import Cylindrical, Equirectangular
from worker.calibration.relocalisation.agreement import agreement
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.hypotheses import Hypotheses
from worker.calibration.relocalisation.line_view import LineView
from worker.calibration.relocalisation.sought import MOUNTED_ROLL_DEG, panorama_of_view
from worker.calibration.relocalisation.view_surface import surface_of

SIZE = (1280, 400)
LENSES = {
    "plane": camera("one", (-6.0, -52.0, 16.0), (-10.0, 0.0), distortion=(-0.18, 0.03, 0.0, 0.0)).intrinsics,
    "cylinder": panorama_of_view(SIZE, Cylindrical, 180.0),
    "sphere": panorama_of_view(SIZE, Equirectangular, 200.0),
}
FOCAL_PX = np.array(150.0)
surfaces = pytest.mark.parametrize("surface", [surface_of(lens) for lens in LENSES.values()], ids=LENSES)
points_ahead = st.tuples(st.floats(-20, 20), st.floats(-5, 10), st.floats(5, 60)).map(np.array)
directions = st.tuples(*3 * [st.floats(-1, 1)]).map(np.array)
HARDLY = 1e-6


def place_of(surface, point):
    places, ahead = surface.project(tuple(point), FOCAL_PX)
    assert ahead
    return np.array(places)


@surfaces
@given(point=points_ahead)
def test_a_point_lies_on_the_ray_of_its_place(surface, point):
    ray = np.array(surface.rays(tuple(place_of(surface, point)), FOCAL_PX))
    assert np.cross(ray, point) == pytest.approx(np.zeros(3), abs=1e-6 * np.linalg.norm(point))
    assert ray @ point > 0


@surfaces
@given(point=points_ahead, by=directions)
def test_a_place_moves_with_its_point(surface, point, by):
    ray = np.array(surface.rays(tuple(place_of(surface, point)), FOCAL_PX))
    moved = place_of(surface, ray + HARDLY * by) - place_of(surface, ray - HARDLY * by)
    assert FOCAL_PX * np.array(surface.moves(tuple(ray), tuple(by))) == pytest.approx(moved / (2 * HARDLY), abs=1e-3)


@surfaces
@given(point=points_ahead, across=st.floats(0, np.pi))
def test_what_pulls_a_place_across_a_line_is_the_derivative_of_the_projection(surface, point, across):
    normal = np.array([np.cos(across), np.sin(across)])
    numeric = [
        (place_of(surface, point + step) - place_of(surface, point - step)) @ normal / (2 * HARDLY)
        for step in HARDLY * np.eye(3)
    ]
    assert surface.pulls(point[None], normal[None], FOCAL_PX[None])[0] == pytest.approx(numeric, abs=1e-3)


@surfaces
@given(start=points_ahead, end=points_ahead)
def test_the_plane_of_a_segment_holds_both_of_its_ends(surface, start, end):
    segment = [place_of(surface, point)[None] for point in (start, end)]
    assume(np.linalg.norm(segment[1] - segment[0]) > 1)
    normal = surface.normals(*segment, FOCAL_PX[None])[0, 0]
    for point in (start, end):
        assert abs(normal @ point) <= 1e-6 * np.linalg.norm(normal) * np.linalg.norm(point)


@pytest.mark.parametrize("name", LENSES)
def test_pixels_are_laid_out_where_their_points_are_projected(name):
    lens = LENSES[name]
    point = np.array([3.0, 4.0, 30.0])
    laid_out = surface_of(lens).lay_out(lens.project(point)[None])[0]
    assert laid_out == pytest.approx(place_of(surface_of(lens), point) / FOCAL_PX, abs=1e-6)


@pytest.mark.parametrize("model", [Cylindrical, Equirectangular])
def test_the_true_pose_of_a_panorama_agrees_with_its_lines(model):
    """Half a turn on a plane is mostly gaps between the pixels of its ends: there it agrees by 0.55."""
    position = np.array([-12.0, -42.0, 9.0])
    pose = Pose.looking_at(position, position + [0.02, 1.0, -0.2], roll_deg=0.7)
    lens = panorama_of_view(SIZE, model, 180.0)
    stretched = replace(lens, matrix=lens.matrix * [[1, 1, 1], [1, 1.1, 1], [1, 1, 1]])
    frame = paint_frame(PITCH, Camera("pan", stretched, pose))
    sure_of_thin_lines = np.minimum(4.0 * white_on_green(frame, [Region(0, 0, *SIZE)]), 255).astype(np.uint8)
    view = LineView.of(sure_of_thin_lines, stretched, MOUNTED_ROLL_DEG)
    truth = Hypotheses.unbent(pose.matrix[None], position[None], np.array([view.focal_px]))
    assert agreement(FieldMap.of(PITCH), view, truth, 2.0)[0] > 0.65
