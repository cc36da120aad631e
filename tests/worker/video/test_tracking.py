"""A shaking rig becomes a still picture, and where it was is told for each of them."""

import numpy as np
import pytest

from testbed.synthetic import CROWNED, moved, pair
from tests.worker.video.filming import frames_of
from tests.worker.video.shaking import COUNT, film_shaking, turn
from worker.calibration.geometry import derivatives
from worker.calibration.geometry.rotation import rotation_angles_deg
from worker.calibration.stitching.panorama import BACKDROP
from worker.calibration.stitching.photometry import NEUTRAL
from worker.calibration.stitching.views import ViewChoice
from worker.video.encoding import Encoding
from worker.video.errors import VideoError
from worker.video.stitch import Offset, Plan, StaticGeometry, StitchScene, stitch
from worker.video.tracking import TrackedGeometryFactory

pytestmark = pytest.mark.slow

STORED = [moved(camera, (0.0008, -0.0005, 0.0003), (0.005, 0.004, -0.005)) for camera in pair()]
SCENE = StitchScene(CROWNED, STORED, ViewChoice(width=640), {camera.id: NEUTRAL for camera in STORED})
TOGETHER = {"right": Offset(0)}
FINE = Encoding(crf=8, preset="ultrafast")


def told(*_):
    pass


def unrest(path):
    """How much pictures differ from their median over time, where that shows lines: rms in grey levels."""
    pictures = np.array(frames_of(path), dtype=float)[..., 1]
    usual = np.median(pictures, axis=0)
    lines = np.hypot(*np.gradient(usual)) > 8
    return float(np.sqrt(np.mean((pictures - usual)[:, lines] ** 2)))


@pytest.mark.long
def test_the_view_of_a_shaking_rig_stands_still(tmp_path):
    moments, clips = [], film_shaking(tmp_path)
    following = TrackedGeometryFactory(1, lambda moment, rate: moments.append((moment, rate)))
    for name, follow in (("shaking", StaticGeometry), ("still", following)):
        made = stitch(SCENE, clips, Plan(str(tmp_path / f"{name}.mp4"), TOGETHER, encoding=FINE), told, follow)
        assert made.frames == COUNT
    following.finish()
    # No hole where the borders of frames are not shown: the view is a little lower.
    first = frames_of(tmp_path / "still.mp4")[0]
    assert len(first) < len(frames_of(tmp_path / "shaking.mp4")[0])
    edges = (first[0], first[-1], first[:, 0], first[:, -1])
    assert all(np.mean(np.abs(edge.astype(int) - BACKDROP).max(axis=-1) < 4) < 0.02 for edge in edges)
    assert unrest(tmp_path / "still.mp4") < 0.25 * unrest(tmp_path / "shaking.mp4")

    assert [moment.number for moment, _ in moments] == list(range(COUNT))
    assert {rate for _, rate in moments} == {25}
    for moment, _ in moments:
        for now, still, phase in zip(moment.cameras, pair(), (0.0, 1.5), strict=True):
            true = derivatives.moved(still, np.append(turn(moment.number, phase), np.zeros(3)))
            assert rotation_angles_deg(now.camera.pose.rotation, true.pose.rotation) < 0.03
            assert now.camera.distance_m(true) < 0.04
    assert following.motions["left"].how == {"measured": COUNT}
    assert 0.4 < following.motions["left"].farthest_deg < 1.2


def test_clips_that_do_not_show_what_the_poses_say_are_refused(tmp_path):
    clips, view = film_shaking(tmp_path, count=2), tmp_path / "view.mp4"
    elsewhere = [moved(camera, (0.0, 0.2, 0.0)) for camera in STORED]
    scene = StitchScene(CROWNED, elsewhere, SCENE.choice, SCENE.lights)
    with pytest.raises(VideoError, match=r"--follow: The first frame of camera \w+ does not show its lines"):
        stitch(scene, clips, Plan(str(view), TOGETHER), told, TrackedGeometryFactory(1))
    assert not list(tmp_path.glob("*view*"))
