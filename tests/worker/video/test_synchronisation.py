"""How much later a clip began, found by what moves."""

import numpy as np
import pytest

from tests.worker.video.filming import LEFT, PITCH, RIGHT, cameras, film
from worker.video.clips import Clip
from worker.video.synchronisation import CoarseView, MotionSignal, chain_offsets, estimate_offset

pytestmark = pytest.mark.slow

PLACES = CoarseView(PITCH, cameras)
# Encoders refresh whole frames in rhythms of their own.
COARSE = {"crf": "30"}


def motion(camera, path):
    with Clip.open(camera, str(path)) as clip:
        return PLACES.motion(camera, clip.shots())


@pytest.fixture(scope="module")
def left(tmp_path_factory):
    return motion("left", film(tmp_path_factory.mktemp("left") / "l.mp4", LEFT, 6.0, options=COARSE | {"g": "12"}))


@pytest.mark.long
@pytest.mark.parametrize(("offset", "rate"), [(-0.5, 30), (0.137, 25), (0.0, 25), (1.3, 25)])
def test_the_offset_is_found_to_a_part_of_a_frame(left, tmp_path, offset, rate):
    path = film(tmp_path / "r.mp4", RIGHT, 6.0, begun_s=offset, rate=rate, options=COARSE | {"g": "10"})
    found = estimate_offset(left, motion("right", path))
    assert found.second_s == pytest.approx(offset, abs=0.01)
    assert found.strength > 0.7


@pytest.mark.parametrize("offset", [-0.51, 0.13, 0.15])
def test_an_offset_lies_between_two_frames_on_the_side_where_motion_is_more_alike(offset):
    # In each of ten places somebody passes six times, for a quarter of a second.
    passes = np.random.default_rng(1).uniform(0, 8, (6, 1, 10))

    def seen(begun_s):
        times = np.arange(150) / 25
        change = 50 * np.exp(-(((begun_s + times[:, None] - passes) / 0.12) ** 2)).sum(axis=0)
        return MotionSignal(times, change.astype(np.float32), np.ones(10, bool))

    assert estimate_offset(seen(1.0), seen(1.0 + offset)).second_s == pytest.approx(offset, abs=0.002)


@pytest.mark.long
def test_lamps_that_flicker_are_not_taken_for_motion(left, tmp_path):
    path = film(
        tmp_path / "r.mp4",
        RIGHT,
        6.0,
        begun_s=0.2,
        change=lambda picture, n: np.clip(picture * (1 + 0.05 * (n % 3)), 0, 255).astype(np.uint8),
    )
    assert estimate_offset(left, motion("right", path)).second_s == pytest.approx(0.2, abs=0.01)


@pytest.mark.parametrize(
    ("seconds", "filmed", "why"),
    [
        (1.0, {}, "shorter than 2 s"),
        pytest.param(4.0, {"moving": False}, "nothing moves", marks=pytest.mark.long),
        # Of different minutes, and too far apart.
        pytest.param(6.0, {"begun_s": 40}, "", marks=pytest.mark.long),
        pytest.param(6.0, {"begun_s": 3}, "", marks=pytest.mark.long),
    ],
)
def test_clips_that_tell_nothing_are_not_put_together(left, tmp_path, seconds, filmed, why):
    found = estimate_offset(left, motion("right", film(tmp_path / "r.mp4", RIGHT, seconds, **filmed)))
    assert found.second_s is None
    assert found.why
    assert why in found.why


@pytest.mark.long
def test_a_camera_comes_in_time_by_one_that_is_in_time(left, tmp_path):
    right = motion("right", film(tmp_path / "r.mp4", RIGHT, 6.0, begun_s=0.4))
    offsets, found = chain_offsets(PLACES, {"left": left, "right": right}, {"left": 0.25})
    assert offsets == {"left": 0.25, "right": pytest.approx(0.65, abs=0.01)}
    assert list(found) == ["right"]
