"""The exported network and the tiles it looks at."""

import cv2
import numpy as np
import pytest

from service.settings import MODEL_BESIDE_THE_CODE
from tests.calibration.synthetic import CROWNED, camera, paint_frame
from worker.calibration.segmentation import CORE_PX, Segmenter, fuse, reachable_tiles

WIDE = camera("left", (-1.0, -48.0, 12.0), (-20.0, 0.0), focal=1200, size=(1920, 1080))


@pytest.fixture(scope="module")
def segmenter():
    return Segmenter(MODEL_BESIDE_THE_CODE, threads=2)


@pytest.fixture(scope="module")
def picture():
    """A frame that is more than a tile wide and high."""
    frame = paint_frame(CROWNED, camera("left", (-1.0, -48.0, 10.0), (-20.0, 0.0)))
    noise = np.random.default_rng(0).normal(scale=6, size=frame.shape)
    return np.clip(frame + noise, 0, 255).astype(np.uint8)


def everywhere(frame):
    height, width = frame.shape[:2]
    return np.ones((-(-height // CORE_PX), -(-width // CORE_PX)), dtype=bool)


def test_tiled_equals_whole(segmenter, picture):
    height, width = 512, 928
    frame = picture[:height, :width]
    whole = segmenter.session.run(
        None, {segmenter.input_name: frame[:, :, ::-1].transpose(2, 0, 1)[None].astype(np.float32) / 255}
    )[0][0, 0]
    tiled = segmenter(frame, everywhere(frame))
    # The border of the picture differs: whole pads with zeros, tiles with the picture's mirror image.
    inner = np.s_[96:-96, 96:-96]
    assert np.abs(tiled[inner] / 255 - whole[inner]).max() < 0.5 / 255 + 1e-4


def test_the_number_of_threads_changes_nothing(segmenter, picture):
    one = Segmenter(MODEL_BESIDE_THE_CODE, threads=1)
    np.testing.assert_array_equal(one(picture, everywhere(picture)), segmenter(picture, everywhere(picture)))


def test_only_wanted_tiles_are_looked_at(segmenter, picture):
    wanted = everywhere(picture)
    wanted[:, 1:] = False
    response = segmenter(picture, wanted)
    assert (response[:, CORE_PX:] == 0).all()
    np.testing.assert_array_equal(response[:, :CORE_PX], segmenter(picture, everywhere(picture))[:, :CORE_PX])


def test_every_line_of_a_slightly_moved_camera_is_in_a_reachable_tile():
    wanted = reachable_tiles(CROWNED, WIDE, reach_px=120)
    pixels = WIDE.project(CROWNED.line_points().position)
    for move in ([100, 0], [-100, 0], [0, 100], [0, -100]):
        moved = pixels + move
        inside = ((moved >= 0) & (moved <= [1919, 1079])).all(axis=1)
        column, row = (moved[inside] // CORE_PX).astype(int).T
        assert wanted[row, column].all()


def test_the_sky_is_not_looked_at():
    steep = camera("left", (-1.0, -48.0, 12.0), (-20.0, 60.0), focal=1200, size=(1920, 1800))
    assert not reachable_tiles(CROWNED, steep, reach_px=50)[0].any()


def test_what_walks_by_vanishes_from_several_frames():
    responses = [np.full((10, 10), 200, dtype=np.uint8) for _ in range(3)]
    responses[1][:, 5] = 0
    np.testing.assert_allclose(fuse(responses), 200 / 255)


def test_painted_lines_are_found_and_grass_is_not(segmenter, picture):
    response = segmenter(picture, everywhere(picture))
    white = cv2.min(cv2.min(*cv2.split(picture)[:2]), cv2.split(picture)[2]) > 180
    lines = white & (picture[..., 0] > picture[..., 2] - 25) & (np.arange(len(picture))[:, None] > 250)
    assert (response[lines] > 127).mean() > 0.5
    assert (response[400:][~white[400:]] > 127).mean() < 0.02
