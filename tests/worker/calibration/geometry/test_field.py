"""The pitch: markings by the Laws of the Game, and the roof."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fields.template import Template, load
from testbed.parameters import try_first
from testbed.synthetic import CROWNED, PITCH
from tests.worker.calibration import sports
from worker.calibration.geometry.field import Field, marks_with_free_ends, resample

pytestmark = pytest.mark.slow


def test_the_roof_is_flat_at_the_boundary_and_highest_along_the_ridge():
    edge = np.array([[-52.5, 10], [52.5, -34], [0, 34], [20, -34], [60, 0], [0, 40]])
    np.testing.assert_allclose(CROWNED.height(edge), 0, atol=1e-12)
    np.testing.assert_allclose(CROWNED.height(np.array([[-18.5, 0], [0, 0], [18.5, 0]])), 0.35)
    assert CROWNED.height(np.array([0.0, 17.0])) == pytest.approx(0.175)
    assert CROWNED.height(np.array([-35.5, 0.0])) == pytest.approx(0.175)


def test_the_ends_of_the_ridge_may_come_in_either_order():
    swapped = Field(105, 68, ridge=CROWNED.ridge[::-1])
    somewhere = np.random.default_rng(0).uniform([-52, -34], [52, 34], size=(50, 2))
    np.testing.assert_array_equal(swapped.height(somewhere), CROWNED.height(somewhere))


def test_a_ridge_beside_the_middle_still_meets_the_corners_at_zero():
    pitch = Field(105, 68, ridge=np.array([[-10.0, 5.0, 0.3], [20.0, 5.0, 0.3]]))
    corners = np.array([[x, y] for x in (-52.5, 52.5) for y in (-34, 34)])
    np.testing.assert_allclose(pitch.height(corners), 0, atol=1e-12)
    assert pitch.height(np.array([0.0, 5.0])) == pytest.approx(0.3)
    halfway_to_the_touchlines = np.array([[0.0, (5.0 + 34.0) / 2], [0.0, (5.0 - 34.0) / 2]])
    np.testing.assert_allclose(pitch.height(halfway_to_the_touchlines), 0.15)
    halfway_to_the_goal_lines = np.array([[(20.0 + 52.5) / 2, 5.0], [(-10.0 - 52.5) / 2, 5.0]])
    np.testing.assert_allclose(pitch.height(halfway_to_the_goal_lines), 0.15)


def test_line_points_follow_the_surface():
    lines = CROWNED.line_points()
    np.testing.assert_allclose(lines.position[:, 2], CROWNED.height(lines.position[:, :2]))
    np.testing.assert_allclose(np.linalg.norm(lines.tangent, axis=1), 1)
    np.testing.assert_allclose(np.sum(lines.tangent[:, :2] * lines.normal[:, :2], axis=1), 0, atol=1e-4)


@given(st.floats(0.1, 3), st.integers(2, 6))
def test_resampled_points_are_evenly_spaced(spacing, corners):
    line = np.stack([np.arange(corners) * 10.0, np.zeros(corners)], axis=1)
    points, tangents = resample(line, spacing)
    steps = np.diff(points[:, 0])
    assert np.allclose(steps, steps[0]) if len(steps) else True
    assert points[0, 0] == pytest.approx((corners - 1) * 10 - points[-1, 0])
    np.testing.assert_allclose(tangents, [[1, 0]] * len(points))


def test_points_stay_the_same_points_on_a_pitch_of_other_measures():
    longer = CROWNED.resized(length=109.3, width=64.0)
    lines = CROWNED.line_points()
    same = longer.line_points()
    assert (same.marking == lines.marking).all()
    assert len(longer.drawn_anew().line_points()) != len(lines)
    assert len(longer.measured_points) == len(CROWNED.measured_points)
    touchline = lines.marking == 0
    along = lines.position[touchline, 0] / (CROWNED.length - 0.12)
    assert same.position[touchline, 0] / (longer.length - 0.12) == pytest.approx(along)


@pytest.mark.parametrize(
    ("sport", "mark", "length_m"),
    [
        ("american-football", "left near hash mark", 0.6096),
        ("handball", "right 7-metre line", 1.0),
        ("rugby-union", "left dash in front of the far post", 1.0),
    ],
)
def test_a_mark_with_two_free_ends_is_measured_from_end_to_end_as_well(sport, mark, length_m):
    pitch = sports.field(sport)
    lines, crosswise = pitch.measured_points, pitch.line_points()
    np.testing.assert_array_equal(lines[: len(crosswise)].position, crosswise.position)
    its = lines[lines.end_to_end & (np.array(pitch.whole_names())[lines.marking] == mark)]
    assert its.width == pytest.approx(length_m)
    for middle, across, number in zip(its.position, its.normal, its.marking, strict=True):
        ends = pitch.lift(pitch.markings()[number].centre)
        assert middle == pytest.approx(ends.mean(axis=0))
        assert abs((ends[1] - ends[0]) @ across) == pytest.approx(length_m, rel=1e-4)


@pytest.mark.parametrize("sport", ["basketball", "tennis", "volleyball"])
def test_lines_that_end_at_other_lines_have_no_free_ends(sport):
    pitch = sports.field(sport)
    ends = {pitch.markings()[number].name for number in marks_with_free_ends(pitch.markings())}
    assert not [name for name in ends if "baseline" in name or "sideline" in name or "free-throw" in name]


def test_a_field_of_another_size_has_the_same_marks_with_free_ends():
    lines = sports.field("rugby-union").measured_points
    same = sports.field("rugby-union").resized(width=69.0).measured_points
    np.testing.assert_array_equal(same.marking, lines.marking)
    np.testing.assert_array_equal(same.end_to_end, lines.end_to_end)


def test_a_ridge_gets_another_length_around_its_middle_as_far_as_there_is_room():
    ridge = np.array([[-10.0, 2.0, 0.3], [20.0, 2.0, 0.3]])
    pitch = Field(105.0, 68.0, ridge=ridge)
    assert (pitch.ridge_length, pitch.ridge_height) == (30.0, 0.3)
    assert pitch.with_ridge_length(10.0).ridge == pytest.approx(np.array([[0.0, 2.0, 0.3], [10.0, 2.0, 0.3]]))
    widest = pitch.with_ridge_length(500.0)
    assert widest.ridge[:, 0] == pytest.approx([5.0 - 47.5, 5.0 + 47.5])
    assert PITCH.with_ridge_length(8.0).height(np.array([3.0, 5.0])) == 0.0


def test_goal_lines_at_which_the_ridge_ends_go_over_the_crown_and_stay_on_it_at_another_length():
    gables, hips = PITCH.roofs()
    raised = gables.raised(0.3)
    for pitch in (raised, raised.resized(length=98.4, width=70.0), replace(raised, ridge=raised.ridge.round(1))):
        x, y = pitch.length / 2, pitch.width / 2
        along_the_goal_line = np.array([[x, -y], [x, -y / 2], [x, 0.0], [x, y / 2], [-x, 0.0], [x + 5.0, 0.0]])
        assert pitch.height(along_the_goal_line) == pytest.approx([0.0, 0.15, 0.3, 0.15, 0.3, 0.3])
    hipped = hips.raised(0.3)
    assert hipped.ridge[:, 0] == pytest.approx([-18.5, 18.5])
    assert hipped.height(np.array([[52.5, 0.0], [35.5, 0.0], [0.0, 17.0]])) == pytest.approx([0.0, 0.15, 0.15])


def test_markings_have_the_colour_of_their_paint():
    circle = {"name": "b", "circle": {"centre": [0, 0], "radius": 1}, "colour": "blue"}
    spot = {"name": "c", "spot": {"centre": [0, 0], "diameter": 0.3}, "colour": "#ffcc00"}
    plan = Template(marking=[{"name": "a", "line": [[0, 0], [1, 0]]}, circle, spot])
    assert [marking.colour for marking in Field(10, 5, 0.05, template=plan).markings()] == ["white", "blue", "#ffcc00"]


@pytest.mark.parametrize(
    ("sport", "usual"), try_first([("handball", (40, 20)), ("handball", (38, 18.4)), ("rugby-union", (120, 68))])
)
@settings(max_examples=10)
@given(by=st.floats(-1.5, 1.5))
def test_a_resized_field_has_the_same_dashes_where_its_broken_lines_are_now(sport, usual, by):
    template = load(sport)
    size = {name: extent.default for name, extent in template.size.items()}
    nominal = Field(*usual, size["line"], template=template)
    wider = nominal.resized(width=usual[1] + by).resized(length=usual[0] + by)
    assert [marking.name for marking in wider.markings()] == [marking.name for marking in nominal.markings()]
    lines = nominal.line_points(0.1)
    assert (wider.line_points(0.1).marking == lines.marking).all()
    if sport == "handball":
        dashes = [marking for marking in wider.markings() if "left free-throw line, far" in marking.name]
        ends = np.concatenate([dash.centre for dash in dashes])
        post = np.array([-wider.length / 2, 1.5])
        np.testing.assert_allclose(np.linalg.norm(ends - post, axis=1), 9 - 0.025)
        assert ends[:, 1].max() < wider.width / 2


def test_a_field_drawn_anew_has_whole_dashes_again():
    wider = Field(40, 20, 0.05, template=load("handball")).resized(width=19.2)
    anew = Field(40, 19.2, 0.05, template=load("handball"))
    assert len(wider.markings()) > len(anew.markings())
    assert len(wider.drawn_anew().markings()) == len(anew.markings())


def test_the_points_of_broken_lines_move_smoothly_with_the_width():
    nominal = Field(40, 20, 0.05, template=load("handball"))
    steps = [nominal.resized(width=20 + by).line_points().position for by in (0.0, 0.01, 0.02)]
    np.testing.assert_allclose(steps[1] - steps[0], steps[2] - steps[1], atol=2e-4)
    assert np.abs(steps[1] - steps[0]).max() < 0.03
