"""Who is to blame where cameras contradict each other, and what is no contradiction."""

import numpy as np
import pytest

from testbed import synthetic
from testbed.synthetic import PITCH, moved, paint_markings
from tests.scenes import row
from worker.calibration.detection.evidence import Evidence
from worker.calibration.diagnostics.registration import Response
from worker.calibration.gate.pairs import CameraResponse, Pair, compare_pairs, find_contradictions, stitch_error_px
from worker.calibration.geometry.camera import Camera, inside


def pair(cameras: str, error_px: float | None, *, plenty: bool = True, confirmed: bool = False) -> Pair:
    return Pair(cameras[0], cameras[1], error_px, plenty, confirmed)


def seeing(one: Camera, response: Response, share: float = 1.0) -> CameraResponse:
    """A camera that finds a share of its lines where its pose puts them."""
    index = np.flatnonzero(inside(one.project(PITCH.line_points().position), one.intrinsics.size))
    found = index % 10 < 10 * share
    evidence = Evidence(index, index, np.ones(len(index)), found, np.zeros(len(index)))
    return CameraResponse(one, response, lambda: evidence)


def blamed(*pairs: Pair) -> set[str]:
    return {camera for one in find_contradictions(pairs) for camera in one.blamed}


def test_cameras_that_agree_are_not_to_blame_for_anything() -> None:
    assert blamed(pair("ab", 0.2), pair("bc", 1.4)) == set()


def test_two_that_are_less_than_a_pixel_of_their_frames_apart_agree_however_much_grass_that_is() -> None:
    assert Pair("a", "b", 4.0, plenty=True, confirmed=True, shift_px=0.9).agrees()
    beyond = Pair("a", "b", 4.0, plenty=True, confirmed=True, shift_px=1.2)
    assert beyond.disagrees()
    assert "stitch error 4.00 px, at most 1.5 allowed, which is 1.2 px of a frame" in beyond.words()


def test_a_pair_says_by_how_many_pixels_of_a_frame_it_is_apart() -> None:
    """Two cameras 40 m from the middle, one of which is turned by half a degree: about five pixels."""
    one, other = synthetic.pair(())
    turned = moved(other, rotation=(0.0, 0.0, np.radians(0.5)))
    responses = [paint_markings(PITCH, camera) for camera in (one, other)]
    (apart,) = compare_pairs(PITCH, [seeing(one, responses[0]), seeing(turned, responses[1])])
    assert apart.shift_px == pytest.approx(np.radians(0.5) * 600, rel=0.35)
    assert not apart.agrees()


@pytest.mark.parametrize("error_px", [4.0, None])
def test_two_that_contradict_each_other_are_both_to_blame(error_px: float | None) -> None:
    assert blamed(pair("ab", error_px)) == {"a", "b"}


@pytest.mark.parametrize("error_px", [4.0, None])
def test_whom_others_hold_is_not_to_blame_for_one_that_agrees_with_nobody(error_px: float | None) -> None:
    assert blamed(pair("ab", 0.2), pair("bc", error_px), pair("ac", error_px)) == {"c"}


def test_two_that_others_hold_contradict_each_other_only_where_they_share_plenty_and_can_be_compared() -> None:
    agree = [pair("ab", 0.9), pair("bc", 0.9)]
    assert blamed(*agree, pair("ac", 2.0)) == {"a", "c"}
    assert blamed(*agree, pair("ac", 2.0, plenty=False)) == set()
    assert blamed(*agree, pair("ac", None)) == set()


def test_two_that_share_too_little_to_be_compared_say_nothing_of_each_other() -> None:
    assert blamed(pair("ab", None, plenty=False)) == set()
    assert blamed(pair("ab", None, plenty=False), pair("bc", 4.0)) == {"b", "c"}


def test_two_that_see_what_they_share_where_their_poses_put_it_need_not_register() -> None:
    assert blamed(pair("ab", None, confirmed=True)) == set()
    assert blamed(pair("ab", 4.0, confirmed=True)) == {"a", "b"}


def test_a_contradiction_is_told_with_both_names_and_with_whose_fault_it_is() -> None:
    (both,) = find_contradictions([pair("ab", 4.0)])
    assert both.words().startswith("the cameras a and b do not fit each other: stitch error 4.00 px, at most 1.5")
    (one,) = find_contradictions([pair("ab", 0.1), pair("bc", None)])
    assert one.words().startswith("camera c: the views of b and c should show the same markings but cannot")


def test_the_stitch_error_is_that_of_the_worst_pair_that_can_be_compared() -> None:
    assert stitch_error_px([pair("ab", 0.2), pair("bc", 0.4), pair("ac", None, plenty=False)]) == 0.4
    assert stitch_error_px([pair("ab", 4.0)]) == 4.0
    assert stitch_error_px([pair("ab", 0.2), pair("bc", None)]) is None
    assert stitch_error_px([pair("ab", None, plenty=False)]) is None
    assert stitch_error_px([]) is None


def test_two_that_others_hold_and_that_share_little_have_no_say_in_the_stitch_error() -> None:
    assert stitch_error_px([pair("ab", 0.2), pair("bc", 0.3), pair("ac", 2.0, plenty=False)]) == 0.3


@pytest.mark.long
def test_of_three_in_a_row_the_neighbours_are_compared() -> None:
    masks = [paint_markings(PITCH, one) for one in row()]
    agreeing = compare_pairs(PITCH, [seeing(*each) for each in zip(row(), masks, strict=True)])
    assert [one.cameras for one in agreeing] == [("a", "b"), ("b", "c")]
    # Over the sides of the pictures, where a pixel is half a metre long.
    assert max(one.error_px or 0.0 for one in agreeing) < 0.3
    apart = [*row()[:2], moved(row()[2], by=(0.2, 0.0, 0.0))]
    disagreeing = compare_pairs(PITCH, [seeing(*each) for each in zip(apart, masks, strict=True)])
    assert stitch_error_px(disagreeing) == pytest.approx(2.0, abs=0.4)


def test_what_two_cameras_share_confirms_them_where_both_find_most_of_it() -> None:
    both, black = synthetic.pair(()), np.zeros((540, 960), np.float32)
    (found,) = compare_pairs(PITCH, [seeing(one, black) for one in both])
    assert (found.error_px, found.plenty, found.confirmed) == (None, True, True)
    (lost,) = compare_pairs(PITCH, [seeing(both[0], black), seeing(both[1], black, share=0.4)])
    assert (lost.confirmed, lost.missed) == (False, True)
