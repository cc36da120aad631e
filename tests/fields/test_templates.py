"""Templates against the measures that the laws print: outer edges, inner edges and middles of the paint."""

import math
import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fields.measures import value
from fields.shapes import Arc, Line, Spot, dashes
from fields.template import NAMES, Template, load

every = pytest.mark.parametrize("name", NAMES)
DOCUMENT = (Path(__file__).parents[2] / "docs" / "fields.md").read_text()


def usual(name):
    return {measure: extent.default for measure, extent in load(name).size.items()}


def shapes(name, **size):
    return {shape.name: shape for shape in load(name).markings(usual(name) | size)}


def edges(line, axis):
    """Both edges of the paint of a straight line, along an axis that it does not run along."""
    (place,) = {point[axis] for point in line.points}
    return place - line.width / 2, place + line.width / 2


def outer(arc):
    return arc.radius + arc.width / 2


@every
def test_a_template_names_its_source_and_its_size(name):
    template = load(name)
    assert len(template.source) > 20
    assert {"length", "width", "line"} <= set(template.size)
    for extent in template.size.values():
        assert extent.least <= extent.default <= extent.most


@every
def test_a_template_has_a_row_with_its_usual_size_in_the_document(name):
    size = usual(name)
    row = rf"^\| `{name}` \| {size['length']:g} x {size['width']:g}[ ,].*\| {size['line']:g}[ ,]"
    assert re.search(row, DOCUMENT, re.MULTILINE)


@every
def test_names_of_markings_and_points_are_given_once(name):
    markings = [shape.name for shape in load(name).markings(usual(name))]
    assert len(set(markings)) == len(markings)
    assert not any("{" in name for name in [*markings, *load(name).places(usual(name))])


@every
def test_both_ends_are_mirror_images(name):
    found = shapes(name)
    for left in [shape for shape in found.values() if shape.name.startswith("left")]:
        right = found["right" + left.name.removeprefix("left")]
        assert right.reach == pytest.approx(left.reach)
        assert centre_of(right) == pytest.approx((-centre_of(left)[0], centre_of(left)[1]))


@every
def test_near_and_far_sides_are_mirror_images(name):
    def places(sign):
        return sorted((round(x, 6), round(sign * y, 6)) for x, y in map(centre_of, shapes(name).values()))

    assert places(1) == places(-1)


def centre_of(shape):
    """A point in the middle of a shape."""
    match shape:
        case Line():
            return tuple((a + b) / 2 for a, b in zip(shape.points[0], shape.points[-1], strict=True))
        case Arc():
            middle = (shape.start + shape.end) / 2
            return tuple(c + shape.radius * f(middle) for c, f in zip(shape.centre, (math.cos, math.sin), strict=True))
        case Spot():
            return shape.centre


MARKINGS = {
    "american-football": 385,
    "basketball": 26,
    "beach-volleyball": 4,
    "football": 27,
    "futsal": 25,
    "handball": 185,
    "hockey": 69,
    "ice-hockey": 53,
    "lacrosse": 17,
    "netball": 9,
    "padel": 3,
    "rugby-union": 56,
    "tennis": 11,
    "volleyball": 31,
}


@every
def test_every_marking_is_there(name):
    assert name in MARKINGS, f"count the markings of {name} by its rules, and put the number into MARKINGS"
    assert len(shapes(name)) == MARKINGS[name]


def test_only_ice_hockey_has_lines_that_are_not_white():
    coloured = {name for name in NAMES if any(shape.colour != "white" for shape in shapes(name).values())}
    assert coloured == {"ice-hockey"}


@settings(max_examples=25)
@given(st.data())
@every
def test_markings_of_any_size_stay_on_the_field(name, data):
    size = {measure: data.draw(st.floats(e.least, e.most)) for measure, e in load(name).size.items()}
    for shape in load(name).markings(size):
        x, y = shape.reach
        assert x < size["length"] / 2 + 2
        assert y < size["width"] / 2 + 2


