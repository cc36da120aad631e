"""A camera that shakes is followed by its lines; what is not seen is said, and it is found again afterwards."""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest

from testbed.parameters import try_first
from testbed.synthetic import CROWNED, moved, pair, pair_frames
from tests.worker.video.shaking import turn
from worker.calibration.detection.contrast import Channels
from worker.calibration.detection.frame_fusion import Sway
from worker.calibration.geometry import derivatives
from worker.calibration.geometry.camera import inside
from worker.calibration.geometry.rotation import rotation_angles_deg
from worker.calibration.records import CalibrationError
from worker.calibration.tracking.follower import CameraTracker, TrackedMoment

pytestmark = pytest.mark.slow

FRAMES_PER_SECOND = 25.0
COUNT = 26
LEFT = pair()[0]
STORED = moved(LEFT, (0.0012, -0.0008, 0.0005), (0.01, 0.005, -0.01))


def still_picture() -> np.ndarray:
    """What the camera shows while it stands still; painted by the first test that needs it."""
    return pair_frames()[0]


@cache
def frame(number: int) -> np.ndarray:
    """What the camera shows when it has turned: all of its picture turns alike."""
    shaken = Sway.from_turn(-turn(number, 0.0), LEFT.intrinsics).rows(still_picture(), 0, LEFT.intrinsics.size[1])
    return with_noise(shaken, np.random.default_rng(number), 2)


def with_noise(picture: np.ndarray, rng: np.random.Generator, sigma: float) -> np.ndarray:
    noise = sigma * rng.standard_normal(picture.shape, np.float32)
    return np.clip(picture + noise, 0, 255).astype(np.uint8)


def true(number: int):
    return derivatives.moved(LEFT, np.append(turn(number, 0.0), np.zeros(3)))


@cache
def followed_as_it_is(every: int, look_ahead: int) -> list[TrackedMoment]:
    """The clip with none of its frames replaced."""
    return followed(every=every, look_ahead=look_ahead)


def followed(
    frames: Mapping[int, np.ndarray | None] | None = None, every: int = 1, look_ahead: int = 0, count: int = COUNT
) -> list[TrackedMoment]:
    """The first frames of the clip, some of them replaced; None is none."""
    follower = CameraTracker(CROWNED, [STORED], {"left": frame(0)}, FRAMES_PER_SECOND, every, look_ahead)
    told: list[TrackedMoment] = []
    for number in range(1, count):
        replaced = frames or {}
        picture = replaced[number] if number in replaced else frame(number)
        now = follower.see({} if picture is None else {"left": Channels([picture])})
        assert now.number == number
        told += follower.settled()
    return told + follower.rest()


def residual_px(moments: list[TrackedMoment]) -> float:
    """How far lines are from where the cameras that are told expect them, about the mean of each, rms."""
    points = CROWNED.line_points(2.0).position
    points = points[inside(LEFT.project(points), LEFT.intrinsics.size, 20)]
    off = np.array([true(m.number).project(points) - m.cameras[0].camera.project(points) for m in moments])
    return float(np.sqrt(np.mean(np.sum((off - off.mean(axis=0)) ** 2, axis=-1))))


def how(moments: list[TrackedMoment]) -> list[str]:
    return [moment.cameras[0].how for moment in moments]


def sigma_deg(moment: TrackedMoment) -> float:
    return moment.cameras[0].motion_sigma.rotation_deg


@pytest.mark.parametrize(("every", "look_ahead"), try_first([(1, 0), (2, 10), (1, 10)]))
def test_a_shaking_camera_is_followed_to_a_fraction_of_a_pixel_and_every_frame_is_told_once(every, look_ahead):
    moments = followed_as_it_is(every, look_ahead)
    assert [moment.number for moment in moments] == list(range(COUNT))
    assert how(moments) == [("measured" if number % every == 0 else "coasted") for number in range(COUNT)]
    assert residual_px(moments) < 0.1
    away = [m.cameras[0].camera.pose.position - LEFT.pose.position for m in moments]
    assert np.max(np.abs(away)) < 0.03


def test_what_is_said_at_once_is_what_settles_without_looking_ahead():
    follower = CameraTracker(CROWNED, [STORED], {"left": frame(0)}, FRAMES_PER_SECOND)
    at_once = [follower.see({"left": Channels([frame(number)])}) for number in range(1, 4)]
    for now, settled in zip(at_once, followed_as_it_is(1, 0)[1:4], strict=True):
        np.testing.assert_array_equal(now.cameras[0].camera.pose.rotation, settled.cameras[0].camera.pose.rotation)


def test_its_motion_is_known_as_well_as_it_says():
    ratios = []
    for moment in followed_as_it_is(1, 0):
        told = moment.cameras[0]
        error = derivatives.change_between(true(moment.number), told.camera)
        ratios.append((error, told.motion_covariance))
    about_mean = np.array([error for error, _ in ratios]) - np.mean([error for error, _ in ratios], axis=0)
    squared = [e @ np.linalg.solve(cov, e) / 6 for e, (_, cov) in zip(about_mean, ratios, strict=True)]
    assert 0.1 < np.mean(squared) < 2.0


