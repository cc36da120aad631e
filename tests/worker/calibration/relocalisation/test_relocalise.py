"""A camera found from nothing but its frame and the field."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from testbed.synthetic import BARREL, PITCH, camera, paint_frame
from tests.worker.calibration.gate.good_result import seen
from tests.worker.calibration.outdated_pair import white_on_green
from tests.worker.calibration.sports import field
from worker.calibration.detection.contrast import Channels
from worker.calibration.detection.segmentation import Region
from worker.calibration.diagnostics.overlap import Overlap
from worker.calibration.geometry.camera import inside
from worker.calibration.relocalisation import relocalise as relocalisation
from worker.calibration.relocalisation.candidate import Candidate, is_better
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.line_view import LineView
from worker.calibration.relocalisation.propose import ProposedCamera
from worker.calibration.relocalisation.relocalise import (
    explains_nearly_as_well,
    relocalise,
    sees_all_of_its_frame,
    twin,
)
from worker.calibration.relocalisation.sought import OTHER_BENDS, Place, SoughtCamera, SoughtLens, unknown_lenses

pytestmark = pytest.mark.slow

GREEN = np.full((540, 960, 3), (60, 130, 70), np.uint8)
SIDELINE = camera("one", (-12.0, -50.0, 11.0), (-28.0, -4.0), distortion=BARREL)
BEHIND_A_GOAL = camera("one", (-70.0, 9.0, 13.0), (-20.0, 0.0))
COURT = camera("one", (-4.0, -13.0, 6.0), (-1.0, 0.0), focal=500.0)


@cache
def found(pitch_name, truth_name, lens_is_known, place=None):
    pitch = PITCH if pitch_name == "football" else field(pitch_name)
    truth = globals()[truth_name]
    return pitch, truth, search(pitch, truth, paint_frame(pitch, truth), lens_is_known, place or Place())


def response_to(frame):
    height, width = frame.shape[:2]
    return white_on_green(frame, [Region(0, 0, width, height)]).astype(np.float32) / 255


def search(pitch, truth, frame, lens_is_known=True, place=Place(), sureness=1.0):  # noqa: B008  (frozen)
    lenses = [SoughtLens.known(truth.intrinsics)] if lens_is_known else unknown_lenses(truth.intrinsics.size)
    sought = SoughtCamera(truth.id, lenses, place)
    return search_for(sought, pitch, frame, sureness)


def search_for(sought, pitch, frame, sureness=1.0):
    return relocalise(pitch, FieldMap.of(pitch), sought, Channels([frame]), response_to(frame) * sureness, 1)


def off_px(pitch, truth, best):
    """How far on mean the markings in view are from where a camera, or its twin, puts them."""
    lines = pitch.line_points().position
    there = truth.project(lines)
    seen = inside(there, truth.intrinsics.size)
    return min(np.linalg.norm(one.project(lines[seen]) - there[seen], axis=1).mean() for one in (best, twin(best)))


@pytest.mark.long
@pytest.mark.parametrize(
    ("sport", "truth"), [("football", "SIDELINE"), ("football", "BEHIND_A_GOAL"), ("basketball", "COURT")]
)
def test_a_camera_of_a_known_lens_is_found(sport, truth):
    pitch, camera, answer = found(sport, truth, lens_is_known=True)
    assert answer.refusal is None, answer.refusal
    assert off_px(pitch, camera, answer.candidates[0].camera) < 0.5


@pytest.mark.long
def test_paint_that_the_network_is_hardly_sure_of_is_searched_too():
    pitch, camera = PITCH, SIDELINE
    answer = search(pitch, camera, paint_frame(pitch, camera), sureness=np.float32(0.6))
    assert answer.refusal is None, answer.refusal
    assert off_px(pitch, camera, answer.candidates[0].camera) < 0.5


@pytest.mark.long
def test_lens_and_pose_are_found_together():
    pitch, camera, answer = found("football", "SIDELINE", lens_is_known=False)
    assert answer.refusal is None, answer.refusal
    best = answer.candidates[0].camera
    assert off_px(pitch, camera, best) < 1.0
    off = best.intrinsics.focal_length_px - camera.intrinsics.focal_length_px
    assert abs(off) < max(4 * best.intrinsics.sigma["fx"], 6.0)


@pytest.mark.long
def test_a_lens_that_bends_much_more_than_usual_ones_is_found_with_the_pose():
    barrel = camera("one", (-6.0, -52.0, 16.0), (-10.0, 0.0), distortion=(-0.25, 0.06, 0.0, 0.0))
    size, frame = barrel.intrinsics.size, paint_frame(PITCH, barrel)
    sought = SoughtCamera("one", unknown_lenses(size), other_lenses=unknown_lenses(size, OTHER_BENDS))
    answer = search_for(sought, PITCH, frame)
    assert answer.refusal is None, answer.refusal
    assert off_px(PITCH, barrel, answer.candidates[0].camera) < 1.0


@pytest.mark.long
def test_other_lenses_are_looked_through_where_the_first_find_nothing():
    # A lens of half the focal length explains no line of the frame.
    frame, lens = paint_frame(PITCH, SIDELINE), SIDELINE.intrinsics
    wide = replace(lens, matrix=np.diag([0.3, 0.3, 1.0]) @ lens.matrix)
    alone = SoughtCamera("one", [SoughtLens.known(wide)])
    with_other = replace(alone, other_lenses=[SoughtLens.known(lens)])
    assert search_for(alone, PITCH, frame).refusal is not None
    assert search_for(with_other, PITCH, frame).refusal is None


@pytest.mark.long
def test_a_camera_stands_where_it_may():
    _, _, answer = found("football", "SIDELINE", lens_is_known=True, place=Place("far"))
    assert answer.candidates[0].camera.pose.position[1] > 0


@pytest.mark.long
def test_three_lines_do_not_tell_a_lens_and_are_refused_with_the_pixels_that_it_leaves_open():
    # One line along padel's service boxes, and what of the lines across it is seen between two markings.
    court = field("padel")
    corner = camera("one", (5.3, -8.8, 7.2), (-1.0, 4.0), focal=700.0)
    answer = search(court, corner, paint_frame(court, corner), lens_is_known=False)
    assert answer.candidates[0].ground_sigma.rms_px > 2.4
    assert answer.refusal.reason == "few-lines"
    assert "do not tell lens and pose apart" in answer.refusal.words


def test_a_lens_that_bends_the_picture_back_before_its_corners_does_not_see_all_of_its_frame():
    # Netball: the lens that fitted all lines but those at the right edge, where it put them back into the picture.
    folded = camera("one", (0.2, -12.9, 9.6), (0.0, 0.0), focal=697.0, distortion=(-0.289, 0.009, 0.0, 0.0))
    assert not sees_all_of_its_frame(folded.intrinsics)
    assert sees_all_of_its_frame(SIDELINE.intrinsics)


@pytest.mark.long
def test_a_yard_line_too_far_is_left_for_the_true_one():
    pitch = field("american-football")
    truth = camera("one", (15.0, -44.0, 22.0), (35.0, -10.0), focal=900.0)
    answer = search(pitch, truth, paint_frame(pitch, truth))
    assert off_px(pitch, truth, answer.candidates[0].camera) < 0.5


def test_a_search_ends_where_a_second_one_finds_no_better_pose(monkeypatch):
    seeds = list[int]()

    def propose_the_same(markings, response, sought, seed):
        seeds.append(seed)
        return [ProposedCamera(SIDELINE.intrinsics, BEHIND_A_GOAL.pose, 0.3)]

    monkeypatch.setattr(relocalisation, "propose", propose_the_same)
    answer = search(PITCH, SIDELINE, paint_frame(PITCH, SIDELINE))
    assert answer.refusal.reason == "lines"
    assert seeds == [1, 2]


def test_a_frame_without_lines_finds_nothing_and_says_so():
    answer = search(PITCH, SIDELINE, GREEN)
    assert answer.refusal.reason in ("no-lines", "lines", "few-lines")


@pytest.mark.long
def test_two_parallel_lines_are_no_field():
    frame = GREEN.copy()
    frame[200:204] = frame[300:304] = 240
    answer = search(PITCH, SIDELINE, frame)
    assert answer.refusal is not None
    assert answer.refusal.words


def candidate(found_of_100, explained_of_100, iou, residual_px=0.4):
    """What is seen of 100 pieces of expected line, and which of 100 places on paint lie on one."""
    evidence, explains = seen(found_of_100 / 100, by_chance=0.0), np.isin(np.arange(100), explained_of_100)
    agreement = 2 / (1 / evidence.agreement + 1 / explains.mean())
    overlap = Overlap(iou, found_of_100 / 100, 0.0)
    return Candidate(SIDELINE, agreement, explains, evidence, overlap, residual_px, None, None)


def test_of_two_poses_that_agree_alike_the_one_closer_to_its_lines_is_better_and_else_the_one_that_agrees_more():
    # Handball on a floor with other lines: one of them was caught, 4 px off.
    close, far = (
        candidate(70, range(53), iou=0.4, residual_px=0.52),
        candidate(73, range(53), iou=0.4, residual_px=0.63),
    )
    assert not is_better(far, close)
    # Futsal: the touchline was taken for its neighbour, and what lies farther off is right.
    close, far = (
        candidate(88, range(30), iou=0.4, residual_px=0.47),
        candidate(99, range(29), iou=0.4, residual_px=0.14),
    )
    assert is_better(far, close)
    # Ice hockey: most of the lines were not caught.
    close, far = (
        candidate(50, range(61), iou=0.4, residual_px=0.57),
        candidate(91, range(96), iou=0.8, residual_px=0.73),
    )
    assert is_better(far, close)
    assert not is_better(candidate(40, range(50), iou=0.4, residual_px=None), close)


def test_a_camera_that_is_sought_where_it_stood_may_miss_more_of_its_lines():
    (lens, place) = [SoughtLens.known(SIDELINE.intrinsics)], Place(position=SIDELINE.pose.position)
    misses_a_third, explains_little = candidate(66, range(90), iou=0.6), candidate(66, range(60), iou=0.6)
    in_place, anywhere = SoughtCamera("one", lens, place), SoughtCamera("one", lens)
    refusals = [
        relocalisation.why_not_taken(PITCH, FieldMap.of(PITCH), sought, [best]).reason
        for sought, best in ((in_place, misses_a_third), (in_place, explains_little), (anywhere, misses_a_third))
    ]
    # Of the candidate too few points are measured, which comes after how many lines are seen.
    assert refusals == ["few-lines", "lines", "lines"]


def test_a_pose_whose_lines_the_network_does_not_see_is_not_taken():
    # Lacrosse, faint lines on a floor of parquet: two lines of a pose that is wrong lay on its grain.
    sought = SoughtCamera("one", [SoughtLens.known(SIDELINE.intrinsics)])
    on_grain, right = candidate(93, range(64), iou=0.12), candidate(93, range(64), iou=0.27)
    refusals = [relocalisation.why_not_taken(PITCH, FieldMap.of(PITCH), sought, [best]) for best in (on_grain, right)]
    assert [one.reason for one in refusals] == ["lines", "few-lines"]
    assert "12%" in refusals[0].words


@pytest.mark.parametrize(
    ("best", "other", "is_rival"),
    [
        # American football: the same field a few yard lines farther on, with its goal line where there is none.
        ((99, range(90), 0.91), (90, range(88), 0.81), False),
        # It explains paint that the best does not.
        ((99, range(90), 0.91), (90, range(5, 93), 0.81), True),
        # Tennis: a court half as far along, whose lines are rather seen, but which explains a third less of the paint.
        ((76, range(95), 0.62), (85, range(68), 0.71), False),
        # American football: yard lines farther on, with less of its lines seen and less of the paint explained.
        ((96, range(99), 0.85), (93, range(92), 0.78), False),
        # Yard lines farther on, one of them where there is none; and as many of its lines.
        ((95, range(98), 0.86), (88, range(98), 0.78), False),
        ((95, range(98), 0.86), (93, range(98), 0.84), True),
        # Through a lens that is sought, which bends to meet the yard lines farther on, and does not quite.
        ((99, range(96), 0.88, 0.17), (99, range(5, 97), 0.89, 0.2), True),
        ((99, range(96), 0.88, 0.17), (99, range(5, 97), 0.89, 0.55), False),
        # Too little of it was measured.
        ((99, range(96), 0.88, 0.17), (99, range(5, 97), 0.89, None), True),
    ],
)
def test_a_pose_is_a_rival_if_it_may_be_the_true_one(best, other, is_rival):
    assert explains_nearly_as_well(candidate(*other), candidate(*best)) == is_rival


def test_a_frame_is_searched_as_far_as_its_lens_sees_that_folds_all_around_it():
    folding = camera("one", (0.2, -12.9, 9.6), (0.0, 0.0), focal=500.0, distortion=(-0.8, 0.0, 0.0, 0.0)).intrinsics
    assert np.isnan(folding.undistort(folding.border(60))).any(axis=-1).all()
    width, height = folding.size
    painted = np.zeros((height, width), np.uint8)
    painted[height // 2 - 2 : height // 2 + 3] = 255
    view = LineView.of(painted, folding, 3.0)
    assert view.painted_px > 0
    assert view.covered.any()
    assert np.isfinite(view.corner).all()
