"""Several cameras found at once, and what a calibration that begins with them says."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from testbed import synthetic
from testbed.synthetic import CROWNED, PITCH, moved, paint_frame, pair, pair_frames, worn
from tests.worker.calibration.gate.good_result import good
from tests.worker.calibration.outdated_pair import white_on_green
from worker.calibration.calibrate import calibrate
from worker.calibration.find_cameras import FoundCamera, find_cameras, why_lens_unfit
from worker.calibration.gate.quality import GATE
from worker.calibration.geometry.parameters import with_focal_length
from worker.calibration.geometry.rotation import rotation_angles_deg
from worker.calibration.records import Stopped
from worker.calibration.refinement.diagnosis import find_suspicions
from worker.calibration.refinement.uncertainty import Deviation, PoseAndLens
from worker.calibration.relocalisation.relocalise import NotFound
from worker.calibration.relocalisation.sought import Place, SoughtCamera, SoughtLens

pytestmark = pytest.mark.slow


def frames():
    return {one.id: [frame] for one, frame in zip(pair(), pair_frames(), strict=True)}


def sought(one, place=Place()):  # noqa: B008  (frozen)
    return SoughtCamera(one.id, [SoughtLens.known(one.intrinsics)], place)


@cache
def found(*cameras):
    """Cameras of the pair, found from nothing, and the steps that were reported."""
    steps, wanted = [], [sought(one) for one in pair() if one.id in cameras]
    return find_cameras(CROWNED, wanted, [], frames(), white_on_green, 1, steps.append), steps


searched = pytest.mark.parametrize("cameras", [["left"], pytest.param(["left", "right"], marks=pytest.mark.long)])


@searched
def test_cameras_are_found_on_one_side_and_a_pair_fits_together(cameras):
    answer, _ = found(*cameras)
    for truth, camera in zip(pair(), answer.cameras, strict=False):
        assert camera.accepted, camera.refusal
        assert camera.candidates[0].camera.distance_m(truth) < 0.03
        assert rotation_angles_deg(camera.candidates[0].camera.pose.rotation, truth.pose.rotation) < 0.05
    assert len(cameras) == 1 or answer.stitch_error_px < 0.2


def test_what_was_assumed_of_the_side_is_said_and_the_other_side_is_the_second_candidate():
    (camera,) = found("left")[0].cameras
    assert any("assumed: it stands on the near side" in remark for remark in camera.remarks)
    here, there = (candidate.camera.pose for candidate in camera.candidates[:2])
    assert camera.assumed_side == "near"
    assert there.position == pytest.approx(here.position * (-1, -1, 1))
    # Half a turn about z takes one to the other.
    assert there.matrix == pytest.approx(here.matrix * (-1, -1, 1))


def test_progress_grows_from_stage_to_stage():
    _, steps = found("left")
    assert [step.fraction for step in steps] == sorted(step.fraction for step in steps)
    assert list(dict.fromkeys(step.stage for step in steps)) == ["segmentation", "evolution", "refinement"]


@searched
def test_each_camera_that_is_searched_for_says_how_long_the_rest_will_take(cameras):
    _, steps = found(*cameras)
    remaining_s = [step.remaining_s for step in steps if step.remaining_s is not None]
    assert len(remaining_s) == len(cameras)
    assert min(remaining_s) > 0


@pytest.mark.long
def test_a_camera_is_found_beside_one_that_is_known():
    left, right = pair()
    found = find_cameras(CROWNED, [sought(right)], [left], frames(), white_on_green, 1)
    (camera,) = found.cameras
    assert camera.accepted
    assert camera.assumed_side is None
    assert camera.candidates[0].camera.distance_m(right) < 0.03


@pytest.mark.long
def test_a_camera_on_a_stand_opposite_is_found_there_by_the_ground_that_both_see():
    left, _ = pair()
    # Its twin stands 2 m from the other camera.
    other = synthetic.camera("other", (0.5, 47.0, 10.5), (-15.0, 0.0))
    seen = {one.id: [worn(PITCH, one, paint_frame(PITCH, one))] for one in (left, other)}
    found = find_cameras(PITCH, [sought(left), sought(other)], [], seen, white_on_green, 1)
    for truth, one in zip((left, other), found.cameras, strict=True):
        assert one.accepted, one.refusal
        assert one.candidates[0].camera.distance_m(truth) < 0.05
    assert "looks as camera left sees it" in found.cameras[1].remarks[0]


@pytest.mark.long
@pytest.mark.parametrize("roof", [CROWNED, CROWNED.with_ridge_length(CROWNED.length)], ids=["hips", "gables"])
def test_the_crown_of_a_field_that_is_given_flat_is_found_with_the_cameras(roof):
    taken = {one.id: [paint_frame(roof, one)] for one in pair()}
    found = find_cameras(roof.flat(), [sought(one) for one in pair()], [], taken, white_on_green, 1)
    assert found.pitch.ridge_height == pytest.approx(roof.ridge_height, abs=0.02)
    assert found.pitch.ridge_length == pytest.approx(roof.ridge_length)
    for truth, camera in zip(pair(), found.cameras, strict=True):
        assert camera.accepted, camera.refusal
        assert camera.candidates[0].camera.distance_m(truth) < 0.03


@pytest.mark.long
def test_a_flat_field_stays_flat_and_a_field_with_a_known_camera_as_it_is_given():
    left, right = pair()
    on_the_flat = paint_frame(PITCH, left)
    flat = find_cameras(PITCH, [sought(left)], [], {left.id: [on_the_flat]}, white_on_green, 1)
    assert flat.cameras[0].accepted
    assert flat.pitch is PITCH
    beside = find_cameras(CROWNED.flat(), [sought(right)], [left], frames(), white_on_green, 1)
    assert beside.pitch.ridge is None


@pytest.mark.parametrize(
    ("reason", "was_calibrated"), [(None, True), ("not-confirmed", True), ("not-unique", False), ("no-lines", False)]
)
def test_a_calibration_begins_with_what_was_found_and_may_not_confirm_it(reason, was_calibrated):
    refusal = None if reason is None else NotFound(reason, "")
    assert FoundCamera("left", [], refusal, []).was_calibrated is was_calibrated


def test_who_is_asked_to_stop_stops():
    with pytest.raises(Stopped):
        find_cameras(CROWNED, [sought(pair()[0])], [], frames(), white_on_green, 1, stop=lambda: True)


def test_a_lens_that_was_given_and_does_not_fit_is_said_and_nothing_is_found():
    lens = {"name": "focal_length_px", "value": -12.0, "sigma": 1.2, "expected": 0.5}
    result = replace(good(), refined=PoseAndLens(moved(good().camera, by=(1.2, 0.0, 0.0)), np.eye(12)))
    doubts = find_suspicions([Deviation(result.camera.id, **lens)])
    assert why_lens_unfit(result, []) is None
    assert why_lens_unfit(result, find_suspicions([Deviation("another", **lens)])) is None
    told = why_lens_unfit(result, doubts)
    assert "a focal length 2.00% ± 0.20% shorter than that of the lens that was given" in told
    assert "1.20 m from where it seems to be: the lens that the lines have is taken in its place" in told


def test_a_lens_that_may_be_off_by_more_than_a_first_position_says_so():
    loose = replace(good(), covariance=np.diag([1e-4**2] * 3 + [0.3**2] * 3))
    assert "say how well it is known (sigma)" in why_lens_unfit(loose, [])


def test_a_given_lens_that_leaves_the_place_open_is_replaced_before_the_only_calibration(monkeypatch):
    calibrations = []

    def counted(*arguments, **named):
        calibrations.append(calibrate(*arguments, **named))
        return calibrations[-1]

    monkeypatch.setattr("worker.calibration.find_cameras.calibrate", counted)
    monkeypatch.setattr("worker.calibration.find_cameras.GATE", replace(GATE, largest_found_sigma_m=0.01))
    left = pair()[0]
    (found,) = find_cameras(CROWNED, [sought(left)], [], {left.id: frames()[left.id]}, white_on_green, 1).cameras
    assert found.accepted, found.refusal
    (words,) = [remark for remark in found.remarks if "leaves open where the camera stands" in remark]
    assert "say how well it is known (sigma)" in words
    assert len(calibrations) == 1


@pytest.mark.long
def test_where_lines_contradict_the_lens_that_is_given_the_camera_is_found_with_the_one_that_they_have():
    left = pair()[0]
    longer = with_focal_length(left, 0.02 * left.intrinsics.focal_length_px)
    (found,) = find_cameras(CROWNED, [sought(longer)], [], {left.id: frames()[left.id]}, white_on_green, 1).cameras
    assert found.accepted, found.refusal
    assert any("the lens that the lines have is taken in its place" in remark for remark in found.remarks)
    best = found.candidates[0].camera
    assert best.intrinsics.sigma_from == "lines"
    assert best.intrinsics.focal_length_px == pytest.approx(left.intrinsics.focal_length_px, rel=0.004)
    assert best.distance_m(left) < 0.3