@pytest.mark.long
def test_where_it_will_be_is_told_with_a_sigma_that_covers_it():
    ahead = 3
    follower = CameraTracker(CROWNED, [STORED], {"left": frame(0)}, FRAMES_PER_SECOND)
    off_deg, sigma, still_deg = [], [], []
    for number in range(1, 30):
        now = follower.see({"left": Channels([frame(number)])})
        (later,) = follower.predicted(ahead / FRAMES_PER_SECOND).cameras
        off_deg.append(rotation_angles_deg(later.camera.pose.rotation, true(number + ahead).pose.rotation))
        still_deg.append(rotation_angles_deg(now.cameras[0].camera.pose.rotation, true(number + ahead).pose.rotation))
        sigma.append(later.motion_sigma.rotation_deg)
    assert np.mean(off_deg[10:]) < 0.3 * np.mean(still_deg[10:])
    assert all(off < 3 * one for off, one in zip(off_deg[10:], sigma[10:], strict=True))


def test_without_frames_it_coasts_with_a_sigma_that_grows_and_is_found_again():
    gap = range(8, 20)
    moments = followed(dict.fromkeys(gap), count=24)
    assert [number for number, one in enumerate(how(moments)) if one == "coasted"] == list(gap)
    growing = [sigma_deg(moments[number]) for number in gap]
    assert growing == sorted(growing)
    assert growing[-1] > 20 * sigma_deg(moments[gap[0] - 1])
    assert residual_px(moments[: gap[0]] + moments[gap[-1] + 1 :]) < 0.1


def test_where_a_frame_is_missing_in_which_lines_were_due_they_are_measured_in_the_next_one():
    moments = followed({2: None, 3: frame(3)}, every=2, count=8)
    assert how(moments) == ["measured", "coasted", "coasted", "measured", *2 * ["coasted", "measured"]]


@pytest.mark.long
def test_who_looks_ahead_bridges_a_short_gap():
    gap = dict.fromkeys(range(12, 16))
    blind, ahead = followed(gap), followed(gap, look_ahead=8)
    assert residual_px(ahead) < 0.5 * residual_px(blind)
    assert sigma_deg(ahead[14]) < 0.5 * sigma_deg(blind[14])


@pytest.mark.long
def test_a_frame_that_shows_no_lines_is_coasted_over():
    moments = followed({15: np.full_like(still_picture(), 90)}, count=17)
    assert how(moments)[14:17] == ["measured", "coasted", "measured"]


def test_a_frame_of_something_else_is_coasted_over_and_one_that_cannot_be_is_refused():
    something_else, elsewhere = np.roll(frame(12), 40, axis=0), np.roll(frame(15), (1, 2), axis=(0, 1))
    moments = followed({12: something_else, 15: elsewhere}, count=18)
    assert how(moments)[11:17] == ["measured", "coasted", "measured", "measured", "refused", "measured"]
    assert residual_px(moments) < 0.15


def magnified(picture: np.ndarray, by: float) -> np.ndarray:
    """What the camera shows with so much longer a focal length."""
    about = LEFT.intrinsics.matrix[:2, 2]
    matrix = np.column_stack([by * np.eye(2), (1 - by) * about])
    return cv2.warpAffine(picture, matrix, LEFT.intrinsics.size, flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REFLECT)


@pytest.mark.long
@pytest.mark.parametrize("by", [1.02, 1.01])
def test_a_lens_that_is_zoomed_is_refused_however_long_it_is_looked_at(by):
    """A pose that nobody knows any more must not be drawn to where a part of the lines fits it."""
    moments = followed({number: magnified(frame(number), by) for number in range(12, 24)}, count=24)
    assert "measured" not in how(moments)[12:]


@pytest.mark.long
def test_a_picture_that_is_noisier_or_less_sharp_than_usual_is_measured():
    rng = np.random.default_rng(3)
    noisy = {number: with_noise(frame(number), rng, 15) for number in range(12, 16)}
    soft = {number: cv2.GaussianBlur(frame(number), (0, 0), 1.0) for number in range(18, 22)}
    moments = followed(noisy | soft, count=24)
    assert set(how(moments)) == {"measured"}
    assert residual_px(moments) < 0.15


@pytest.mark.long
def test_a_pose_does_not_jump_when_lines_are_hidden_that_a_wrong_lens_puts_beside_their_places():
    lens = LEFT.intrinsics
    wrong = LEFT.with_lens(replace(lens, distortion=lens.distortion + [0.01, 0, 0, 0, 0]))
    frames = [with_noise(still_picture(), np.random.default_rng(number), 2) for number in range(16)]
    for hidden in frames[8:]:
        hidden[:, :400] = (60, 130, 70)
    follower = CameraTracker(CROWNED, [wrong], {"left": frames[0]}, FRAMES_PER_SECOND, look_ahead=0)
    told = [follower.see({"left": Channels([each])}).cameras[0] for each in frames[1:]]
    assert {one.how for one in told} == {"measured"}
    before, after = (np.mean([one.camera.pose.rotation for one in part], axis=0) for part in (told[2:7], told[8:]))
    assert np.degrees(np.linalg.norm(after - before)) < 0.01


def test_a_first_frame_without_lines_is_said():
    with pytest.raises(CalibrationError, match="first frame of camera left does not show its lines") as refused:
        CameraTracker(CROWNED, [STORED], {"left": np.full_like(still_picture(), 90)}, FRAMES_PER_SECOND)
    assert refused.value.kind == "lines-not-seen"
