"""Cameras that are tracked while they film: what is reported, and what happens when a stream breaks off."""

import queue
import shutil
import socket
import subprocess
import time
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from testbed.ports import free_port
from testbed.synthetic import CROWNED, moved, pair
from tests.worker.video.shaking import COUNT, film_shaking, turn
from worker.calibration.geometry import derivatives
from worker.calibration.geometry.rotation import rotation_angles_deg
from worker.calibration.tracking.follower import CameraTracker
from worker.video import clips, live_tracking
from worker.video.live_tracking import UNSURE_DEG, StreamTracker
from worker.video.stream_clock import StreamClock

pytestmark = pytest.mark.slow

TRUE = pair()[0]
STORED = moved(TRUE, (0.0008, -0.0005, 0.0003), (0.005, 0.004, -0.005))


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    return film_shaking(tmp_path_factory.mktemp("shaking"))[TRUE.id]


class Tracking:
    """A camera while it is tracked, with all that it reports."""

    def __init__(self, address, stored=STORED, ahead_s=0.0):
        self.poses, self.warnings = queue.Queue(), queue.Queue()
        self.remarks = queue.Queue()
        self.camera = StreamTracker(
            CROWNED, stored, address, 1, self.poses.put, self.warnings.put, self.remarks.put, ahead_s
        )

    def __enter__(self):
        self.camera.start()
        return self

    def __exit__(self, *_):
        self.camera.stop()


def turned_deg(one, other):
    return rotation_angles_deg(one.pose.rotation, other.pose.rotation)


def test_the_pose_of_each_picture_that_was_looked_at_is_reported(clip):
    with Tracking(clip) as tracking:
        first = tracking.poses.get(timeout=60)
        poses = [first]
        # A file is read faster than it is looked at: pictures in between are left out.
        while poses[-1].number < COUNT - 1:
            poses.append(tracking.poses.get(timeout=60))
    numbers = [pose.number for pose in poses]
    assert numbers == sorted(set(numbers))
    for pose in poses:
        assert turned_deg(pose.tracked.camera, swung(pose.number)) < 0.02
        assert abs(pose.arrived_ns / 1e9 - time.time()) < 60
        assert (pose.at_ns, pose.clock) == (pose.arrived_ns, "arrival")
    assert {pose.rate for pose in poses} == {25}


def test_a_camera_that_took_long_to_be_found_is_tracked_on_from_there(clip, monkeypatch):
    found, shots = [], clips.Clip.shots
    monkeypatch.setattr(
        clips.Clip, "shots", lambda *at: (replace(shot, time_s=10 * shot.time_s) for shot in shots(*at))
    )
    monkeypatch.setattr(live_tracking, "CameraTracker", lambda *of: found.append(of) or CameraTracker(*of))
    with Tracking(clip) as tracking:
        while (pose := tracking.poses.get(timeout=60)).number < COUNT - 1:
            pass
    assert len(found) == 1
    assert pose.tracked.how == "measured"
    assert turned_deg(pose.tracked.camera, swung(pose.number)) < 0.02


def test_a_camera_is_measured_in_a_picture_before_which_none_was_decoded_for_a_second(clip, monkeypatch):
    shots = clips.Clip.shots
    monkeypatch.setattr(clips.Clip, "shots", lambda *at: (s for n, s in enumerate(shots(*at)) if n in (0, COUNT - 1)))
    with Tracking(clip) as tracking:
        while (pose := tracking.poses.get(timeout=60)).number < 1:
            pass
    assert pose.tracked.how == "measured"
    assert turned_deg(pose.tracked.camera, swung(COUNT - 1)) < 0.02


def swung(number):
    return derivatives.moved(TRUE, np.array([*turn(number, 0.0), 0, 0, 0]))


def test_a_pose_that_is_told_ahead_is_of_a_time_after_its_picture(clip):
    with Tracking(clip, ahead_s=0.12) as tracking:
        pose = tracking.poses.get(timeout=60)
    assert pose.at_ns - pose.arrived_ns == 120_000_000


def test_times_of_a_camera_whose_clock_is_wrong_are_not_taken_over(clip, monkeypatch):
    monkeypatch.setattr(StreamClock, "taken_ns", lambda *_: time.time_ns() - 3600 * 10**9)
    with Tracking(clip) as tracking:
        pose = tracking.poses.get(timeout=60)
        assert (pose.clock, pose.at_ns) == ("arrival", pose.arrived_ns)
        assert "its clock is 3600" in tracking.remarks.get(timeout=60)


