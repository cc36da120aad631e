import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from testbed.synthetic import PITCH, camera
from worker.calibration.checking.changes import columns_of, fewest_changes, shift_px
from worker.calibration.geometry.derivatives import moved
from worker.calibration.geometry.parameters import with_lens_changed

pytestmark = pytest.mark.slow

TOLERANCE_PX = 4.0
WIDE = camera("wide", (-6.0, -46.0, 11.0), (-14.0, 0.0), focal=1900.0, size=(3840, 2160))
# Clearly more than the tolerance, each by itself.
BY = {"turned": [0.02, -0.03, 0.02], "zoomed": [130.0], "moved": [1.5, -1.2, 0.9]}


def after(one, changes, times=1.0):
    by = np.zeros(12)
    for change in changes:
        by[columns_of(change)] = times * np.array(BY[change])
    return with_lens_changed(moved(one, by[:6]), by[6:])


@pytest.mark.parametrize(
    "changes",
    [(), ("turned",), ("zoomed",), ("moved",), ("turned", "zoomed"), ("turned", "moved"), ("zoomed", "moved")],
)
@settings(max_examples=4)
@given(times=st.floats(0.6, 1.5))
def test_no_more_changes_are_named_than_happened(changes, times):
    found = fewest_changes(PITCH, WIDE, after(WIDE, changes, times), TOLERANCE_PX)
    assert found.changes == changes
    expected = after(WIDE, changes, times)
    assert found.camera.pose.position == pytest.approx(expected.pose.position, abs=1e-3)
    assert found.camera.intrinsics.focal_length_px == pytest.approx(expected.intrinsics.focal_length_px, rel=1e-4)


def test_what_is_off_by_less_than_the_tolerance_is_no_change_of_its_own():
    """A file's place is good to some decimetres: a camera that was turned has not moved for that."""
    off = moved(WIDE, np.array([0, 0, 0, 0.05, -0.05, 0.03]))
    assert fewest_changes(PITCH, off, after(WIDE, ("turned",)), TOLERANCE_PX).changes == ("turned",)


def test_a_change_that_explains_less_than_the_tolerance_is_not_named():
    """What the lens of a file is off by is not made up for by a turn."""
    there = with_lens_changed(after(WIDE, ("zoomed",)), np.array([0, 0, 0, 0.03, 0, 0]))
    by_zoom = fewest_changes(PITCH, WIDE, there, 1e3 * TOLERANCE_PX, [6])
    tolerance = shift_px(PITCH, by_zoom.camera, there) / 1.1
    assert by_zoom.changes == ()
    assert fewest_changes(PITCH, WIDE, there, tolerance).changes == ("zoomed",)


def test_all_three_changes_are_named_where_two_explain_too_little():
    assert fewest_changes(PITCH, WIDE, after(WIDE, BY), TOLERANCE_PX).changes == ("turned", "zoomed", "moved")


@pytest.mark.parametrize("change", [[0, np.pi, 0, 0, 0, 0], [0, 0, 0, 0, 500, 0]])
def test_a_camera_that_was_meant_to_see_nothing_of_the_field_is_far_off(change):
    assert shift_px(PITCH, moved(WIDE, np.array(change, float)), WIDE) == np.inf
    assert shift_px(PITCH, WIDE, WIDE) == 0


def test_a_lens_that_may_be_any_explains_what_it_can():
    there = with_lens_changed(WIDE, np.array([60.0, 9.0, -7.0, 0.0, 0.01, 0.0]))
    assert fewest_changes(PITCH, WIDE, there, 1.0, range(6, 12)).changes == ()
    assert fewest_changes(PITCH, WIDE, after(there, ("turned",)), 1.0, range(6, 12)).changes == ("turned",)
