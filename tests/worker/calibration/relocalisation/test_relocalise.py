"""A camera found from nothing but its frame and the field."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from testbed.synthetic import BARREL, PITCH, camera, paint_frame
from tests.worker.calibration.outdated_pair import white_on_green
from tests.worker.calibration.sports import field
from worker.calibration.detection.contrast import Channels
from worker.calibration.detection.evidence import Evidence
from worker.calibration.detection.segmentation import Region
from worker.calibration.diagnostics.overlap import Overlap
from worker.calibration.geometry.camera import inside
from worker.calibration.relocalisation import relocalise as relocalisation
from worker.calibration.relocalisation.candidate import Candidate, is_better
from worker.calibration.relocalisation.field_map import FieldMap
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


def search(pitch, truth, frame, lens_is_known=True, place=Place(), sureness=1.0):  # noqa: B008  (frozen)
    lenses = [SoughtLens.known(truth.intrinsics)] if lens_is_known else unknown_lenses(truth.intrinsics.size)
    response = white_on_green(frame, [Region(0, 0, *truth.intrinsics.size)]).astype(np.float32) / 255 * sureness
    sought = SoughtCamera(truth.id, lenses, place)
    return relocalise(pitch, FieldMap.of(pitch), sought, Channels([frame]), response, 1)


def off_px(pitch, truth, best):
    """How far on mean the markings in view are from where a camera, or its twin, puts them."""
    lines = pitch.line_points().position
    there = truth.project(lines)
    seen = inside(there, truth.intrinsics.size)
    return min(np.linalg.norm(one.project(lines[seen]) - there[seen], axis=1).mean() for one in (best, twin(best)))


@pytest.mark.parametrize(
    ("sport", "truth"), [("football", "SIDELINE"), ("football", "BEHIND_A_GOAL"), ("basketball", "COURT")]
)
def test_a_camera_of_a_known_lens_is_found(sport, truth):
    pitch, camera, answer = found(sport, truth, lens_is_known=True)
    assert answer.refusal is None, answer.refusal
    assert off_px(pitch, camera, answer.candidates[0].camera) < 0.5


def test_paint_that_the_network_is_hardly_sure_of_is_searched_too():
    pitch, camera = PITCH, SIDELINE
    answer = search(pitch, camera, paint_frame(pitch, camera), sureness=np.float32(0.6))
    assert answer.refusal is None, answer.refusal
    assert off_px(pitch, camera, answer.candidates[0].camera) < 0.5


def test_lens_and_pose_are_found_together():
    pitch, camera, answer = found("football", "SIDELINE", lens_is_known=False)
    assert answer.refusal is None, answer.refusal
    best = answer.candidates[0].camera
    assert off_px(pitch, camera, best) < 1.0
    off = best.intrinsics.focal_length_px - camera.intrinsics.focal_length_px
    assert abs(off) < max(4 * best.intrinsics.sigma["fx"], 6.0)


def test_a_lens_that_bends_much_more_than_usual_ones_is_found_with_the_pose():
    barrel = camera("one", (-6.0, -52.0, 16.0), (-10.0, 0.0), distortion=(-0.25, 0.06, 0.0, 0.0))
    size = barrel.intrinsics.size
    response = white_on_green(paint_frame(PITCH, barrel), [Region(0, 0, *size)]).astype(np.float32) / 255
    sought = SoughtCamera("one", unknown_lenses(size), other_lenses=unknown_lenses(size, OTHER_BENDS))
    channels = Channels([paint_frame(PITCH, barrel)])
    answer = relocalise(PITCH, FieldMap.of(PITCH), sought, channels, response, 1)
    assert answer.refusal is None, answer.refusal
    assert off_px(PITCH, barrel, answer.candidates[0].camera) < 1.0


def test_other_lenses_are_looked_through_where_the_first_find_nothing():
    # A lens of half the focal length explains no line of the frame.
    _, truth, _ = found("football", "SIDELINE", lens_is_known=True)
    frame = paint_frame(PITCH, truth)
    response = white_on_green(frame, [Region(0, 0, *truth.intrinsics.size)]).astype(np.float32) / 255
    wide = replace(truth.intrinsics, matrix=np.diag([0.3, 0.3, 1.0]) @ truth.intrinsics.matrix)
    alone = SoughtCamera("one", [SoughtLens.known(wide)])
    with_other = replace(alone, other_lenses=[SoughtLens.known(truth.intrinsics)])
    answers = [
        relocalise(PITCH, FieldMap.of(PITCH), one, Channels([frame]), response, 1) for one in (alone, with_other)
    ]
    assert answers[0].refusal is not None
    assert answers[1].refusal is None


def test_a_camera_stands_where_it_may():
    _, _, answer = found("football", "SIDELINE", lens_is_known=True, place=Place("far"))
    assert answer.candidates[0].camera.pose.position[1] > 0


def test_three_lines_do_not_tell_a_lens_and_are_refused_with_the_pixels_that_it_leaves_open():
    # One line along padel's service boxes, and what of the lines across it is seen between two markings.
    court = field("padel")
    corner = camera("one", (5.3, -8.8, 7.2), (-1.0, 4.0), focal=700.0)
    answer = search(court, corner, paint_frame(court, corner), lens_is_known=False)
    assert answer.candidates[0].shift_px > 1.2
    assert answer.refusal.reason == "few-lines"
    assert "do not tell lens and pose apart" in answer.refusal.words


def test_a_lens_that_bends_the_picture_back_before_its_corners_does_not_see_all_of_its_frame():
    # Netball: the lens that fitted all lines but those at the right edge, where it put them back into the picture.
    folded = camera("one", (0.2, -12.9, 9.6), (0.0, 0.0), focal=697.0, distortion=(-0.289, 0.009, 0.0, 0.0))
    assert not sees_all_of_its_frame(folded.intrinsics)
    assert sees_all_of_its_frame(SIDELINE.intrinsics)


def test_a_yard_line_too_far_is_left_for_the_true_one():
    pitch = field("american-football")
    truth = camera("one", (15.0, -44.0, 22.0), (35.0, -10.0), focal=900.0)
    answer = search(pitch, truth, paint_frame(pitch, truth))
    assert off_px(pitch, truth, answer.candidates[0].camera) < 0.5


def test_a_frame_without_lines_finds_nothing_and_says_so():
    answer = search(PITCH, SIDELINE, GREEN)
    assert answer.refusal.reason in ("no-lines", "lines", "few-lines")


def test_two_parallel_lines_are_no_field():
    frame = GREEN.copy()
    frame[200:204] = frame[300:304] = 240
    answer = search(PITCH, SIDELINE, frame)
    assert answer.refusal is not None
    assert answer.refusal.words


def candidate(found_of_100, explained_of_100, iou, residual_px=0.4):
    """What is seen of 100 pieces of expected line, and which of 100 places on paint lie on one."""
    seen = Evidence(np.arange(100), np.zeros(100, int), np.ones(100), np.arange(100) < found_of_100, np.zeros(100))
    explains = np.isin(np.arange(100), explained_of_100)
    agreement = 2 / (1 / seen.agreement + 1 / explains.mean())
    return Candidate(
        SIDELINE, agreement, explains, seen, Overlap(iou, found_of_100 / 100, 0.0), residual_px, None, None
    )


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


def test_a_pose_that_misses_more_and_explains_nothing_of_its_own_is_no_rival():
    # American football: the same field a few yard lines farther on, with its goal line where there is none.
    best, shifted = candidate(99, range(90), iou=0.91), candidate(90, range(88), iou=0.81)
    assert not explains_nearly_as_well(shifted, best)


def test_a_pose_that_explains_paint_that_the_best_does_not_is_a_rival():
    best, other = candidate(99, range(90), iou=0.91), candidate(90, range(5, 93), iou=0.81)
    assert explains_nearly_as_well(other, best)


def test_a_pose_is_no_rival_of_one_that_explains_all_that_it_does_and_more():
    # Tennis: a court half as far along, whose expected lines are rather seen, but whose paint is a third of nothing.
    best, shifted = candidate(76, range(95), iou=0.62), candidate(85, range(68), iou=0.71)
    assert not explains_nearly_as_well(shifted, best)
    # American football: yard lines farther on, with less of its lines seen and less of the paint explained.
    best, shifted = candidate(96, range(99), iou=0.85), candidate(93, range(92), iou=0.78)
    assert not explains_nearly_as_well(shifted, best)


def test_a_pose_is_no_rival_of_one_that_explains_the_same_and_sees_more_of_its_lines():
    # American football: yard lines farther on, one of them where there is none.
    best, shifted = candidate(95, range(98), iou=0.86), candidate(88, range(98), iou=0.78)
    assert not explains_nearly_as_well(shifted, best)
    alike = candidate(93, range(98), iou=0.84)
    assert explains_nearly_as_well(alike, best)


def test_a_pose_that_explains_no_more_and_whose_lines_lie_clearly_farther_off_is_no_rival():
    # American football through a lens that is sought: it bends to meet the yard lines farther on, and does not quite.
    best = candidate(99, range(96), iou=0.88, residual_px=0.17)
    assert explains_nearly_as_well(candidate(99, range(5, 97), iou=0.89, residual_px=0.2), best)
    assert not explains_nearly_as_well(candidate(99, range(5, 97), iou=0.89, residual_px=0.55), best)
    # One of which too little was measured may be the true one.
    assert explains_nearly_as_well(candidate(99, range(5, 97), iou=0.89, residual_px=None), best)
