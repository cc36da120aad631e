"""Pictures as video has them, read between their pixels without being converted."""

import av
import cv2
import numpy as np
import pytest

from worker.calibration.detection.contrast import LUMA_SHARES, Channel
from worker.video.yuv_planes import Picture, picture_of

PLACES = np.random.default_rng(2).uniform(0, [63, 47], (5, 40, 2)).astype(np.float32)


def smooth_picture() -> Picture:
    """Colours that change slowly: chroma has a value for every 2 x 2 pixels."""
    few = np.random.default_rng(1).integers(60, 190, (4, 5, 3), dtype=np.uint8)
    colours = cv2.resize(few, (64, 48), interpolation=cv2.INTER_CUBIC)
    return picture_of(av.VideoFrame.from_ndarray(colours, format="bgr24"))


def places():
    return tuple(np.ascontiguousarray(PLACES[..., axis]).reshape(-1, 40) for axis in (0, 1))


@pytest.mark.parametrize("channel", [Channel.BLUE, Channel.GREEN, Channel.RED])
def test_a_channel_is_read_as_it_is_when_all_of_the_picture_is_converted(channel):
    picture = smooth_picture()
    whole = picture.colours[..., channel].astype(np.float32)
    expected = cv2.remap(whole, *places(), cv2.INTER_LINEAR)
    off = picture.read(channel, *places()) - expected
    # Whole levels of chroma are two of blue and red.
    assert np.std(off) < 2.5
    assert abs(np.mean(off)) < 0.5


def test_luma_is_read_as_the_shares_that_colours_have_in_it():
    picture = smooth_picture()
    expected = cv2.remap((picture.colours @ np.array(LUMA_SHARES)).astype(np.float32), *places(), cv2.INTER_LINEAR)
    assert np.abs(picture.read(Channel.LUMA, *places()) - expected).max() < 2


def test_nothing_is_read_outside_of_the_picture():
    column = np.array([[-0.1, 0.0, 63.0, 63.1, 5.0, 5.0]], np.float32)
    row = np.array([[5.0, 0.0, 47.0, 5.0, -0.1, 47.1]], np.float32)
    assert np.isnan(smooth_picture().read(Channel.LUMA, column, row)).tolist() == [
        [True, False, False, True, True, True]
    ]
