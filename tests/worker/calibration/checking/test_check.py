"""The course of a check: what is searched for a camera that is not accepted where its file puts it."""

from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import patch

import pytest

from testbed.synthetic import PITCH, paint_frame
from tests.worker.calibration.gate.good_result import LEFT, good, seen
from tests.worker.calibration.outdated_pair import white_on_green
from worker.calibration.checking import check
from worker.calibration.gate.quality import Refusal

pytestmark = pytest.mark.slow


def searches_after(result):
    """What each search of a check knows of its camera's place, if every calibration ends with this result."""
    searched = []

    def search(pitch, sought, *_):
        searched.extend("anywhere" if one.place.is_anywhere else "on its mount" for one in sought)
        return SimpleNamespace(cameras=[])

    with (
        patch.object(check, "calibrate", return_value=SimpleNamespace(cameras=[result])),
        patch.object(check, "find_cameras", search),
    ):
        frames = {LEFT.id: [paint_frame(PITCH, LEFT)]}
        (checked,) = check.check_cameras(PITCH, [check.GivenCamera(LEFT)], frames, white_on_green)
    assert checked.found is None
    return searched


def test_a_camera_that_is_lost_is_searched_everywhere():
    lost = replace(good(), evidence=seen(0.3), refusal=Refusal("lines", "its lines are not seen"))
    assert searches_after(lost) == ["on its mount", "anywhere", "on its mount"]


@pytest.mark.parametrize("reason", ["residual", "undetermined"])
def test_a_camera_whose_frame_is_explained_is_searched_only_through_other_lenses(reason):
    inexact = replace(good(), refusal=Refusal(reason, "its lines lie too far off"))
    assert searches_after(inexact) == ["on its mount", "on its mount"]