def test_times_of_a_camera_whose_clock_is_right_are_those_of_its_poses(clip, monkeypatch):
    monkeypatch.setattr(StreamClock, "taken_ns", lambda *_: time.time_ns() - 10**9)
    with Tracking(clip) as tracking:
        pose = tracking.poses.get(timeout=60)
    assert pose.clock == "rtcp"
    assert 1.0 <= (pose.arrived_ns - pose.at_ns) / 1e9 < 2.0


def test_a_clock_that_is_set_is_said(clip, monkeypatch):
    # A file is not read at the rate of its pictures.
    monkeypatch.setattr(live_tracking, "LATEST_S", 1000.0)
    begin_ns = time.time_ns() - 5 * 10**9

    def taken_ns(_, pts, time_base):
        stream_s = float(pts * time_base)
        return begin_ns + int(1e9 * (stream_s - 2 * (stream_s > 0.4)))

    monkeypatch.setattr(StreamClock, "taken_ns", taken_ns)
    with Tracking(clip) as tracking:
        assert "its clock was set back by 2.0 s" in tracking.remarks.get(timeout=60)


def test_a_frozen_picture_is_said_and_measured_once(tmp_path):
    clip = film_shaking(tmp_path, frozen_for=150)[TRUE.id]
    with Tracking(clip) as tracking:
        assert "its picture is frozen" in tracking.warnings.get(timeout=60)
        poses = list(tracking.poses.queue)
    # The first of them may have taken the place of one that showed something new, and the encoder mends its
    # last picture for a while.
    frozen = [pose.tracked.how for pose in poses if pose.number >= COUNT + 25][1:]
    assert set(frozen) <= {"coasted"}


def test_a_stream_that_has_ended_is_opened_again(clip):
    with Tracking(clip) as tracking:
        assert "its stream has ended; it is opened again" in tracking.warnings.get(timeout=60)
        while tracking.poses.get(timeout=60).number != 0:
            pass
        again = tracking.poses.get(timeout=60)
        while again.number != 0:
            again = tracking.poses.get(timeout=60)
    assert again.tracked.how == "measured"


def test_lines_that_do_not_fit_the_stored_lens_are_said_and_the_pose_counts_as_lost(clip):
    with Tracking(clip, stored=zoomed(STORED, 1 / 1.02)) as tracking:
        assert "its lines do not fit well" in tracking.remarks.get(timeout=60)
        assert tracking.poses.get(timeout=60).tracked.sigma.rotation_deg > UNSURE_DEG
        assert tracking.camera.unseen_s > 0


def zoomed(camera, by):
    matrix = camera.intrinsics.matrix.copy()
    matrix[[0, 1], [0, 1]] *= by
    return camera.with_lens(replace(camera.intrinsics, matrix=matrix))


def test_a_camera_whose_lines_are_elsewhere_is_not_told_of(clip):
    with Tracking(clip, stored=moved(TRUE, (0.0, 0.2, 0.0))) as tracking:
        assert "its lines are not seen near where the stored pose expects them" in tracking.warnings.get(timeout=60)
        assert tracking.poses.empty()


def test_a_new_stored_pose_begins_anew_from_there(clip):
    with Tracking(clip) as tracking:
        tracking.poses.get(timeout=60)
        tracking.camera.anchor(moved(TRUE, (0.0002, 0.0, 0.0)))
        poses = [tracking.poses.get(timeout=60) for _ in range(4)]
    assert all(turned_deg(pose.tracked.camera, TRUE) < 1.0 for pose in poses)


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


def test_a_live_stream_is_tracked_and_again_after_it_was_cut(clip, missing, monkeypatch):
    if shutil.which("ffmpeg") is None:
        missing("ffmpeg")
    monkeypatch.setattr(clips, "WAITING_S", 1.0)
    port = free_port(socket.SOCK_DGRAM)
    with Tracking(f"udp://127.0.0.1:{port}") as tracking:
        with streamed(clip, port):
            assert tracking.poses.get(timeout=60).tracked.how == "measured"
        assert "it is opened again" in tracking.warnings.get(timeout=60)
        while not tracking.poses.empty():
            tracking.poses.get()
        with streamed(clip, port):
            assert tracking.poses.get(timeout=60).tracked.how == "measured"
