"""Live streams in time by the clocks of their cameras, told by the RTCP reports of a real RTSP server, GStreamer's."""

import re
import time

import numpy as np
import pytest

from testbed.rtsp import encode, filming, has_server
from testbed.synthetic import PITCH, camera
from tests.worker.video.numbered_pictures import COUNT, SIZE, number_shown, picture_of
from worker.calibration.stitching.photometry import NEUTRAL
from worker.calibration.stitching.views import ViewChoice
from worker.video import camera_clocks
from worker.video.camera_clocks import CameraClocks
from worker.video.encoding import Encoding
from worker.video.errors import VideoError
from worker.video.stitch import Plan, StaticGeometry, StitchScene, stitch

RATE = 25
PERIOD_S = COUNT / RATE
# How long is filmed: the first reports come within some three seconds.
UNTIL_S = 6.5
CAMERAS = [
    camera(name, (x, -48.0, 10.0), (aim, 0.0), 75.0, size=SIZE)
    for name, x, aim in (("left", -1.0, -18.0), ("right", 1.0, 18.0))
]
SCENE = StitchScene(PITCH, CAMERAS, ViewChoice(width=320), {one.id: NEUTRAL for one in CAMERAS})
QUICK = Encoding(preset="ultrafast")


class Watched:
    """Makes a static geometry that notes which pictures make each moment."""

    border = 0.0

    def __init__(self):
        self.moments = []

    def __call__(self, *scene):
        still = StaticGeometry(*scene)
        self.at = lambda number, pictures: self._noted(pictures) or still.at(number, pictures)
        return self

    def _noted(self, pictures):
        self.moments.append({name: number_shown(picture) for name, picture in pictures.items()})


@pytest.fixture
def clip(tmp_path, missing):
    if not has_server():
        missing("gstreamer")
    encode(map(picture_of, range(COUNT)), RATE, 500_000, tmp_path / "clip")
    return tmp_path / "clip"


@pytest.mark.slow
def test_each_moment_has_the_pictures_that_cameras_took_at_one_time(clip, tmp_path):
    watched = Watched()
    with filming([clip, clip], RATE) as cameras:
        clips = dict(zip(("left", "right"), cameras.addresses, strict=True))
        plan = Plan(str(tmp_path / "pano.ts"), end_s=UNTIL_S, encoding=QUICK)
        made = stitch(SCENE, clips, plan, lambda *_: None, watched)
        cameras.process.kill()
        taken_s = {(taken.camera, taken.number): taken.at_ns / 1e9 for taken in cameras.taken()}
    assert made.offsets == {"left": 0.0, "right": 0.0}
    assert made.frames == len(watched.moments) > 10
    # The second camera is asked later, so that pictures of one number are not of one time.
    apart = np.array([taken_s[0, shown["left"]] - taken_s[1, shown["right"]] for shown in watched.moments])
    # The clip begins again and again.
    apart = np.abs((apart + PERIOD_S / 2) % PERIOD_S - PERIOD_S / 2)
    assert np.median(apart) < 0.6 / RATE
    # A busy machine takes some pictures later than it says.
    assert np.percentile(apart, 90) < 1.6 / RATE


@pytest.mark.slow
def test_a_stream_that_says_nothing_of_its_clock_needs_an_offset(clip, tmp_path, monkeypatch):
    monkeypatch.setattr(camera_clocks, "REPORTED_WITHIN_S", 0.5)
    with filming([clip, clip], RATE) as cameras:
        for number in (0, 1):
            cameras.happen("hush", number)
        clips = dict(zip(("left", "right"), cameras.addresses, strict=True))
        with pytest.raises(VideoError, match=r"its stream does not say when .* within 0.5 s.*--offset left=0"):
            stitch(SCENE, clips, Plan(str(tmp_path / "pano.ts"), encoding=QUICK), lambda *_: None)


def test_nobody_goes_on_before_all_cameras_have_reported():
    clocks = CameraClocks(["left", "right"])
    now = time.time_ns()
    assert not clocks.report("left", now)
    assert not clocks.report("right", None)
    assert clocks.report("right", now)
    assert clocks.report("left", None)
    assert 0 <= clocks.time_s(now) < 60


@pytest.mark.parametrize(("late_s", "words"), [(60, "60.0 s behind this machine's"), (-3, "3.0 s ahead of")])
def test_a_clock_that_is_wrong_is_told_to_whoever_reads(late_s, words, monkeypatch):
    now_ns = time.time_ns()
    monkeypatch.setattr(camera_clocks.time, "time_ns", lambda: now_ns)
    clocks = CameraClocks(["left", "right"])
    for name, taken_ns in (("left", now_ns - round(late_s * 1e9)), ("right", None)):
        with pytest.raises(VideoError, match=f"camera left: its clock is {re.escape(words)}"):
            clocks.report(name, taken_ns)
