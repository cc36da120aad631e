"""When pictures of a stream were taken: told by the RTCP reports of a real RTSP server, GStreamer's."""

import time

import numpy as np
import pytest

from testbed.rtsp import encode, filming, has_server
from tests.worker.video.numbered_pictures import number_shown, picture_of
from worker.video.clips import Clip
from worker.video.stream_clock import Lateness

pytestmark = pytest.mark.slow

RATE = 25
# The first report comes within some three seconds.
COUNT = 150


def test_a_stream_tells_when_its_pictures_were_taken_once_its_camera_has_reported(tmp_path, missing):
    if not has_server():
        missing("gstreamer")
    shots = {}
    encode(map(picture_of, range(COUNT)), RATE, 500_000, tmp_path / "clip")
    with filming([tmp_path / "clip"], RATE) as cameras:
        with Clip.open("left", *cameras.addresses, time.monotonic()) as clip:
            clip.decode_without_delay()
            for shot in clip.shots():
                shots[number_shown(shot.picture)] = shot
                if len(shots) == COUNT:
                    break
        cameras.process.kill()
        taken_ns = {taken.number: taken.at_ns for taken in cameras.taken()}
    off_ms = [abs(shot.taken_ns - taken_ns[number]) / 1e6 for number, shot in shots.items() if shot.taken_ns]
    assert shots[0].taken_ns is None
    assert len(off_ms) > 20
    assert np.median(off_ms) < 2
    assert max(off_ms) < 20


@pytest.mark.parametrize("camera_runs", [1.0, 1.0005, 0.9995])
def test_a_picture_is_late_beside_the_promptest_ones_whatever_clocks_do(camera_runs):
    lateness, hours = Lateness(), np.arange(0.0, 3 * 3600.0, 1.0)
    late = [lateness.of(camera_runs * at, at + 0.2) for at in hours]
    assert max(late) < 0.01
    assert lateness.of(camera_runs * 3 * 3600, 3 * 3600 + 2.2) == pytest.approx(2.0, abs=0.01)
