"""What happens to cameras while they are tracked: pictures that stay away, freeze or show something else, by RTSP."""

import numpy as np
import pytest

from testbed.rtsp import encode, filming, has_server
from testbed.synthetic import CROWNED, moved, paint_markings, pair_frames
from tests.worker.video.test_live_tracking import TRUE, Tracking, turned_deg
from worker.video import clips, live_tracking

pytestmark = pytest.mark.slow

RATE, COUNT, BITS = 5, 10, 8_000_000
# By less it would be found by its lines from where it was.
KNOCKED = moved(TRUE, (0.0, 0.2, 0.0))


@pytest.fixture(scope="module")
def films(tmp_path_factory):
    """What the camera films where it is stored, and after a knock."""
    folder = tmp_path_factory.mktemp("films")
    knocked = np.clip(100 + 130 * paint_markings(CROWNED, KNOCKED), 0, 255)[..., None].repeat(3, axis=2)
    for name, picture in (("still", pair_frames()[0]), ("knocked", knocked)):
        rng = np.random.default_rng(0)
        noisy = (np.clip(picture + rng.normal(0, 2, picture.shape), 0, 255).astype(np.uint8) for _ in range(COUNT))
        encode(noisy, RATE, BITS, folder / name)
    return folder


@pytest.fixture
def camera(films, missing, monkeypatch):
    """Cameras of which the first films, and its tracking, which has begun."""
    if not has_server():
        missing("gstreamer")
    monkeypatch.setattr(clips, "WAITING_S", 2.0)
    with filming([films / "still"], RATE) as cameras, Tracking(*cameras.addresses) as tracking:
        assert measured(tracking)
        yield cameras, tracking


def measured(tracking):
    """The next pose that was measured."""
    pose = tracking.pose_of(lambda pose: pose.tracked.how == "measured")
    assert turned_deg(pose.tracked.camera, TRUE) < 0.1
    return pose


def said(tracking, words):
    """Wait until it is said."""
    while words not in tracking.warnings.get(timeout=90):
        pass


def forget(tracking):
    """What was reported so far."""
    while not tracking.poses.empty():
        tracking.poses.get()


@pytest.mark.long
def test_a_camera_whose_pictures_stay_away_or_whose_connection_breaks_is_tracked_again(camera):
    cameras, tracking = camera
    cameras.happen("pull", 0)
    said(tracking, "its stream has ended; it is opened again")
    forget(tracking)
    cameras.happen("mend", 0)
    measured(tracking)
    cameras.happen("cut", 0)
    said(tracking, "its stream has ended; it is opened again")
    forget(tracking)
    measured(tracking)


@pytest.mark.long
def test_a_frozen_picture_is_not_measured_until_it_moves_again(camera):
    cameras, tracking = camera
    cameras.happen("freeze", 0)
    said(tracking, "its picture is frozen")
    forget(tracking)
    cameras.happen("mend", 0)
    measured(tracking)


@pytest.mark.long
def test_a_camera_that_was_knocked_is_lost_and_never_said_to_be_measured_where_it_is_not(camera, films):
    cameras, tracking = camera
    cameras.happen("clip", 0, films / "knocked")
    said(tracking, "its lines are not seen near where the stored pose expects them")
    assert tracking.camera.unseen_s > live_tracking.LOST_AFTER_S
    assert tracking.camera.newest_frame().shape == (540, 960, 3)
    poses = list(tracking.poses.queue)
    assert all(turned_deg(pose.tracked.camera, TRUE) < 0.1 for pose in poses if pose.tracked.how == "measured")
    cameras.happen("clip", 0, films / "still")
    forget(tracking)
    measured(tracking)
    assert tracking.camera.unseen_s < live_tracking.LOST_AFTER_S
