"""Stitched panoramas through all that the engine does with a camera."""

from dataclasses import replace

import numpy as np
import pytest

from testbed.synthetic import CROWNED, PITCH, moved, paint_frame
from tests.worker.calibration.outdated_pair import white_on_green
from worker.calibration.calibrate import calibrate
from worker.calibration.detection.contrast import Channels
from worker.calibration.detection.frame_fusion import Sway
from worker.calibration.find_cameras import find_cameras
from worker.calibration.geometry import derivatives
from worker.calibration.geometry.camera import Camera, Pose
from worker.calibration.geometry.panorama import Cylindrical, Equirectangular
from worker.calibration.geometry.visibility import VisibleLines
from worker.calibration.records import Options
from worker.calibration.relocalisation.sought import SoughtCamera, SoughtLens, panorama_of_view
from worker.calibration.rendering.overlays import overlay
from worker.calibration.rendering.st_maps import NOWHERE, distorting, undistorting
from worker.calibration.rendering.stitched_pictures import stitched
from worker.calibration.stitching.views import ViewChoice, chosen_view
from worker.calibration.tracking.follower import CameraTracker

pytestmark = pytest.mark.slow

SIZE = (1280, 400)


def panorama(name="pan", model=Cylindrical, x=0.5, tilt_deg=12.0, view_deg=180.0):
    """A panorama from a mast beside the halfway line that is tilted down."""
    position = np.array([x, -42.0, 9.0])
    ahead = position + [0.02, 1.0, -np.tan(np.radians(tilt_deg))]
    return Camera(name, panorama_of_view(SIZE, model, view_deg), Pose.looking_at(position, ahead, roll_deg=0.7))


def test_a_panorama_sees_all_lines_of_the_field_but_those_below_its_picture():
    seen = VisibleLines.from_camera(PITCH.line_points(), panorama())
    assert np.isfinite(seen.normal).all()
    assert len(seen) > 0.8 * len(PITCH.line_points())


def test_st_maps_hold_what_a_pinhole_can_of_a_panorama():
    lens = panorama_of_view((192, 60), Cylindrical, 200.0)
    there, back = undistorting(lens), distorting(lens)
    # Column 180 of the frame looks backwards.
    assert (back[30, 189] == NOWHERE).all()
    assert back[30, 96] == pytest.approx((np.array([96, 30]) + 0.5) / [192, 60], abs=1e-3)
    column, row = there[45, 150] * [192, 60] - 0.5
    again = lens.undistort(np.array([column, row])) * lens.focal_length_px + lens.matrix[:2, 2]
    assert again == pytest.approx([150, 45], abs=1e-3)


@pytest.mark.parametrize("model", [Cylindrical, pytest.param(Equirectangular, marks=pytest.mark.long)])
def test_the_outdated_pose_of_a_panorama_is_found_again_and_drawn(model):
    truth = panorama(model=model)
    frame = paint_frame(CROWNED, truth)
    outdated = moved(truth, (0.008, -0.006, 0.005), (0.08, -0.06, 0.05))
    found = calibrate(CROWNED, [outdated], {"pan": [frame]}, white_on_green, Options(seed=1))
    assert found.rejected_because is None
    (result,) = found.cameras
    assert result.camera.distance_m(truth) < min(0.1, 3 * result.sigma.position_m)
    # Stitchers' numbers are taken for little: the lines know them better.
    refined = result.refined.camera.intrinsics
    assert refined.focal_length_px == pytest.approx(truth.intrinsics.focal_length_px, rel=2e-3)
    assert len(refined.distortion) == 0
    view = chosen_view(CROWNED, [result.camera], ViewChoice(width=960))
    assert stitched(CROWNED, view, [result.camera], {"pan": frame}).picture.std() > 20
    assert overlay((CROWNED, outdated), (CROWNED, result.camera), frame).shape == frame.shape


def sure_of_thin_lines(frame, regions):
    """As a network is, which answers for a line and not for the paint in a pixel."""
    return (255 * np.minimum(4 * (white_on_green(frame, regions) / 255), 1)).astype(np.uint8)


@pytest.mark.long
def test_a_panorama_of_unknown_lens_is_found_from_nothing():
    truth = panorama(view_deg=176.0)
    stretched = truth.intrinsics.matrix * [[1, 1, 1], [1, 1.02, 1], [1, 1, 1]]
    truth = truth.with_lens(replace(truth.intrinsics, matrix=stretched))
    lenses = [SoughtLens.around(panorama_of_view(SIZE, Cylindrical, 180.0), 0.03)]
    frames = {"pan": [paint_frame(PITCH, truth)]}
    found = find_cameras(PITCH, [SoughtCamera("pan", lenses)], [], frames, sure_of_thin_lines, 1)
    (camera,) = found.cameras
    assert camera.refusal is None
    best = camera.candidates[0]
    assert best.camera.distance_m(truth) < 3 * best.sigma.position_m
    for (row, column), name in (((0, 0), "fx"), ((1, 1), "fy"), ((1, 2), "cy")):
        off = best.camera.intrinsics.matrix[row, column] - truth.intrinsics.matrix[row, column]
        assert abs(off) < 3 * best.camera.intrinsics.sigma[name]


def test_a_panorama_that_sways_is_tracked():
    truth = panorama()
    picture = paint_frame(CROWNED, truth)
    tracker = CameraTracker(CROWNED, [truth], {"pan": picture}, 25.0)
    ends = np.array([[-30.0, 34.0, 0.0], [30.0, -20.0, 0.0]])
    for number in range(1, 5):
        turn = np.radians(0.1 * number) * np.array([1.0, -0.6, 0.4])
        frame = Sway.from_turn(-turn, truth.intrinsics).rows(picture, 0, SIZE[1])
        now = tracker.see({"pan": Channels([frame])}).cameras[0]
        assert now.how == "measured"
    there = derivatives.moved(truth, np.append(turn, np.zeros(3))).project(ends)
    assert np.linalg.norm(there - truth.project(ends), axis=1).min() > 2
    assert np.linalg.norm(there - now.camera.project(ends), axis=1).max() < 0.3
