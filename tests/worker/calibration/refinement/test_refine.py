"""The refinement: line centres to a fraction of a pixel, and poses to millimetres on a perfect picture."""

from functools import cache

import cv2
import numpy as np
import pytest

from fields.template import Template
from testbed.synthetic import (
    BARREL,
    CROWNED,
    camera,
    ground_behind,
    moved,
    pair,
    pair_frames,
    pair_markings,
)
from tests.scenes import lone_line
from tests.worker.calibration.sights import observed, pair_observed
from worker.calibration.detection.contrast import Channels
from worker.calibration.detection.line_matching import expected_profiles, sliding_correlation
from worker.calibration.detection.line_measurement import LineProfiles, measure_lines
from worker.calibration.diagnostics.registration import register_pair
from worker.calibration.gate.quality import GATE
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.parameters import free_focal_lengths, free_ridge, lens_parameters
from worker.calibration.geometry.rotation import rotation_angles_deg
from worker.calibration.refinement.refine import LineReader, Observations, evaluate_poses, refine, refine_coarsely
from worker.calibration.robust import huber_weights, tukey_weights

pytestmark = pytest.mark.slow

LEFT = pair()[0]
SMALL_TURN = (0.0008, -0.0006, 0.0005)
SMALL_SHIFT = (0.02, -0.03, 0.02)


def a_little_off():
    return [moved(c, SMALL_TURN, SMALL_SHIFT) for c in pair()]


@cache
def brought_back():
    return refine(CROWNED, a_little_off(), pair_observed(), 0.5)


@cache
def from_the_truth():
    return refine(CROWNED, pair(), pair_observed(), 0.5)


@cache
def through_a_wrong_lens():
    """The left camera's lens is not the one that was given."""
    cameras = pair()
    bent = next(p for p in lens_parameters(cameras) if p.name == "k1")
    wrong, _ = bent.applied(cameras, CROWNED, 0.01)
    return refine(CROWNED, wrong, pair_observed(), 0.5)


def off_by(cameras, refined):
    return [
        (
            after.distance_m(before),
            rotation_angles_deg(after.pose.rotation, before.pose.rotation),
        )
        for before, after in zip(cameras, refined, strict=True)
    ]


def measured(one=LEFT, frame=None, network=True, search_px=6.0):
    """The lines in the frame of the left camera near where a camera expects them, with the network or without."""
    channels, response = pair_observed().channels[0], pair_observed().responses[0]
    channels = channels if frame is None else Channels([frame])
    return measure_lines(CROWNED.line_points(), one, channels, response if network else 0 * response, search_px)


def offsets(found):
    """How far (M,) measured lines are from where they are."""
    return found.offset(LEFT, found.points.position)


@pytest.mark.parametrize(
    "found",
    [
        lambda: measured(moved(LEFT, SMALL_TURN)),
        lambda: measured(network=False),
        lambda: measured(frame=255 - pair_frames()[0], network=False),
    ],
    ids=["from beside", "by their ridges alone", "darker than their ground"],
)
def test_lines_are_found_where_they_are(found):
    off = offsets(found())
    assert len(off) > 300
    assert np.abs(np.median(off)) < 0.02
    assert np.percentile(np.abs(off), 75) < 0.1


def test_where_a_line_is_measured_does_not_depend_on_where_it_is_expected():
    lines, beside = CROWNED.line_points(), moved(LEFT, SMALL_TURN)
    profiles = LineProfiles.read(lines, LEFT, pair_observed().channels[0], pair_observed().responses[0], 12.0)
    one, other = (profiles.measure(camera, lines, 5.0) for camera in (LEFT, beside))
    _, at_one, at_other = np.intersect1d(one.index, other.index, return_indices=True)
    assert len(at_one) > 300
    apart = np.linalg.norm(one.pixel[at_one] - other.pixel[at_other], axis=1)
    # What fits a line next to it nearly as well may be taken for it from elsewhere.
    assert np.mean(apart == 0) > 0.98


def test_ridges_that_do_not_go_on_along_a_line_are_not_measured():
    noise = np.random.default_rng(3).normal(100, 20, pair_frames()[0].shape).astype(np.uint8)
    assert len(measured(frame=noise, network=False)) < 0.2 * len(measured())


