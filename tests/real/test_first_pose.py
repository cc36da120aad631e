"""From a board's photos and clicked points alone to poses that a calibration accepts, on real cameras."""

from functools import cache

import cv2
import numpy as np
import pytest

from service.settings import MODEL_BESIDE_THE_CODE
from tests.real.pair import FOLDER
from worker.calibration.calibrate import calibrate
from worker.calibration.first.boards import Board, find_board
from worker.calibration.first.clicks import Clicks
from worker.calibration.first.first_pose import first_pose
from worker.calibration.first.lens_calibration import Photo, calibrate_lens
from worker.calibration.records import Options
from worker.calibration.see.segmentation import Segmenter

pytestmark = pytest.mark.real
BOARD = Board(9, 5, 0.1)
EXCHANGED = (3, 10)


@cache
def lens(side):
    photos = []
    for path in sorted((FOLDER / "checkerboard" / side).glob("*.jpg")):
        grey = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
        photos.append(Photo(path.name, (grey.shape[1], grey.shape[0]), find_board(grey, BOARD)))
    return calibrate_lens(photos, "opencv")


def clicks(pair, side):
    world = np.array([click["world"] for click in pair.clicks[side]], dtype=float)
    pixel = np.array([click["pixel"] for click in pair.clicks[side]])
    return Clicks(tuple(str(click["world"]) for click in pair.clicks[side]), pair.pitch.lift(world), pixel)


@pytest.fixture(scope="module")
def located(real_pair):
    """The first pose of each camera, from clicks two of which have each other's label."""
    return {
        side: first_pose(clicks(real_pair, side).swapped(*EXCHANGED), lens(side).lens, real_pair.pitch.places(), side)
        for side in ("left", "right")
    }


@pytest.mark.parametrize(("side", "bare"), [("left", "right"), ("right", "left")])
def test_the_board_is_told_to_have_missed_half_of_the_picture(real_pair, side, bare):
    found = lens(side)
    assert found.rms_px < 1
    assert bare in found.coverage.empty
    assert "principal point" in found.warnings[0]


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_exchanged_labels_are_named(real_pair, located, side):
    names = clicks(real_pair, side).names
    exchanged = {c.name: c.exchanged_with for c in located[side].clicks if c.exchanged_with}
    assert exchanged == {names[EXCHANGED[0]]: names[EXCHANGED[1]], names[EXCHANGED[1]]: names[EXCHANGED[0]]}


def test_the_wrong_principal_point_of_the_right_camera_is_found(located):
    found = located["right"]
    before, after = lens("right").lens.matrix, found.camera.intrinsics.matrix
    assert np.linalg.norm(after[:2, 2] - before[:2, 2]) > 150
    # The folder's own fit of both cameras and the roof together has (1516, 877).
    assert np.linalg.norm(after[:2, 2] - [1515.9, 876.6]) < 40
    assert found.lens.before.rms_px > 5 * found.lens.after.rms_px
    assert found.lens.left_out_px < found.lens.left_out_before_px / 3


def test_a_calibration_accepts_the_first_poses_and_ends_at_the_clicked_points(real_pair, located):
    cameras = [located[side].camera for side in ("left", "right")]
    found = calibrate(
        real_pair.pitch, cameras, real_pair.frames(), Segmenter(MODEL_BESIDE_THE_CODE, threads=2), Options(seed=1)
    )
    assert found.rejected_because is None
    for camera, result in zip(cameras, found.cameras, strict=True):
        given = clicks(real_pair, camera.id)[~beside(located[camera.id])]
        off = result.camera.project(given.world) - given.pixel
        assert np.sqrt(np.mean(np.sum(off**2, axis=1))) < 4


def beside(found):
    """The clicks (N,) of which the first pose says that they are on no point: one of the left camera, 14 px off."""
    doubted = np.array([click.doubted and click.exchanged_with is None for click in found.clicks])
    assert doubted.sum() <= 1
    return doubted
