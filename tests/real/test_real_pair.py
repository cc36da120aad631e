"""The engine with the real network on real frames."""

import cv2
import pytest

from service.settings import MODEL_BESIDE_THE_CODE
from worker.calibration.calibrate import calibrate
from worker.calibration.detection.segmentation import Segmenter
from worker.calibration.records import Options

pytestmark = pytest.mark.real


@pytest.fixture(scope="module")
def segmenter():
    return Segmenter(MODEL_BESIDE_THE_CODE, threads=1)


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
    # Half as large: what is searched for in vain takes long.
    frames = {
        name: (cv2.resize(one, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA),)
        for name, (one,) in real_pair.frames().items()
    }
    cameras = [camera.with_lens(camera.intrinsics.scaled(0.5)) for camera in real_pair.started("near", 0)]
    swapped = {"left": frames["right"], "right": frames["left"]}
    found = calibrate(real_pair.pitch, cameras, swapped, segmenter, Options(seed=0, generations=25))
    assert found.rejected_because is not None
    assert "camera" in found.rejected_because
