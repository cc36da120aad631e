"""Cameras that are followed while they film: what is told of a picture, and what happens when a stream breaks off."""

import queue
import shutil
import socket
import subprocess
import time
from contextlib import contextmanager

import numpy as np
import pytest

from tests.worker.calibration.synthetic import CROWNED, moved, pair
from tests.worker.video.shaking import COUNT, film_shaking, turn
from worker.calibration.geometry import derivatives
from worker.calibration.geometry.rotation import rotation_angles_deg
from worker.video import clips
from worker.video.live_tracking import LiveCamera

pytestmark = pytest.mark.slow

TRUE = pair()[0]
STORED = moved(TRUE, (0.0008, -0.0005, 0.0003), (0.005, 0.004, -0.005))


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    return film_shaking(tmp_path_factory.mktemp("shaking"))[TRUE.id]


class Following:
    """A camera while it is followed, with all that is told of it."""

    def __init__(self, address, stored=STORED):
        self.told, self.complaints = queue.Queue(), queue.Queue()
        self.camera = LiveCamera(CROWNED, stored, address, 1, self.told.put, self.complaints.put)

    def __enter__(self):
        self.camera.start()
        return self

    def __exit__(self, *_):
        self.camera.stop()


def turned_deg(one, other):
    return rotation_angles_deg(one.pose.rotation, other.pose.rotation)


def test_the_pose_of_each_picture_that_was_looked_at_is_told(clip):
    with Following(clip) as following:
        first = following.told.get(timeout=60)
        told = [first]
        # A file is read faster than it is looked at: pictures in between are left out.
        while told[-1].number < COUNT - 1:
            told.append(following.told.get(timeout=60))
    numbers = [pose.number for pose in told]
    assert numbers == sorted(set(numbers))
    for pose in told:
        swung = derivatives.moved(TRUE, np.array([*turn(pose.number, 0.0), 0, 0, 0]))
        assert turned_deg(pose.followed.camera, swung) < 0.02
        assert abs(pose.arrived_ns / 1e9 - time.time()) < 60
    assert {pose.rate for pose in told} == {25}


def test_a_stream_that_has_ended_is_opened_again(clip):
    with Following(clip) as following:
        assert "its stream has ended; it is opened again" in following.complaints.get(timeout=60)
        while following.told.get(timeout=60).number != 0:
            pass
        again = following.told.get(timeout=60)
        while again.number != 0:
            again = following.told.get(timeout=60)
    assert again.followed.how == "measured"


def test_a_camera_whose_lines_are_elsewhere_is_not_told_of(clip):
    with Following(clip, stored=moved(TRUE, (0.0, 0.2, 0.0))) as following:
        assert "its lines are not seen near where the stored pose expects them" in following.complaints.get(timeout=60)
        assert following.told.empty()


def test_a_new_stored_pose_begins_anew_from_there(clip):
    with Following(clip) as following:
        following.told.get(timeout=60)
        following.camera.anchor(moved(TRUE, (0.0002, 0.0, 0.0)))
        poses = [following.told.get(timeout=60) for _ in range(4)]
    assert all(turned_deg(pose.followed.camera, TRUE) < 1.0 for pose in poses)


@contextmanager
def streamed(clip, port):
    """The clip sent by UDP again and again, at the rate at which it was filmed."""
    command = ["ffmpeg", "-loglevel", "error", "-re", "-stream_loop", "-1", "-i", clip, "-c:v", "libx264", "-preset"]
    command += ["ultrafast", "-tune", "zerolatency", "-g", "5", "-f", "mpegts", f"udp://127.0.0.1:{port}"]
    with subprocess.Popen(command) as process:
        try:
            yield
        finally:
            process.kill()


def test_a_live_stream_is_followed_and_again_after_it_was_cut(clip, missing, monkeypatch):
    if shutil.which("ffmpeg") is None:
        missing("ffmpeg")
    monkeypatch.setattr(clips, "WAITING_S", 1.0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with Following(f"udp://127.0.0.1:{port}") as following:
        with streamed(clip, port):
            assert following.told.get(timeout=60).followed.how == "measured"
        assert "it is opened again" in following.complaints.get(timeout=60)
        while not following.told.empty():
            following.told.get()
        with streamed(clip, port):
            assert following.told.get(timeout=60).followed.how == "measured"
