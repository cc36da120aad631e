"""The whole engine on painted frames, with a segmentation that sees white on green."""

from dataclasses import replace

import numpy as np
import pytest

from testbed.synthetic import CROWNED, moved, pair
from tests.worker.calibration.outdated_pair import (
    SHIFT,
    assert_found,
    frames,
    in_wind,
    outdated,
    result,
    run,
    white_on_green,
)
from worker.calibration.calibrate import calibrate
from worker.calibration.gate.quality import ridge_rejection
from worker.calibration.geometry.parameters import free_focal_lengths
from worker.calibration.geometry.rotation import rotation_angles_deg
from worker.calibration.records import CalibrationError, Options, Stopped

pytestmark = pytest.mark.slow


def test_outdated_poses_are_found_again():
    assert_found(result(), pair(), within_deg=0.02)
    assert result().accepted


def test_the_stitch_error_falls():
    assert result().stitch_error_before_px > 1
    assert result().stitch_error_px < 0.2


def test_what_moved_is_told():
    for found, was in zip(result().cameras, outdated(), strict=True):
        assert found.moved.position_m == pytest.approx(np.linalg.norm(SHIFT), abs=0.03)
        assert found.moved.rotation_deg == pytest.approx(
            rotation_angles_deg(found.camera.pose.rotation, was.pose.rotation), abs=1e-9
        )


@pytest.mark.long
def test_the_same_seed_gives_the_same_poses_to_the_last_digit():
    for first, second in zip(result().cameras, run(seed=3).cameras, strict=True):
        np.testing.assert_array_equal(first.camera.pose.rotation, second.camera.pose.rotation)
        np.testing.assert_array_equal(first.camera.pose.position, second.camera.pose.position)


@pytest.mark.long
def test_lines_that_the_network_has_never_learnt_are_found_by_their_ridges():
    def sees_nothing(frame, _):
        return np.zeros(frame.shape[:2], dtype=np.uint8)

    found = calibrate(CROWNED, outdated(), frames(), sees_nothing, Options(seed=3))
    assert found.accepted, found.rejected_because
    assert_found(found, pair(), within_m=0.05)


def test_one_camera_alone_has_no_stitch_error():
    found = run(cameras=in_wind()[:1])
    assert found.stitch_error_px is None
    assert found.accepted


def test_a_stored_pose_that_looks_at_the_sky_is_refused_and_the_other_camera_is_calibrated():
    left, right = in_wind()
    found = run(cameras=[left, moved(right, (1.2, 0, 0))])
    assert [camera.accepted for camera in found.cameras] == [True, False]
    assert found.cameras[1].refusal.reason == "no-markings-in-view"
    assert "camera right sees 0 m" in found.rejected_because
    assert found.verdict == "partly"


def test_stored_poses_that_all_look_at_the_sky_are_an_error_that_names_each_camera():
    with pytest.raises(CalibrationError, match="camera left sees") as caught:
        run(cameras=[moved(camera, (1.2, 0, 0)) for camera in outdated()])
    assert caught.value.camera == "left"
    assert "the stored pose of camera right sees" in str(caught.value)


def test_where_no_frame_can_be_used_nothing_is_searched_and_each_camera_is_refused_with_its_reason():
    found = run(pictures={name: (np.zeros_like(several[0]),) for name, several in frames().items()})
    assert (found.verdict, found.generations) == ("rejected", 0)
    assert [one.moved.position_m for one in found.cameras] == [0.0] * 2
    assert found.stitch_error_px is None
    assert "; camera right: Dark" in found.rejected_because
    assert ".;" not in found.rejected_because


@pytest.mark.long
def test_what_walks_through_one_of_three_frames_does_not_matter():
    with_player = {name: [f[0].copy() for _ in range(3)] for name, f in frames().items()}
    with_player["left"][1][200:400, 500:560] = 255
    found = run(pictures=with_player)
    assert_found(found, pair())


