"""The engine with the real network on real frames."""

import pytest

from service.settings import MODEL_BESIDE_THE_CODE
from worker.calibration.calibrate import calibrate
from worker.calibration.records import Options
from worker.calibration.see.segmentation import Segmenter

pytestmark = pytest.mark.real


@pytest.fixture(scope="module")
def segmenter():
    return Segmenter(MODEL_BESIDE_THE_CODE, threads=2)


@pytest.mark.parametrize(("kind", "number", "moment"), [("near", 1, "125"), ("paper", 1, "000")])
def test_outdated_poses_of_real_cameras_are_found_again(real_pair, segmenter, kind, number, moment):
    found = calibrate(
        real_pair.pitch, real_pair.started(kind, number), real_pair.frames(moment), segmenter, Options(seed=number)
    )
    assert found.rejected_because is None
    for result in found.cameras:
        assert real_pair.clicked_rms(result.camera.id, result.camera.pose) < 5
    assert found.stitch_error_px < 1


def test_frames_of_swapped_cameras_are_rejected(real_pair, segmenter):
    frames = real_pair.frames()
    swapped = {"left": frames["right"], "right": frames["left"]}
    found = calibrate(
        real_pair.pitch, real_pair.started("near", 0), swapped, segmenter, Options(seed=0, generations=25)
    )
    assert found.rejected_because is not None
    assert "camera" in found.rejected_because
