"""A zoom or a focus that moved: told from a camera that moved, never accepted for it, and found."""

from dataclasses import replace
from functools import cache

import pytest

from testbed.parameters import try_first
from testbed.synthetic import CROWNED, TAPED, camera, moved, paint_frame
from tests.scenes import plane
from tests.worker.calibration.outdated_pair import white_on_green
from worker.calibration import steps, wide_path
from worker.calibration.calibrate import calibrate
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.parameters import with_focal_length
from worker.calibration.records import Calibration, Options

pytestmark = pytest.mark.slow

ZOOM = 0.015
BOARD = {"fx": 0.6, "fy": 0.6}
"""A good board's, px."""
SQUARE = replace(CROWNED, sigma=TAPED | {"skew_m": 1e-3})
"""The field, whose right angles are known: the lens alone is in doubt."""
WIND = ((2e-4, -1e-4, 1e-4), (0.01, 0.0, -0.01))


@cache
def picture():
    return paint_frame(CROWNED, plane())


def believed(longer: float) -> Camera:
    """The camera a venue believes in before its lens became that much longer, moved a little by the wind since."""
    was = with_focal_length(plane(), -longer / (1 + longer) * 2000.0)
    return moved(was.with_lens(replace(was.intrinsics, sigma=BOARD)), *WIND)


def calibrated(stored: Camera, generations: int = 20, **options) -> Calibration:
    options = Options(seed=1, generations=generations, **options)
    return calibrate(SQUARE, [stored], {"tele": [picture()]}, white_on_green, options)


def off_m(found: Calibration) -> float:
    return found.cameras[0].camera.distance_m(plane())


def test_a_lens_that_has_not_changed_is_not_doubted():
    found = calibrated(believed(0.0), lens_may_drift=True)
    assert found.accepted
    assert not found.cameras[0].lens_found
    assert off_m(found) < 3 * found.cameras[0].sigma.position_m < 0.3


@pytest.mark.parametrize("longer", try_first([ZOOM, -ZOOM]))
def test_a_zoom_is_rejected_and_what_it_did_is_answered(longer):
    found = calibrated(believed(longer))
    one = found.cameras[0]
    assert not found.accepted
    assert ("longer" if longer > 0 else "shorter") in one.rejected_because
    assert "zoom or focus have moved" in one.rejected_because
    assert one.lens_found
    assert one.camera.intrinsics.matrix[0, 0] == pytest.approx(2000.0, rel=0.002)
    assert off_m(found) < max(3 * one.sigma.position_m, 0.1)


@pytest.mark.long
def test_a_lens_that_may_drift_is_accepted_with_the_focal_length_it_has():
    found = calibrated(believed(ZOOM), lens_may_drift=True)
    one = found.cameras[0]
    assert found.accepted
    assert one.camera.intrinsics.matrix[0, 0] == pytest.approx(2000.0, abs=3 * one.zoom.sigma)
    assert off_m(found) < 3 * one.sigma.position_m


@pytest.mark.long
def test_the_neighbours_of_a_camera_that_zoomed_are_finished_without_it(monkeypatch):
    finished, finish = [], steps.refine_and_judge

    def finishing(problem, begun, progress):
        finished.append([one.id for one in begun])
        return finish(problem, begun, progress)

    for module in (steps, wide_path):
        monkeypatch.setattr(module, "refine_and_judge", finishing)
    beside = camera("beside", (-8.0, -62.0, 18.0), (4.0, 2.0), focal=1600.0, size=(1280, 720))
    frames = {"tele": [picture()], "beside": [paint_frame(CROWNED, beside)]}
    options = Options(seed=1, generations=60, lens_may_drift=True)
    found = calibrate(SQUARE, [believed(0.003), moved(beside, *WIND)], frames, white_on_green, options)
    assert found.accepted
    assert [one.lens_found for one in found.cameras] == [True, False]
    assert finished[0] == ["tele", "beside"]
    assert finished[-1] == ["beside"]


@pytest.mark.long
def test_a_camera_that_moved_has_not_zoomed():
    far = moved(plane(), (0.006, -0.008, 0.004), (0.15, 0.1, -0.1))
    found = calibrated(far, 60, lens_may_drift=True)
    assert found.accepted
    assert not found.cameras[0].lens_found
    assert off_m(found) < 3 * found.cameras[0].sigma.position_m


@pytest.mark.long
def test_a_lens_known_to_be_uncertain_is_not_called_zoomed():
    unsure = believed(0.004)
    unsure = replace(unsure, intrinsics=replace(unsure.intrinsics, sigma={"fx": 10.0}))
    found = calibrated(unsure, 60)
    assert "zoom" not in (found.rejected_because or "")
    assert off_m(found) < 3 * found.cameras[0].sigma.position_m
