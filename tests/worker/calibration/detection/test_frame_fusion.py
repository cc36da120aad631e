"""Several frames of a camera that shakes become one still view of the ground."""

from functools import cache

import cv2
import numpy as np
import pytest

from testbed.synthetic import BARREL, PITCH, camera, paint_frame
from worker.calibration.detection.contrast import Channel, Channels
from worker.calibration.detection.frame_fusion import Sway, median, sways
from worker.calibration.geometry.camera import Pose
from worker.calibration.geometry.derivatives import moved
from worker.calibration.geometry.lens import Fisheye

pytestmark = pytest.mark.slow

ON_A_MAST = camera("mast", (0.0, -48.0, 12.0), (0.0, 0.0), distortion=BARREL)
# By how much the camera turns from frame to frame, in pixels of the picture.
TURNS_PX = np.array([[0.0, 0.0, 0.0], [1.5, -2.0, 0.5], [-2.0, 1.0, 1.0], [0.5, 2.0, -1.5], [-1.0, -1.0, 0.3]])
TURNS = TURNS_PX / 600.0


@cache
def surroundings():
    """What is to be seen beside lines, some six pixels coarse: grass, stands, trees."""
    grains = np.random.default_rng(4).normal(0, 40, (400, 400)).astype(np.float32)
    return cv2.GaussianBlur(grains, (0, 0), 0.7)


@cache
def frames():
    """A pitch and its surroundings, from a camera that has turned a little in each frame."""
    # One of every four a side, in the middle of its neighbours: lenses bend the picture slowly.
    pixels = np.stack(np.meshgrid(np.arange(1.5, 960.0, 4), np.arange(1.5, 540.0, 4)), axis=-1)
    pictures = []
    for turn in TURNS:
        one = moved(ON_A_MAST, np.concatenate([turn, np.zeros(3)]))
        # The camera only turns: what it sees depends on the direction alone.
        direction = one.rays(pixels) @ ON_A_MAST.pose.matrix.T
        at = cv2.resize((100 * direction[..., :2] / direction[..., 2:] + 200).astype(np.float32), (960, 540))
        beside = cv2.remap(surroundings(), at[..., 0], at[..., 1], cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)
        pictures.append(np.clip(paint_frame(PITCH, one) + beside[..., None], 0, 255).astype(np.uint8))
    return tuple(pictures)


@cache
def found():
    """How the camera is found to have turned in each of the frames."""
    return sways(frames(), ON_A_MAST.intrinsics)


def with_walker():
    """The same, but somebody walks past."""
    pictures = [picture.copy() for picture in frames()]
    for number, picture in enumerate(pictures):
        picture[200:280, 100 + 150 * number : 130 + 150 * number] = (20, 20, 200)
    return pictures


def of_mean_turn():
    return paint_frame(PITCH, moved(ON_A_MAST, np.concatenate([TURNS.mean(axis=0), np.zeros(3)])))


def far_line(picture):
    """How much the far touchline, thinner than two pixels, stands out from the grass, mean over its length."""
    camera_ = moved(ON_A_MAST, np.concatenate([TURNS.mean(axis=0), np.zeros(3)]))
    pixel = camera_.project(np.stack([np.linspace(-30, 30, 400), np.full(400, 34.0), np.zeros(400)], axis=1))
    rows = np.rint(pixel[:, 1]).astype(int)[:, None] + np.arange(-6, 7)
    profile = picture[rows, np.rint(pixel[:, 0]).astype(int)[:, None]]
    return float(np.mean(profile.max(axis=1) - np.median(profile, axis=1)))


def brightness(pictures, swayed):
    return median([picture[..., Channel.GREEN] for picture in pictures], swayed)


@pytest.mark.long
def test_how_far_a_camera_turned_in_each_frame_is_found_to_a_twentieth_of_a_pixel():
    for sway, turn in zip(found(), TURNS - TURNS.mean(axis=0), strict=True):
        expected = Sway.from_turn(turn, ON_A_MAST.intrinsics).shift
        assert np.abs(sway.shift - expected).max() < 0.05


def test_the_still_view_is_the_mean_of_all_frames_and_not_the_first():
    first, *later = found()
    assert first.shift == pytest.approx(-sum(sway.shift for sway in later), abs=0.05)


@pytest.mark.long
def test_lines_thinner_than_the_shaking_stay_as_they_are_in_one_frame():
    still = [Sway(None)] * len(frames())
    as_in_one = np.mean([far_line(brightness(frames()[:1], [])), far_line(of_mean_turn()[..., Channel.GREEN])])
    assert far_line(brightness(frames(), found())) > 0.9 * as_in_one
    assert far_line(brightness(frames(), still)) < 0.75 * as_in_one


def test_what_walks_by_vanishes_from_frames_that_shake():
    without, walker = brightness(frames(), found()), with_walker()
    walked = brightness(walker, sways(walker, ON_A_MAST.intrinsics))
    assert np.abs(walked - without)[150:330].mean() < 1.0


def test_what_walks_by_vanishes_from_frames_that_do_not_shake():
    masks = [np.full((10, 10), 200, dtype=np.uint8) for _ in range(3)]
    masks[1][:, 5] = 0
    np.testing.assert_array_equal(median(masks, [Sway(None)] * 3), 200)


def test_frames_that_lie_on_each_other_are_left_as_they_are():
    twice = [frames()[0], frames()[0]]
    found = sways(twice, ON_A_MAST.intrinsics)
    assert [sway.shift for sway in found] == [None, None]
    np.testing.assert_array_equal(Channels(twice, found)[Channel.GREEN], frames()[0][..., Channel.GREEN])


def test_frames_without_anything_to_hold_on_to_are_taken_for_still():
    fog = [np.full((540, 960, 3), 120 + number, dtype=np.uint8) for number in range(3)]
    assert [sway.shift for sway in sways(fog, ON_A_MAST.intrinsics)] == [None, None, None]


@pytest.mark.parametrize("turn", [(0.002, -0.001, 0.003), (-0.003, 0.002, 0.0)])
def test_a_turn_moves_every_pixel_as_the_lens_does_also_of_a_fisheye(turn):
    matrix = np.array([[450.0, 0, 480], [0, 450.0, 270], [0, 0, 1]])
    lens = Fisheye(matrix, np.array([-0.02, 0.004, -0.002, 3e-4]), (960, 540))
    one = ON_A_MAST.with_lens(lens).with_pose(Pose(np.zeros(3), np.zeros(3)))
    after = moved(one, np.array([*turn, 0, 0, 0]))
    points = one.rays(np.array([[96.0, 64.0], [480.0, 256.0], [800.0, 480.0]]))
    shift = Sway.from_turn(np.array(turn), lens).shift
    for before, there in zip(one.project(points), after.project(points), strict=True):
        column, row = np.rint(before / 32).astype(int)
        assert shift[row, column] == pytest.approx(there - before, abs=1e-3)