@pytest.mark.parametrize(("length", "width"), [(105, 68), (90, 45), (120, 90)])
def test_only_the_boundary_of_football_follows_its_size(length, width):
    found = shapes("football", length=length, width=width)
    assert edges(found["left goal line"], 0)[0] == pytest.approx(-length / 2)
    assert edges(found["far touchline"], 1)[1] == pytest.approx(width / 2)
    assert edges(found["left penalty area, front"], 0)[1] == pytest.approx(-length / 2 + 16.5)
    assert edges(found["left penalty area, far side"], 1)[1] == pytest.approx(20.16)
    assert edges(found["right goal area, front"], 0)[0] == pytest.approx(length / 2 - 5.5)
    assert edges(found["right goal area, near side"], 1)[0] == pytest.approx(-9.16)
    assert found["right penalty mark"].centre == pytest.approx((length / 2 - 11, 0))
    assert [outer(found[name]) for name in ("centre circle", "left penalty arc")] == pytest.approx([9.15, 9.15])
    assert outer(found["right far corner arc"]) == pytest.approx(1)


def test_the_penalty_area_of_futsal_is_round():
    found = shapes("futsal")
    near = found["left penalty area, near side"]
    assert (near.centre, outer(near)) == ((-20, -1.58), pytest.approx(6))
    assert math.dist(*found["left penalty area, front"].points) == pytest.approx(3.16)
    assert edges(found["left penalty area, front"], 0)[1] == pytest.approx(-14)
    assert found["left second penalty mark"].centre == (-10, 0)
    assert outer(found["centre circle"]) == pytest.approx(3)
    assert found["left retreat mark, far"].centre == (-10, 5)


def test_the_lines_of_handball_are_six_seven_and_nine_metres_from_the_goal():
    found = shapes("handball")
    assert edges(found["left goal-area line, front"], 0)[1] == pytest.approx(-14)
    assert math.dist(*found["left goal-area line, front"].points) == pytest.approx(3)
    assert edges(found["left 7-metre line"], 0)[1] == pytest.approx(-13)
    assert math.dist(*found["left 7-metre line"].points) == pytest.approx(1)
    assert edges(found["left goalkeeper's restraining line"], 0)[1] == pytest.approx(-16)
    dashes = [shape for shape in found.values() if shape.name.startswith("left free-throw line, front")]
    assert [edges(dash, 0)[1] for dash in dashes] == pytest.approx([-11] * len(dashes))
    assert [math.dist(*dash.points) for dash in dashes] == pytest.approx([0.15] * len(dashes))
    round_the_corner = [shape for shape in found.values() if shape.name.startswith("left free-throw line, near")]
    assert all(outer(dash) == pytest.approx(9) for dash in round_the_corner)
    assert max(dash.reach[1] for dash in round_the_corner) <= 10
    assert edges(found["left goal line"], 0) == pytest.approx((-20, -19.92))


def test_basketball_is_measured_from_the_inner_edges_of_its_boundary():
    found = shapes("basketball")
    assert edges(found["left endline"], 0)[1] == pytest.approx(-14)
    assert edges(found["far sideline"], 1)[0] == pytest.approx(7.5)
    assert edges(found["left free-throw line"], 0)[1] == pytest.approx(-14 + 5.8)
    assert edges(found["left restricted area, far side"], 1)[1] == pytest.approx(2.45)
    three, straight = found["left three-point line"], found["left three-point line, far end"]
    assert (three.centre, outer(three)) == (pytest.approx((-14 + 1.575, 0)), pytest.approx(6.75))
    assert edges(straight, 1)[1] == pytest.approx(7.5 - 0.9)
    assert math.dist(three.centre, straight.points[0]) == pytest.approx(three.radius)
    assert found["left no-charge line"].radius - 0.025 == pytest.approx(1.25)
    assert [outer(found[name]) for name in ("centre circle", "left free-throw semicircle")] == pytest.approx([1.8, 1.8])
    assert found["centre line"].reach[1] == pytest.approx(7.5 + 0.05 + 0.15)


def test_the_circles_of_hockey_are_two_quarters_and_a_line():
    found = shapes("hockey")
    near = found["left circle, near side"]
    assert (near.centre, outer(near)) == ((-45.7, -1.83), pytest.approx(14.63))
    assert edges(found["left circle, front"], 0)[1] == pytest.approx(-45.7 + 14.63)
    assert math.dist(*found["left circle, front"].points) == pytest.approx(3.66)
    assert edges(found["left 23-metre line"], 0)[1] == pytest.approx(-45.7 + 22.9)
    broken = [shape for shape in found.values() if shape.name.startswith("left broken circle, far")]
    assert [outer(dash) for dash in broken] == pytest.approx([19.63] * len(broken))
    assert found["right penalty spot"].centre == (pytest.approx(45.7 - 6.475), 0)
    assert edges(found["left penalty corner mark, 10 m, far"], 1)[1] == pytest.approx(1.88 + 10)
    assert edges(found["left 14.63-metre mark, near"], 0)[1] == pytest.approx(-45.7 + 14.63)


