"""The pictures show what the poses are worth: one line where they are right, two or a step where they are wrong."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from testbed.synthetic import (
    CROWNED,
    GRASS,
    PITCH,
    camera,
    paint_frame,
    pair,
    pair_frames,
)
from tests.scenes import row, unposed
from worker.calibration.geometry.camera import Array, Camera, Frame, Pose, inside
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.rotation import rotation_matrices, rotation_vectors
from worker.calibration.rendering.stitched_pictures import birdseye, stitched
from worker.calibration.stitching.panorama import BACKDROP, panorama, seam_weights
from worker.calibration.stitching.photometric_alignment import LARGEST_GAIN, evened_out
from worker.calibration.stitching.views import StitchedView, ViewChoice, chosen_view

pytestmark = pytest.mark.slow

CAMERAS = pair()
FRAME_SIZE = (960, 540)


def frames(exposure_right: float = 1.0) -> dict[str, NDArray[np.uint8]]:
    left, right = pair_frames()
    return {"left": left, "right": (exposure_right * right).astype(np.uint8)}


def lines_across(picture: NDArray[np.uint8], y: int, x: slice) -> int:
    """How many white lines a row of the picture crosses."""
    white = picture[y, x].min(axis=-1) > 150
    return int(np.count_nonzero(np.diff(white.astype(int)) == 1))


def preview(pitch: Field, cameras: list[Camera], pictures: dict[str, NDArray[np.uint8]], width: int) -> Frame:
    """The cameras' pictures, stitched as they are seen from between them."""
    return stitched(pitch, chosen_view(pitch, cameras, ViewChoice(width=width)), cameras, pictures).picture


def turned(one: Camera, yaw_deg: float) -> Camera:
    """The camera turned about the vertical, to the right."""
    about_vertical = rotation_matrices(np.array([0.0, 0.0, np.radians(yaw_deg)]))
    return one.with_pose(Pose(rotation_vectors(one.pose.matrix @ about_vertical), one.pose.position))


def halfway(view: StitchedView, y: float) -> Array:
    """Where the preview shows a point of the halfway line."""
    return view.project(CROWNED.lift(np.array([0.0, y])))


@cache
def true_preview() -> NDArray[np.uint8]:
    return preview(CROWNED, CAMERAS, frames(), 1200)


def test_the_preview_shows_the_pitch_where_its_viewpoint_says() -> None:
    picture = true_preview()
    view = chosen_view(CROWNED, CAMERAS, ViewChoice(width=1200))
    assert picture.shape == (view.size[1], 1200, 3)
    for y in (-25.0, -15.0, 5.0):
        x, row = halfway(view, y)
        part = picture[round(row), round(x) - 15 : round(x) + 16].min(axis=-1).astype(float)
        bright = np.clip(part - np.median(part) - 10, 0, None)
        assert (bright * np.arange(-15, 16)).sum() / bright.sum() == pytest.approx(x - round(x), abs=0.3)


def test_a_preview_of_true_poses_shows_one_halfway_line() -> None:
    view = chosen_view(CROWNED, CAMERAS, ViewChoice(width=1200))
    picture = true_preview()
    x, y = halfway(view, -25.0)
    assert lines_across(picture, round(y), slice(round(x) - 60, round(x) + 60)) == 1


def test_a_preview_of_wrong_poses_shows_two() -> None:
    # Each camera turned towards the other: either shows the line on its own side of the seam.
    wrong = [turned(CAMERAS[0], -0.6), turned(CAMERAS[1], 0.6)]
    view = chosen_view(CROWNED, wrong, ViewChoice(width=1200))
    x, y = halfway(view, -25.0)
    picture = preview(CROWNED, wrong, frames(), 1200)
    assert lines_across(picture, round(y), slice(round(x) - 60, round(x) + 60)) == 2


