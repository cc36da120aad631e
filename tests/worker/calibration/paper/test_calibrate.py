"""The paper's method on painted frames: judged as any other, and left where its search ends."""

from functools import cache

import numpy as np
import pytest

from testbed.synthetic import CROWNED
from tests.worker.calibration.outdated_pair import frames, outdated, white_on_green
from worker.calibration.paper.calibrate import PRESETS, calibrate_by_paper
from worker.calibration.records import Options, Recorder

pytestmark = pytest.mark.slow

FEW = Options(seed=3, generations=3, parents=4, offspring=4)


class BestOfLevels(Recorder):
    """Keeps the best cameras of each level."""

    def __init__(self):
        self.of_levels = []

    def searched(self, cameras, level, genomes, best):
        self.of_levels.append(best)


@cache
def calibrated(preset):
    recorder = BestOfLevels()
    found = calibrate_by_paper(PRESETS[preset], CROWNED, outdated(), frames(), white_on_green, FEW, recorder=recorder)
    return found, recorder


@pytest.mark.long
@pytest.mark.parametrize("preset", PRESETS)
def test_every_camera_is_left_where_the_search_ends(preset):
    found, recorder = calibrated(preset)
    assert (found.generations, found.path) == (FEW.generations, "wide")
    assert len(recorder.of_levels) == len(PRESETS[preset].levels)
    for result, best in zip(found.cameras, recorder.of_levels[-1], strict=True):
        np.testing.assert_array_equal(result.camera.pose.rotation, best.pose.rotation)
        np.testing.assert_array_equal(result.camera.pose.position, best.pose.position)


@pytest.mark.long
def test_its_predecessor_takes_the_ground_for_a_plane():
    assert calibrated("paper")[0].pitch.ridge is not None
    assert calibrated("scpr")[0].pitch.ridge is None


@pytest.mark.long
def test_a_black_frame_leaves_its_camera_at_the_stored_pose():
    left, right = frames()["left"], (np.zeros_like(frames()["right"][0]),)
    found = calibrate_by_paper(
        PRESETS["paper"], CROWNED, outdated(), {"left": left, "right": right}, white_on_green, FEW
    )
    assert found.cameras[1].rejected_because.startswith("Dark")
    np.testing.assert_array_equal(found.cameras[1].camera.pose.position, outdated()[1].pose.position)


@pytest.mark.long
def test_black_frames_alone_are_searched_for_by_nobody():
    dark = {name: (np.zeros_like(several[0]),) for name, several in frames().items()}
    found = calibrate_by_paper(PRESETS["paper"], CROWNED, outdated(), dark, white_on_green, FEW)
    assert (found.generations, found.loss, found.verdict) == (0, float("inf"), "rejected")
