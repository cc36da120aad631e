"""Cameras that are tracked while they film: what is reported, and what happens when a stream breaks off."""

import queue
import time
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from testbed.running import wait_for
from testbed.synthetic import CROWNED, moved, pair
from tests.worker.video.shaking import COUNT, RATE, film_left, turn
from worker.calibration.geometry import derivatives
from worker.calibration.geometry.rotation import rotation_angles_deg
from worker.calibration.tracking.follower import CameraTracker, TrackedPose
from worker.video import clips, live_tracking
from worker.video.live_tracking import UNSURE_DEG, StreamTracker, _ArrivedPicture
from worker.video.stream_clock import StreamClock

pytestmark = pytest.mark.slow

TRUE = pair()[0]
STORED = moved(TRUE, (0.0008, -0.0005, 0.0003), (0.005, 0.004, -0.005))


@pytest.fixture(scope="module")
def clip(tmp_path_factory):
    return film_left(tmp_path_factory.mktemp("shaking"))


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

    def pose_of(self, reached):
        """The first pose from now on of which that is true."""
        while not reached(pose := self.poses.get(timeout=60)):
            pass
        return pose


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


@pytest.mark.long
def test_a_camera_that_took_long_to_be_found_is_tracked_on_from_there(clip, monkeypatch):
    found, shots = [], clips.Clip.shots
    monkeypatch.setattr(
        clips.Clip, "shots", lambda *at: (replace(shot, time_s=10 * shot.time_s) for shot in shots(*at))
    )
    monkeypatch.setattr(live_tracking, "CameraTracker", lambda *of: found.append(of) or CameraTracker(*of))
    with Tracking(clip) as tracking:
        pose = tracking.pose_of(lambda pose: pose.number >= COUNT - 1)
    assert len(found) == 1
    assert pose.tracked.how == "measured"
    assert turned_deg(pose.tracked.camera, swung(pose.number)) < 0.02


@pytest.mark.long
def test_a_camera_is_measured_in_a_picture_before_which_none_was_decoded_for_a_second(clip, monkeypatch):
    shots = clips.Clip.shots
    monkeypatch.setattr(clips.Clip, "shots", lambda *at: (s for n, s in enumerate(shots(*at)) if n in (0, COUNT - 1)))
    monkeypatch.setattr(StreamClock, "taken_ns", lambda *_: time.time_ns() - 10**9)
    with Tracking(clip) as tracking:
        pose = tracking.pose_of(lambda pose: pose.number >= 1)
    assert (pose.tracked.how, pose.clock) == ("measured", "rtcp")
    assert turned_deg(pose.tracked.camera, swung(COUNT - 1)) < 0.02


def swung(number):
    return derivatives.moved(TRUE, np.array([*turn(number, 0.0), 0, 0, 0]))


def reported(*ages_s, ahead_s=0.0):
    """The poses and remarks by pictures, one a second, that arrive so long after their camera says they were taken."""
    tracking, known = Tracking("", ahead_s=ahead_s), TrackedPose(TRUE, "measured", np.eye(6), np.eye(6))
    for number, age_s in enumerate(ages_s):
        arrived_ns = (1_800_000_000 + number) * 10**9
        taken_ns = arrived_ns - round(age_s * 1e9)
        picture = _ArrivedPicture(None, number, float(number), 0.0, taken_ns, arrived_ns, True, False)
        tracking.camera._report(known, picture, Fraction(25))
    return list(tracking.poses.queue), list(tracking.remarks.queue)


def test_times_of_poses_are_those_of_the_cameras_clock_while_that_is_right():
    poses, (wrong, right) = reported(1.0, 3600.0, 3600.0, 0.1)
    assert [pose.clock for pose in poses] == ["rtcp", "arrival", "arrival", "rtcp"]
    assert [(pose.arrived_ns - pose.at_ns) / 1e9 for pose in poses] == [1.0, 0.0, 0.0, 0.1]
    assert "its clock is 3600.0 s behind" in wrong
    assert "its clock is right again" in right


def test_a_clock_that_is_set_is_said():
    _, (remark,) = reported(0.1, 1.6)
    assert "its clock was set back by 1.5 s" in remark


def test_a_pose_that_is_told_ahead_is_of_a_time_after_its_picture():
    (pose,), _ = reported(0.0, ahead_s=0.12)
    assert pose.at_ns - pose.arrived_ns == 120_000_000


def test_a_frozen_picture_is_said_and_measured_once(clip, monkeypatch):
    shots = clips.Clip.shots

    def frozen_at_the_end(*at):
        for shot in shots(*at):
            yield shot
        for number in range(1, 60):
            yield replace(shot, time_s=shot.time_s + number / RATE)

    monkeypatch.setattr(clips.Clip, "shots", frozen_at_the_end)
    with Tracking(clip) as tracking:
        assert "its picture is frozen" in tracking.warnings.get(timeout=60)
        poses = list(tracking.poses.queue)
    # The first of them may have taken the place of one that showed something new.
    frozen = [pose.tracked.how for pose in poses if pose.number >= COUNT][1:]
    assert set(frozen) <= {"coasted"}


def test_a_stream_that_has_ended_is_opened_again(clip):
    with Tracking(clip) as tracking:
        assert "its stream has ended; it is opened again" in tracking.warnings.get(timeout=60)
        _, again = (tracking.pose_of(lambda pose: pose.number == 0) for _ in range(2))
    assert again.tracked.how == "measured"


def test_lines_that_do_not_fit_the_stored_lens_are_said_and_the_pose_counts_as_lost(clip):
    with Tracking(clip, stored=zoomed(STORED, 1 / 1.02)) as tracking:
        assert "its lines do not fit well" in tracking.remarks.get(timeout=60)
        assert tracking.poses.get(timeout=60).tracked.sigma.rotation_deg > UNSURE_DEG
        # Between the end of the clip and its beginning there is no picture to count by.
        wait_for(lambda: tracking.camera.unseen_s > 0)


def zoomed(camera, by):
    matrix = camera.intrinsics.matrix.copy()
    matrix[[0, 1], [0, 1]] *= by
    return camera.with_lens(replace(camera.intrinsics, matrix=matrix))


@pytest.mark.long
def test_a_camera_whose_lines_are_elsewhere_is_not_told_of(clip):
    with Tracking(clip, stored=moved(TRUE, (0.0, 0.2, 0.0))) as tracking:
        assert "its lines are not seen near where the stored pose expects them" in tracking.warnings.get(timeout=60)
        assert tracking.poses.empty()


def test_a_new_stored_pose_begins_anew_from_there(clip):
    with Tracking(clip) as tracking:
        tracking.poses.get(timeout=60)
        tracking.camera.anchor(moved(TRUE, (0.0002, 0.0, 0.0)))
        poses = [tracking.poses.get(timeout=60) for _ in range(2)]
    assert all(turned_deg(pose.tracked.camera, TRUE) < 1.0 for pose in poses)
