"""ST maps, made by their program as the service runs it, read by OpenEXR and followed as a compositor would."""

import io
import sys
import zipfile

import cv2
import numpy as np
import OpenEXR
import pytest

from service.formats.lens import NumberedCamera
from service.formats.table import export_formats
from service.schemas.geometry import Intrinsics
from service.schemas.problems import Problem
from service.schemas.venue import Camera
from service.settings import Settings
from testbed.parameters import try_first
from tests.service.formats.cameras import ALL_OF_OPENCV_8, RADIAL, WITH_TILT, shot

pytestmark = pytest.mark.slow

SIZE = (192, 108)
SETTINGS = Settings()


def small(distortion):
    """A camera of few pixels: maps hold one value for each."""
    camera = shot(distortion).camera
    matrix = [[132.6, 0, 101.6], [0, 132.6, 54.3], [0, 0, 1]]
    intrinsics = Intrinsics(matrix=matrix, distortion=distortion)
    return NumberedCamera(Camera(id="left", image_size=list(SIZE), intrinsics=intrinsics, pose=camera.pose), 1)


def read_maps(shot, form, tmp_path):
    """Pixel positions to sample, (height, width, 2), top left, of each direction."""
    document = export_formats(SETTINGS)[form].document([shot])
    maps = {}
    with zipfile.ZipFile(io.BytesIO(document.content)) as files:
        for name in files.namelist():
            path = files.extract(name, tmp_path)
            with OpenEXR.File(path) as exr:
                st = exr.channels()["RGB"].pixels
            assert st.dtype == np.float32
            assert st.shape == (SIZE[1], SIZE[0], 3)
            assert not st[..., 2].any()
            maps[name] = st[..., :2].astype(float)
    return maps["undistort.exr"], maps["distort.exr"]


def test_without_openexr_it_is_told_what_to_install():
    program = "import sys; sys.modules['OpenEXR'] = None; from worker.programs.stmap import main; main(sys.argv[1])"
    settings = Settings(map_program=[sys.executable, "-P", "-c", program])
    with pytest.raises(Problem, match=r"python -m pip install 'OpenEXR<4,>=3.4'") as told:
        export_formats(settings)["st-map"].document([small([])])
    assert told.value.kind == "extra-missing"


def pixels_of(st):
    return st * SIZE - 0.5


@pytest.mark.parametrize("distortion", try_first([WITH_TILT, [], RADIAL, ALL_OF_OPENCV_8]))
def test_the_undistorting_map_samples_where_opencv_does(tmp_path, distortion):
    camera = small(distortion)
    undistort, _ = read_maps(camera, "st-map-unreal", tmp_path)
    matrix, coefficients = np.array(camera.camera.intrinsics.matrix), np.array(distortion, dtype=float)
    x, y = cv2.initUndistortRectifyMap(matrix, coefficients, None, matrix, SIZE, cv2.CV_32FC1)
    np.testing.assert_allclose(pixels_of(undistort), np.stack([x, y], axis=-1), atol=0.01)


@pytest.mark.parametrize("distortion", try_first([WITH_TILT, RADIAL, ALL_OF_OPENCV_8]))
def test_the_distorting_map_samples_where_opencv_does(tmp_path, distortion):
    camera = small(distortion)
    _, distort = read_maps(camera, "st-map-unreal", tmp_path)
    matrix, coefficients = np.array(camera.camera.intrinsics.matrix), np.array(distortion, dtype=float)
    grid = np.stack(np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1])), axis=-1).reshape(-1, 1, 2).astype(float)
    exact = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 200, 1e-12)
    back = cv2.undistortPoints(grid, matrix, coefficients, P=matrix, criteria=exact)
    np.testing.assert_allclose(pixels_of(distort), back.reshape(SIZE[1], SIZE[0], 2), atol=0.01)


def test_there_and_back_is_the_same_pixel(tmp_path):
    undistort, distort = (pixels_of(st) for st in read_maps(small(RADIAL), "st-map-unreal", tmp_path))
    inside = ((distort >= 0) & (distort < np.array(SIZE) - 1)).all(axis=-1)
    assert inside.mean() > 0.5
    x, y = np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1]))
    expected = np.stack([x, y], axis=-1)[inside]
    np.testing.assert_allclose(between(undistort, distort[inside]), expected, atol=0.01)


def between(values, pixels):
    """Bilinear samples (N, 2) at pixels (N, 2): `cv2.remap` rounds positions to 1/32 pixel."""
    (x, y), (dx, dy) = np.floor(pixels).astype(int).T, (pixels % 1).T[..., None]
    above = values[y, x] * (1 - dx) + values[y, x + 1] * dx
    below = values[y + 1, x] * (1 - dx) + values[y + 1, x + 1] * dx
    return above * (1 - dy) + below * dy


def test_a_picture_is_undistorted_with_the_map_as_with_opencv(tmp_path):
    camera = small(RADIAL)
    picture = cv2.GaussianBlur(np.random.default_rng(2).uniform(0, 255, SIZE[::-1]).astype(np.float32), (0, 0), 3)
    undistort, _ = read_maps(camera, "st-map-unreal", tmp_path)
    ours = cv2.remap(picture, pixels_of(undistort).astype(np.float32), None, cv2.INTER_LINEAR)
    theirs = cv2.undistort(picture, np.array(camera.camera.intrinsics.matrix), np.array(RADIAL))
    np.testing.assert_allclose(ours[5:-5, 5:-5], theirs[5:-5, 5:-5], atol=0.5)


def test_green_counts_from_the_bottom_for_nuke_and_from_the_top_for_unreal(tmp_path):
    camera = small(RADIAL)
    for nuke, unreal in zip(
        read_maps(camera, "st-map", tmp_path), read_maps(camera, "st-map-unreal", tmp_path), strict=True
    ):
        np.testing.assert_array_equal(nuke[..., 0], unreal[..., 0])
        np.testing.assert_allclose(nuke[..., 1], 1 - unreal[..., 1], atol=1e-6)
    top, bottom = read_maps(small([]), "st-map-unreal", tmp_path)[0][[0, -1], 0, 1]
    assert (top, bottom) == pytest.approx((0.5 / SIZE[1], 1 - 0.5 / SIZE[1]))


def test_pixels_that_nothing_is_behind_point_outside(tmp_path):
    # Folds back within the picture: the corners see no ray.
    undistort, _ = read_maps(small([-0.9, 0.0, 0.0, 0.0]), "st-map-unreal", tmp_path)
    assert (undistort[0, 0] == -1).all()
    assert np.isfinite(undistort).all()


def test_maps_of_several_cameras_are_asked_for_one_by_one():
    shots = [NumberedCamera(small(RADIAL).camera.model_copy(update={"id": each}), 1) for each in ("left", "right")]
    with pytest.raises(Problem) as refused:
        export_formats(SETTINGS)["st-map"].document(shots)
    assert refused.value.members()["expected"] == ["left", "right"]