@pytest.mark.parametrize("shift", [-3.25, 0.0, 1.5])
@pytest.mark.parametrize("width", [1.0, 4.0, 9.0])
def test_the_filter_fits_best_at_the_centre_of_its_line(width, shift):
    offsets = np.arange(-30, 30.5, 0.5)
    line = expected_profiles(np.array([width]), offsets - shift)
    filters = expected_profiles(np.array([width]), np.arange(-15, 15.5, 0.5))
    correlation = sliding_correlation(100 * line + 50, filters)
    best = np.argmax(correlation[0])
    assert (best - correlation.shape[1] // 2) * 0.5 == pytest.approx(shift, abs=0.26)
    assert correlation[0, best] > 0.95


def test_slightly_moved_cameras_come_back_to_where_they_were():
    for shift, turn in off_by(pair(), brought_back().cameras):
        assert shift < 0.02
        assert turn < 0.02
    assert all(one.residual_px < 0.3 for one in brought_back().each)


class _CountingReader(LineReader):
    """A reader of lines that counts how often frames are read once more."""

    times = 0

    def read_anew(self):
        self.times += 1
        super().read_anew()


def test_a_coarse_refinement_ends_where_a_settled_one_does_to_a_part_of_its_sigma():
    coarse = refine_coarsely(CROWNED, a_little_off()[:1], pair_observed().of([0])).each[0]
    settled = refine(CROWNED, a_little_off()[:1], pair_observed().of([0]), 0.5).each[0]
    assert coarse.camera.distance_m(settled.camera) < 0.3 * settled.sigma.position_m
    assert coarse.residual_px == pytest.approx(settled.residual_px, rel=0.1)
    assert coarse.sigma.position_m == pytest.approx(settled.sigma.position_m, rel=0.1)


def test_frames_are_not_read_again_and_again_for_a_pose_that_misses_most_lines():
    reader = _CountingReader(pair_observed().of([0]))
    (lost,) = refine(CROWNED, [moved(LEFT, (0.1, 0.05, 0.0))], pair_observed().of([0]), 0.5, reader=reader).each
    assert lost.evidence.agreement < 0.5
    assert reader.times == 1


def test_the_error_is_of_the_size_of_its_sigma():
    cameras = pair()
    responses = pair_markings()
    rng = np.random.default_rng(0)
    noisy = [np.clip(f + rng.normal(scale=12, size=f.shape), 0, 255).astype(np.uint8) for f in pair_frames()]
    refined = refine(CROWNED, cameras, Observations([Channels([f]) for f in noisy], responses), 0.5)
    for before, after in zip(cameras, refined.each, strict=True):
        error = after.camera.pose.position - before.pose.position
        assert (np.abs(error) < 4 * np.sqrt(np.diag(after.covariance)[3:])).all()
        assert np.sqrt(np.diag(after.covariance)[3:]).max() < 0.1


@pytest.mark.long
def test_the_stitch_term_holds_together_what_a_wrong_lens_pulls_apart():
    cameras = pair()
    responses = pair_markings()
    longer, _ = free_focal_lengths(cameras)[0].applied(cameras, CROWNED, 2.0)
    alone, together = (
        register_pair(CROWNED, *refine(CROWNED, longer, pair_observed(), weight).cameras, *responses)
        for weight in (0.0, 0.9)
    )
    assert together.error_px < 0.6 * alone.error_px


@pytest.mark.long
def test_cameras_that_need_not_agree_end_as_each_does_by_itself():
    stored, begun, sight = [moved(c, by=(0.3, 0.0, 0.0)) for c in pair()], a_little_off(), pair_observed()
    together = refine(CROWNED, begun, sight, 0.0, stored=stored)
    for n, end in enumerate(together.each):
        alone = refine(CROWNED, [begun[n]], sight.of([n]), 0.0, stored=[stored[n]])
        np.testing.assert_array_equal(end.camera.pose.position, alone.each[0].camera.pose.position)
        of_its_lens = [d for d in alone.deviations if d.camera is not None]
        assert [d for d in together.deviations if d.camera == end.camera.id] == of_its_lens


def test_a_camera_without_lines_stays_where_it_is_and_has_no_sigma():
    cameras = pair()
    channels, responses = pair_observed().channels, pair_observed().responses
    black = Channels([np.zeros((*responses[1].shape, 3), dtype=np.uint8)])
    blind = Observations([channels[0], black], [responses[0], np.zeros_like(responses[1])])
    refined = refine(CROWNED, cameras, blind, 0.5)
    np.testing.assert_array_equal(refined.cameras[1].pose.position, cameras[1].pose.position)
    seeing, unseeing = refined.each
    assert (unseeing.sigma, unseeing.repeatability, unseeing.residual_px) == (None, None, None)
    assert seeing.sigma is not None


def test_assessing_moves_nothing():
    start = [moved(c, SMALL_TURN) for c in pair()]
    assessed = evaluate_poses(CROWNED, start, pair_observed())
    assert assessed.cameras == start
    assert all(one.residual_px > 0.3 for one in assessed.each)


def test_an_outlier_has_no_weight_and_the_rest_have_theirs():
    weights = tukey_weights(np.array([0.0, 0.5, -0.5, 0.2, 100.0]))
    assert weights[-1] == 0
    assert weights[0] == 1
    assert (weights[:4] > 0.9).all()


@pytest.mark.parametrize("distortion", [BARREL, pytest.param((), marks=pytest.mark.long)])
def test_a_lone_touchline_neither_lets_a_camera_run_away_nor_makes_it_sure(distortion):
    one = lone_line(distortion)
    refined = refine(CROWNED, [moved(one, by=(0.2, 0.0, 0.0))], observed(CROWNED, [one]), 0.5)
    assert refined.each[0].residual_px is not None
    assert refined.cameras[0].distance_m(one) < 1.5
    assert refined.each[0].sigma.position_m > GATE.largest_ground_sigma_m


@pytest.mark.long
def test_the_ends_of_hash_marks_hold_a_camera_that_sees_only_lines_of_one_direction():
    yards = [{"name": f"line {x}", "line": [[x, -24], [x, 24]]} for x in (-9, -4.5, 0, 4.5, 9)]
    marks = [
        {"name": f"mark {x} {y}", "line": [[x, y - 0.3], [x, y + 0.3]]}
        for x in (-6, -3, -1.5, 1.5, 3, 6)
        for y in (-3, 3)
    ]
    pitch = Field(110, 49, 0.1, template=Template(marking=yards + marks))
    one = camera("left", (0.0, -60.0, 22.0), (0.0, 0.0), focal=6000.0, size=(1920, 1080))
    refined = refine(pitch, [moved(one, by=(0.0, 0.15, 0.0))], observed(pitch, [one]), 0.5)
    far_off = refined.cameras[0].pose.position - one.pose.position
    seen = one.project(np.zeros((1, 3))) - refined.cameras[0].project(np.zeros((1, 3)))
    assert np.linalg.norm(seen) < 0.3
    assert np.linalg.norm(far_off) < 3 * refined.each[0].sigma.position_m


@pytest.mark.parametrize("colour", [0, 2])
def test_blue_and_red_that_the_lens_puts_elsewhere_move_no_line(colour):
    fringed = pair_frames()[0].copy()
    fringed[:, 4:, colour] = pair_frames()[0][:, :-4, colour]
    np.testing.assert_array_equal(measured().pixel, measured(frame=fringed).pixel)


@pytest.mark.long
@pytest.mark.parametrize(("wrong_m", "within_m", "within_deg"), [(0.0, 0.002, 0.001), (0.3, 0.004, 0.004)])
def test_the_end_is_the_same_from_both_sides_also_where_the_ground_is_wrong(wrong_m, within_m, within_deg):
    turn, shift = np.array(SMALL_TURN), np.array(SMALL_SHIFT)
    ends = [
        refine(CROWNED.raised(wrong_m), [moved(c, side * turn, side * shift) for c in pair()], pair_observed(), 0.5)
        for side in (1, -1)
    ]
    for apart_m, apart_deg in off_by(*(end.cameras for end in ends)):
        assert apart_m < within_m
        assert apart_deg < within_deg


def test_huber_believes_what_is_near_and_doubts_the_rest_the_more_the_farther():
    weights = huber_weights(np.array([0.0, 0.5, -0.5, 0.2, 10.0, 100.0]))
    assert weights[0] == weights[1] == 1
    assert weights[4] == pytest.approx(10 * weights[5])


def test_a_focal_length_that_is_left_free_is_found_with_the_pose():
    cameras = pair()
    longer, _ = free_focal_lengths(cameras)[0].applied(cameras, CROWNED, 1.5)
    start = [moved(c, SMALL_TURN, SMALL_SHIFT) for c in longer]
    found = refine(CROWNED, start, pair_observed(), 0.5, free_focal_lengths(start))
    for true, after in zip(cameras, found.cameras, strict=True):
        assert after.intrinsics.matrix[0, 0] == pytest.approx(true.intrinsics.matrix[0, 0], abs=0.2)
        assert after.distance_m(true) < 0.02
    assert found.pitch is CROWNED


@pytest.mark.long
@pytest.mark.parametrize("start", [0.1, 0.5])
def test_a_ridge_that_is_left_free_is_found_with_the_poses(start):
    wrong = CROWNED.raised(start - 0.35)
    found = refine(wrong, pair(), pair_observed(), 0.5, free_ridge(wrong))
    assert found.pitch.ridge[:, 2] == pytest.approx([0.35, 0.35], abs=0.03)


@pytest.mark.long
def test_a_ground_that_swells_is_found_and_does_not_move_the_cameras():
    cameras = pair()
    uneven = CROWNED.raised(0.0)
    bumps = np.array([0.03, -0.03])

    def swelling(xy, height=CROWNED.height):
        return height(xy) + bumps[0] * np.sin(xy[..., 0] / 6) * np.cos(xy[..., 1] / 6)

    object.__setattr__(uneven, "height", swelling)
    refined = refine(CROWNED, cameras, observed(uneven, cameras), 0.5)
    for (shift, turn), one in zip(off_by(cameras, refined.cameras), refined.each, strict=True):
        assert shift < 0.05
        assert turn < 0.05
        assert shift < 3 * one.sigma.position_m


def deviation(refined, camera, name):
    return next(d for d in refined.deviations if (d.camera, d.name) == (camera, name))


def test_lines_tell_which_number_of_which_lens_is_wrong():
    found = deviation(through_a_wrong_lens(), "left", "k1")
    assert found.value == pytest.approx(-0.01, abs=3 * found.sigma)
    # The second coefficient bends lines much alike, and may have a part of it.
    assert abs(found.value) > 2 * found.sigma
    assert abs(deviation(through_a_wrong_lens(), "right", "k1").value) < 0.002


def test_a_lens_and_a_field_that_are_right_are_not_suspected():
    found = from_the_truth().deviations
    assert all(abs(d.value) < max(3 * d.sigma, 0.1 * d.expected) for d in found)


def test_lines_tell_that_the_pitch_is_crowned_though_it_is_said_to_be_flat():
    refined = refine(CROWNED.flat(), pair(), pair_observed(), 0.5)
    found = deviation(refined, None, "ridge_height_m")
    assert found.value == pytest.approx(0.35, abs=max(3 * found.sigma, 0.1))
    assert found.value > 3 * found.sigma


def test_a_camera_with_a_wrong_lens_is_less_sure_of_its_pose():
    right, unsure = from_the_truth().each[0], through_a_wrong_lens().each[0]
    assert unsure.sigma.position_m > 2 * right.sigma.position_m


def test_the_same_wrong_lens_makes_the_next_pose_no_less_like_this_one():
    left = through_a_wrong_lens().each[0]
    assert left.repeatability.position_m < left.sigma.position_m / 2


def on_marking(found, name):
    return np.array([marking.name for marking in CROWNED.markings()])[found.points.marking] == name


def test_bent_lines_are_found_where_they_are():
    found = measured(search_px=3.0)
    for name in ("centre circle", "left penalty arc"):
        # Along a straight tangent the arc would be 0.3 px off.
        assert abs(np.median(offsets(found)[on_marking(found, name)])) < 0.08


def test_ground_that_is_brighter_on_one_side_does_not_pull_a_line():
    with np.errstate(invalid="ignore"):
        outside = ground_behind(CROWNED, LEFT)[..., 1] < -CROWNED.width / 2
    found = measured(frame=cv2.add(pair_frames()[0], 40 * np.dstack([outside] * 3).astype(np.uint8)), search_px=3.0)
    beside = offsets(found)[on_marking(found, "near touchline")]
    assert len(beside) > 30
    assert abs(np.median(beside)) < 0.05
