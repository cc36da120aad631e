"""When pictures of a stream were taken: told by the RTCP reports of a real RTSP server, GStreamer's."""

import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from worker.video.clips import Clip

WIDTH, BITS = 256, 16
# The Python that Debian's python3-gi is for.
PYTHON = Path("/usr/bin/python3")
HAS_SERVER = """
import gi
gi.require_version("GstRtspServer", "1.0")
from gi.repository import Gst, GstRtspServer
Gst.init(None)
exit(not all(Gst.ElementFactory.find(name) for name in ("x264enc", "rtph264pay")))
"""
# A report comes every five seconds or sooner.
REPORTED_AFTER = 150


@pytest.fixture
def server(missing):
    if not PYTHON.exists() or subprocess.run([PYTHON, "-c", HAS_SERVER], capture_output=True).returncode:
        missing("gstreamer")
    program = Path(__file__).with_name("rtsp_server.py")
    with subprocess.Popen([PYTHON, program, str(WIDTH), str(BITS)], stdout=subprocess.PIPE, text=True) as process:
        try:
            yield process
        finally:
            process.kill()


def number_shown(picture):
    luma, _, _ = picture.planes
    stripes = np.median(luma, axis=0).reshape(BITS, WIDTH // BITS).mean(axis=1)
    return int(sum(1 << bit for bit in np.flatnonzero(stripes > 126)))


def test_a_stream_tells_when_its_pictures_were_taken_once_its_camera_has_reported(server):
    port, shots = int(server.stdout.readline()), {}
    with Clip.open("left", f"rtsp://127.0.0.1:{port}/camera", time.monotonic()) as clip:
        clip.decode_without_delay()
        for shot in clip.shots():
            shots[number_shown(shot.picture)] = shot
            if len(shots) == REPORTED_AFTER:
                break
    server.kill()
    printed = (line.split() for line in server.stdout)
    taken_ns = {int(number): int(time_ns) for number, time_ns in printed}
    off_ms = [abs(shot.taken_ns - taken_ns[number]) / 1e6 for number, shot in shots.items() if shot.taken_ns]
    assert shots[0].taken_ns is None
    assert len(off_ms) > 20
    assert np.median(off_ms) < 2
    assert max(off_ms) < 20