def test_the_field_of_play_of_rugby_lies_between_its_in_goals():
    found = shapes("rugby-union", length=122.0, in_goal=11.0)
    assert edges(found["left goal line"], 0)[1] == pytest.approx(-50)
    assert edges(found["left dead-ball line"], 0)[1] == pytest.approx(-61)
    assert edges(found["near touchline"], 1)[1] == pytest.approx(-35)
    assert edges(found["left 22-metre line"], 0)[1] == pytest.approx(-28)
    assert {dash.points[0][0] for name, dash in found.items() if name.startswith("right 10-metre line")} == {10}


FOOT, YARD, INCH = 0.3048, 0.9144, 0.0254


@pytest.mark.parametrize(("feet", "from_the_sideline"), [(18.5, 70.75), (40, 60), (160 / 3, 160 / 3)])
def test_the_hash_marks_of_american_football_are_where_each_law_has_them(feet, from_the_sideline):
    found = shapes("american-football", hash=feet * FOOT)
    near = [mark for name, mark in found.items() if name.startswith("left near hash mark")]
    assert {round(max(y for _, y in mark.points), 4) for mark in near} == {round((from_the_sideline - 80) * FOOT, 4)}
    assert [math.dist(*mark.points) for mark in near] == pytest.approx([2 * FOOT] * 40)
    assert edges(found["right far inbounds mark, 9"], 1)[0] == pytest.approx((80 - from_the_sideline) * FOOT)


def test_american_football_is_a_hundred_yards_between_two_end_zones():
    found = shapes("american-football")
    assert edges(found["left end line"], 0) == pytest.approx((-66 * YARD + 4 * YARD, -60 * YARD))
    assert edges(found["far sideline"], 1) == pytest.approx((80 * FOOT, 86 * FOOT))
    assert edges(found["left goal line"], 0) == pytest.approx((-50 * YARD - 8 * INCH, -50 * YARD))
    for yards in range(5, 50, 5):
        line = found[f"left {yards}-yard line"]
        assert line.points[0] == pytest.approx((-(50 - yards) * YARD, -80 * FOOT + 8 * INCH))
        assert line.width == pytest.approx(4 * INCH)
    ticks = [mark.points[0][0] for name, mark in found.items() if name.startswith("right far sideline tick")]
    assert sorted(round(tick / YARD, 6) for tick in ticks) == [yard for yard in range(1, 50) if yard % 5]
    assert found["right try line"].points[0][0] == pytest.approx(48 * YARD)
    assert math.dist(*found["right try line"].points) == pytest.approx(YARD)


def test_tennis_is_measured_to_the_outside_of_its_lines():
    found = shapes("tennis")
    assert edges(found["left baseline"], 0) == pytest.approx((-11.885, -11.785))
    assert edges(found["near doubles sideline"], 1)[0] == pytest.approx(-10.97 / 2)
    assert edges(found["far singles sideline"], 1)[1] == pytest.approx(8.23 / 2)
    assert edges(found["right service line"], 0)[1] == pytest.approx(6.4)
    assert found["centre service line"].width == found["left centre mark"].width == 0.05
    assert math.dist(*found["left centre mark"].points) == pytest.approx(0.1)


def test_the_attack_lines_of_volleyball_go_on_in_five_dashes():
    found = shapes("volleyball")
    assert edges(found["left end line"], 0)[0] == pytest.approx(-9)
    assert edges(found["far side line"], 1)[1] == pytest.approx(4.5)
    assert edges(found["left attack line"], 0)[0] == pytest.approx(-3)
    prolonged = [dash.points for name, dash in found.items() if name.startswith("right attack line, far")]
    ends = [y for points in prolonged for _, y in points]
    assert ends == pytest.approx([4.5 + far for far in (0.2, 0.35, 0.55, 0.7, 0.9, 1.05, 1.25, 1.4, 1.6, 1.75)])
    assert found["left service zone, near mark"].reach == pytest.approx((9.35, 4.475))