@pytest.mark.long
def test_progress_runs_through_the_stages_and_never_back_and_the_loss_is_that_of_the_answer():
    steps = []
    found = calibrate(CROWNED, outdated(), frames(), white_on_green, Options(seed=3, generations=10), steps.append)
    fractions = [step.fraction for step in steps]
    assert fractions == sorted(fractions)
    assert list(dict.fromkeys(step.stage for step in steps)) == ["segmentation", "evolution", "refinement"]
    searched = [step for step in steps if step.stage == "evolution"]
    assert [step.generation for step in searched] == list(range(1, 11))
    assert found.loss < 0.8 * searched[-1].loss


def test_a_request_to_stop_ends_it_at_the_next_generation():
    seen = []

    def stop():
        return sum(step.stage == "evolution" for step in seen) >= 3

    with pytest.raises(Stopped):
        calibrate(CROWNED, outdated(), frames(), white_on_green, Options(), seen.append, stop)
    assert sum(step.stage == "evolution" for step in seen) == 3


def with_longer_lens(camera, by):
    return free_focal_lengths([camera])[0].applied([camera], CROWNED, by)[0][0]


@pytest.mark.long
def test_a_focal_length_that_heat_has_changed_is_found_when_asked_for():
    left, right = outdated()
    found = run(cameras=[with_longer_lens(left, 2.0), right], fit_focal_length=True)
    assert found.accepted
    assert found.cameras[0].camera.intrinsics.matrix[0, 0] == pytest.approx(600.0, abs=0.3)


@pytest.mark.long
def test_a_lens_that_is_not_the_one_that_was_given_is_suspected_with_its_numbers():
    left, right = in_wind()
    other = replace(left.intrinsics, distortion=left.intrinsics.distortion + [0.02, 0, 0, 0, 0])
    found = run(cameras=[replace(left, intrinsics=other), right])
    told = {(s.camera, s.quantity): s for s in found.suspicions}
    assert told["left", "k1"].deviation == pytest.approx(-0.02, abs=3 * told["left", "k1"].sigma)
    assert "camera left fit best with a first radial coefficient" in told["left", "k1"].detail
    assert found.cameras[0].camera.intrinsics is other
    assert result().suspicions == []


@pytest.mark.long
def test_a_flat_pitch_that_is_crowned_is_told_with_how_far_the_true_ridge_moves_the_cameras():
    flat = calibrate(CROWNED.flat(), outdated(), frames(), white_on_green, Options(seed=3))
    (ridge,) = [one for one in flat.suspicions if one.camera is None]
    assert ridge.quantity == "ridge_height_m"
    assert ridge.deviation == pytest.approx(0.35, abs=3 * ridge.sigma)
    raised = CROWNED.flat().raised(ridge.deviation)
    there = [one.camera for one in flat.cameras]
    again = calibrate(raised, there, frames(), white_on_green, Options(seed=3))
    assert again.suspicions == []
    for before, after in zip(flat.cameras, again.cameras, strict=True):
        assert after.residual_px < before.residual_px / 3
        assert after.moved.position_m == pytest.approx(ridge.moves_m[before.camera.id], rel=0.1)


def test_a_ridge_below_the_ground_is_rejected():
    assert "ridge at -0.100 m" in ridge_rejection(CROWNED.raised(-0.45)).words
    assert ridge_rejection(CROWNED) is None
    assert ridge_rejection(CROWNED.flat()) is None


@pytest.mark.long
def test_a_camera_that_sees_something_else_is_rejected_and_says_nothing_of_its_lens():
    elsewhere = {**frames(), "left": (np.ascontiguousarray(frames()["left"][0][::-1, ::-1]),)}
    found = run(pictures=elsewhere, recover="never")
    assert "camera left" in found.rejected_because
    assert {s.camera for s in found.suspicions} <= {"right"}


def test_what_is_seen_of_markings_and_of_the_seam_is_in_the_answer():
    assert {"halfway line", "centre circle"} <= {one.name for one in result().cameras[0].markings}
    ((pair, seam),) = result().pairs
    assert pair.cameras == ("left", "right")
    assert seam.worst.error_m < 0.05