def test_the_preview_has_no_hole_in_it() -> None:
    picture = true_preview()
    unseen = (picture == BACKDROP).all(axis=-1)
    assert unseen.mean() < 0.02
    height, width = unseen.shape
    assert not unseen[height // 10 : -height // 10, width // 10 : -width // 10].any()


def test_exposures_are_evened_out() -> None:
    view = chosen_view(CROWNED, CAMERAS, ViewChoice(width=1200))
    picture = preview(CROWNED, CAMERAS, frames(0.85), 1200)
    x, y = np.rint(halfway(view, -20.0)).astype(int)
    left, right = picture[y, x - 150 : x - 50].mean(axis=0), picture[y, x + 50 : x + 150].mean(axis=0)
    assert np.abs(left - right).max() < 4
    # Between the two exposures, not all of one.
    assert (right > 0.85 * GRASS - 2).all()
    assert (right < GRASS + 2).all()


def test_an_exposure_gain_is_bounded() -> None:
    pictures = {one.id: np.full((540, 960, 3), value, np.uint8) for one, value in zip(CAMERAS, (200, 40), strict=True)}
    found = evened_out(CROWNED, CAMERAS, pictures)
    assert all(1 / LARGEST_GAIN <= gain <= LARGEST_GAIN for light in found.values() for gain in light.gain)


def test_feathers_sum_to_one_wherever_a_camera_sees() -> None:
    quality = np.random.default_rng(0).uniform(0, 1, (3, 40, 50)).astype(np.float32)
    quality[:, :5] = 0
    total = seam_weights(quality).sum(axis=0)
    assert total[5:] == pytest.approx(1.0, abs=1e-5)
    assert (total[:5] == 0).all()


@pytest.mark.long
def test_the_geometry_of_the_preview_is_exact_to_a_twentieth_of_a_pixel() -> None:
    size = (3840, 2160)
    lens = (-0.34, 0.104, 0.0, 0.0, 0.0)
    wide = [
        camera(name, (x, -48.0, 10.0), (20 * x, -5.0), focal=2600.0, distortion=lens, size=size)
        for name, x in (("left", -1.0), ("right", 1.0))
    ]
    view = chosen_view(CROWNED, wide, ViewChoice(width=1920))
    dense = view.behind(CROWNED, np.stack(np.meshgrid(*map(np.arange, view.size)), axis=-1) * 1.0)
    for one, part in zip(wide, panorama(CROWNED, view, wide).parts, strict=True):
        exact, quick = one.project(dense), part.source
        # On the ground; at the horizon the world bends away more sharply than anyone could see.
        judged = (part.weight > 0) & inside(exact, size, margin=8) & (np.abs(dense[..., 1]) < 200)
        assert np.linalg.norm(exact - quick, axis=-1)[judged].max() < 0.1
        assert np.quantile(np.linalg.norm(exact - quick, axis=-1)[judged], 0.999) < 0.05


@pytest.mark.long
@pytest.mark.parametrize("count", [3, 1])
def test_any_number_of_cameras_in_a_row(count: int) -> None:
    cameras = row() if count == 3 else row()[1:2]
    pictures = {one.id: paint_frame(CROWNED, one) for one in cameras}
    picture = preview(CROWNED, cameras, pictures, 960)
    assert picture.shape[1] == 960
    assert 1.2 < picture.shape[1] / picture.shape[0] < 8
    assert (picture == BACKDROP).all(axis=-1).mean() < 0.05
    assert birdseye(CROWNED, cameras, pictures).shape == (741, 1111, 3)


@pytest.mark.long
def test_cameras_that_face_each_other_are_seen_from_outside() -> None:
    facing = [
        camera("near", (0.0, -55.0, 15.0), (0.0, 0.0), focal=450.0),
        camera("far", (0.0, 55.0, 15.0), (0.0, 0.0), focal=450.0),
    ]
    pictures = {one.id: paint_frame(PITCH, one) for one in facing}
    view = chosen_view(PITCH, facing, ViewChoice(width=960))
    assert view.pose.position[1] < -50
    assert view.pose.position[2] >= 15
    picture = preview(PITCH, facing, pictures, 960)
    x, y = view.project(np.array([0.0, 0.0, 0.0]))
    assert (picture == BACKDROP).all(axis=-1).mean() < 0.2
    assert 0 < x < 960
    assert 0 < y < picture.shape[0]


def test_cameras_that_see_no_pitch_still_get_a_picture() -> None:
    sky = [unposed(CAMERAS[0])]
    pictures = {"left": np.full((540, 960, 3), 200, np.uint8)}
    assert preview(PITCH, sky, pictures, 640).shape[1] == 640
    assert (birdseye(PITCH, sky, pictures)[370:, 555] == BACKDROP).any()


def test_the_centre_mark_is_in_the_centre_pixel_of_the_birdseye_view() -> None:
    picture = birdseye(CROWNED, CAMERAS, frames(), pixels_per_metre=20).min(axis=-1).astype(float)
    assert picture.shape == (2 * 740 + 1, 2 * 1110 + 1)
    row, column = 740, 1110
    radius = 9.09 * 20

    def crossing(profile: Array, expected: float) -> float:
        near = np.arange(round(expected) - 12, round(expected) + 13)
        return float(np.average(near, weights=np.clip(profile[near] - np.median(profile[near]) - 2, 0, None)))

    assert crossing(picture[row + 60 : row + 160].mean(axis=0), column) == pytest.approx(column, abs=0.3)
    for side in (-1, 1):
        assert crossing(picture[row], column + side * radius) == pytest.approx(column + side * radius, abs=0.5)
    # The near side of the circle; the far one is a smear in so small a frame.
    below = row + np.sqrt(radius**2 - 40**2)
    assert crossing(picture[:, column + 40], below) == pytest.approx(below, abs=1.0)


@pytest.mark.parametrize("by", [(0.0, 0.0, 700.0), (1100.0, 0.0, 0.0), (0.0, -60.0, 60.0)])
def test_a_preview_of_poses_that_are_far_off_stays_a_picture(by: tuple[float, float, float]) -> None:
    lost = CAMERAS[1].with_pose(Pose(CAMERAS[1].pose.rotation, CAMERAS[1].pose.position + np.array(by)))
    width, height = chosen_view(PITCH, [CAMERAS[0], lost], ViewChoice(width=960)).size
    assert width == 960
    assert 140 <= height <= 960