def test_the_attack_lines_of_volleyball_end_at_the_side_line_where_nothing_else_is_painted():
    assert not [name for name in shapes("volleyball", prolongation=0.0) if "prolongation" in name]


def test_beach_volleyball_has_nothing_but_its_boundary():
    found = shapes("beach-volleyball")
    assert set(found) == {"near side line", "far side line", "left end line", "right end line"}
    assert edges(found["right end line"], 0)[1] == pytest.approx(8)
    assert edges(found["near side line"], 1)[0] == pytest.approx(-4)


def test_the_men_s_field_of_lacrosse_is_in_yards():
    found = shapes("lacrosse")
    assert edges(found["left end line"], 0)[1] == pytest.approx(-55 * YARD)
    assert edges(found["near sideline"], 1)[1] == pytest.approx(-30 * YARD)
    assert found["left goal line"].points == (pytest.approx((-40 * YARD, -YARD)), pytest.approx((-40 * YARD, YARD)))
    crease = found["left crease"]
    assert (*crease.centre, outer(crease)) == pytest.approx((-40 * YARD, 0, 9 * FOOT))
    assert found["left restraining line"].points[0][0] == pytest.approx(-20 * YARD)
    (end, y), (front, _) = found["left goal area, near side"].points
    assert (end, front, y) == pytest.approx((-55 * YARD, -20 * YARD, -20 * YARD))
    assert found["far wing line"].points == (
        pytest.approx((-10 * YARD, 20 * YARD)),
        pytest.approx((10 * YARD, 20 * YARD)),
    )


def test_ice_hockey_is_measured_from_its_boards():
    found = shapes("ice-hockey")
    assert found["left goal line"].points[0] == pytest.approx((-26, -6.5 - math.sqrt(8.5**2 - 4.5**2)))
    assert found["left blue line"].points[1] == pytest.approx((-7.14, 15))
    assert {found[name].width for name in ("left blue line", "right blue line", "centre line")} == {0.3}
    assert found["right far face-off spot"].centre == pytest.approx((20, 7))
    assert found["right far neutral face-off spot"].centre == pytest.approx((7.14 - 0.15 - 1.5, 7))
    assert [outer(found[name]) for name in ("centre circle", "left near face-off circle")] == pytest.approx([4.5, 4.5])
    crease = found["left crease"]
    assert (outer(crease), crease.end - crease.start) == (pytest.approx(1.8), pytest.approx(math.pi))
    colours = {
        name: found[name].colour for name in ("left goal line", "left blue line", "centre line", "centre circle")
    }
    assert list(colours.values()) == ["red", "blue", "red", "blue"]


def test_the_marks_of_a_face_off_circle_are_outside_of_it_and_its_ls_beside_the_spot():
    found = shapes("ice-hockey")
    marks = [shape for name, shape in found.items() if name.startswith("left far face-off circle, ")]
    for mark in marks:
        assert min(math.dist(point, (-20, 7)) for point in mark.points) == pytest.approx(4.5)
        assert math.dist(*mark.points) == pytest.approx(0.6)
    behind, ahead = sorted({mark.points[0][0] for mark in marks})
    assert ahead - behind - 0.05 == pytest.approx(1.7)
    far, corner, aside = found["left far face-off spot, far L towards the middle"].points
    assert far == pytest.approx((-20 + 0.3 + 0.3 + 1.2, 7 + 0.225 + 0.025))
    assert corner == pytest.approx((-20 + 0.3 + 0.3 + 0.025, 7 + 0.225 + 0.025))
    assert aside[1] - corner[1] == pytest.approx(0.9)


def test_the_crease_of_the_nhl_has_straight_sides():
    nhl = {
        "length": 200 * FOOT,
        "width": 85 * FOOT,
        "goal_line": 11 * FOOT,
        "crease": 6 * FOOT,
        "crease_width": 8 * FOOT,
    }
    found = shapes("ice-hockey", **nhl)
    side = found["right crease, far side"]
    assert edges(side, 1)[1] == pytest.approx(4 * FOOT)
    assert math.dist(*side.points) == pytest.approx(4.5 * FOOT, abs=0.02)
    assert side.points[0][0] == pytest.approx(89 * FOOT - math.dist(*side.points))
    assert found["right blue line"].points[0][0] == pytest.approx(25 * FOOT)


