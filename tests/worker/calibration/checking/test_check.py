"""The course of a check: what is searched for a camera that is not accepted where its file puts it."""

from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import patch

import pytest

from testbed.synthetic import PITCH, moved, paint_frame
from tests.worker.calibration.gate.good_result import LEFT, good, on_ground, seen
from tests.worker.calibration.outdated_pair import white_on_green
from worker.calibration.checking import check
from worker.calibration.gate.quality import Refusal

pytestmark = pytest.mark.slow


def checked_with(result):
    """A camera and what each search of its check knows of its place, if every calibration ends with this result."""
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
    return checked, searched


def refused(reason, **changes):
    return replace(good(), refusal=Refusal(reason, "its lines lie too far off"), **changes)


TURNED = {"camera": moved(LEFT, (0.02, 0.0, 0.0))}
THROUGH_OTHER_LENSES = ["on its mount"] * 2


@pytest.mark.parametrize(
    ("result", "expected"),
    [
        (refused("lines", evidence=seen(0.3)), ["on its mount", "anywhere", "on its mount"]),
        # Turned, and its frame is explained.
        (refused("residual", **TURNED), THROUGH_OTHER_LENSES),
        (refused("zoomed", **TURNED), THROUGH_OTHER_LENSES),
        # The lines leave its pose open.
        (refused("undetermined", ground_sigma=on_ground(1.0, 9.0)), THROUGH_OTHER_LENSES),
    ],
)
def test_a_camera_is_searched_where_its_refusal_leaves_it_to_be_found(result, expected):
    checked, searched = checked_with(result)
    assert searched == expected
    if result.refusal.reason in ("lines", "undetermined"):
        assert checked.found is None
    else:
        assert checked.moved_px > 10


@pytest.mark.parametrize("reason", ["residual", "zoomed"])
def test_where_the_markings_lie_is_told_without_the_exactness_of_a_pose_that_is_stored(reason):
    checked, searched = checked_with(refused(reason, residual_px=9.0))
    assert searched == []
    assert checked.moved_px < 1e-9