def test_netball_is_divided_into_thirds():
    found = shapes("netball")
    assert edges(found["left goal line"], 0)[0] == pytest.approx(-15.25)
    assert edges(found["far side line"], 1)[1] == pytest.approx(7.625)
    assert found["right transverse line"].points[0][0] == pytest.approx(30.5 / 6)
    assert found["left goal circle"].centre == (-15.25, 0)
    assert [outer(found[name]) for name in ("left goal circle", "centre circle")] == pytest.approx([4.9, 0.45])


def test_the_service_lines_of_padel_are_three_metres_from_the_walls():
    found = shapes("padel")
    assert edges(found["right service line"], 0) == pytest.approx((6.95, 7.0))
    assert found["right service line"].reach[1] == 5
    assert found["central service line"].reach[0] == pytest.approx(7.2)


def test_a_line_of_no_length_is_not_painted():
    assert Template(marking=[{"name": "none", "line": [[1, 2], [1, 2]]}]).markings({"line": 0.05}) == []


def test_dashes_are_whole_and_one_is_in_the_middle():
    line = Line("line", ((0.0, 0.0), (10.0, 0.0)), 0.1)
    pieces = line.pieces(dashes(line.length, 1.0, 2.0))
    assert [dash.points for dash in pieces] == [((1.5, 0), (2.5, 0)), ((4.5, 0), (5.5, 0)), ((7.5, 0), (8.5, 0))]
    quarter = Arc("arc", (0.0, 0.0), 2.0, 0.0, math.pi / 2, 0.1)
    around = quarter.pieces(dashes(quarter.length, 0.5, 0.5))
    assert [(dash.start + dash.end) / 2 * 2 for dash in around] == pytest.approx([math.pi / 2 + n for n in (-1, 0, 1)])


@given(st.floats(-4, 4), st.floats(0.01, 2 * math.pi))
def test_an_arc_reaches_as_far_as_its_farthest_point(start, span):
    arc = Arc("arc", (1.0, -2.0), 3.0, start, start + span, 0.1)
    angles = [start + span * n / 2000 for n in range(2001)]
    points = [(1 + 3 * math.cos(angle), -2 + 3 * math.sin(angle)) for angle in angles]
    assert arc.reach == pytest.approx([max(map(abs, along)) for along in zip(*points, strict=True)], abs=1e-4)


def test_measures_are_sums_and_products():
    assert value("-(length/2 - 16.5) + sqrt(2*2)", {"length": 105.0}) == pytest.approx(-34)
    for wrong in ("width", "length.real", "length[0]", "__import__('os')", "length ** 2", "'a'"):
        with pytest.raises(ValueError, match="is neither a number, a known measure"):
            value(wrong, {"length": 105.0})


def test_a_marking_of_no_shape_is_named():
    with pytest.raises(ValueError, match="blob is neither a line, an arc, a circle nor a spot"):
        Template(marking=[{"name": "blob", "blob": 1}]).markings({"line": 0.1})


def test_markings_are_white_unless_they_have_a_colour_and_keep_it_at_both_ends_and_in_dashes():
    line = {"line": [[-3, 0], [-1, 0]], "dash": {"paint": 0.2, "gap": 0.3}}
    plan = Template(
        marking=[{"name": "plain", "spot": {"centre": [0, 0], "diameter": 0.2}}],
        end=[{"name": "{end} red", "colour": "red", **line}],
    )
    plain, *ends = plan.markings({"line": 0.05})
    assert plain.colour == "white"
    assert {shape.colour for shape in ends} == {"red"}
    assert len(ends) == 6


def test_a_row_repeats_a_marking_and_a_row_of_rows_the_row():
    tick = {
        "name": "tick",
        "line": [[0, 0], [0, 1]],
        "rows": [{"step": [10, 0], "count": 2}, {"step": [1, 0], "count": 3}],
    }
    ticks = Template(marking=[tick]).markings({"line": 0.05})
    assert [shape.points[0][0] for shape in ticks] == [0, 1, 2, 10, 11, 12]
    assert [shape.name for shape in ticks[2:4]] == ["tick, 1, 3", "tick, 2, 1"]
