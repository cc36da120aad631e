"""Points by the names that people give them."""

import pytest

from fields.landmarks import UnknownLandmark, find
from fields.template import NAMES, load

SIZE = {"length": 105.0, "width": 68.0, "line": 0.12}


def football(name):
    return find(name, load("football"), SIZE)


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("left penalty area, near corner", (-36, -20.16)),
        ("right goal area, far corner", (47, 9.16)),
        ("left goal, near post", (-52.5, -3.66)),
        ("right far corner", (52.5, 34)),
        ("halfway line, far end", (0, 34)),
        ("centre circle, near", (0, -9.15)),
        ("centre mark", (0, 0)),
        ("near touchline, level with the left penalty area", (-36, -34)),
        ("far touchline, level with the right penalty mark", (41.5, 34)),
        ("near touchline, 22 m from the left goal line", (-30.5, -34)),
        ("far touchline, 49.5 m from the right goal line", (3, 34)),
    ],
)
def test_points_of_a_football_pitch_have_names(name, place):
    assert football(name) == pytest.approx(place)


@pytest.mark.parametrize(
    "name", ["LEFT  Penalty-Area,near corner", " left penalty area near corner ", "Left penalty area: near corner"]
)
def test_case_spaces_and_punctuation_do_not_matter(name):
    assert football(name) == football("left penalty area, near corner")


def test_americans_may_write_center():
    assert football("Center Circle, near") == football("centre circle, near")
    assert football("near touchline, 5.50m from the left goal line") == pytest.approx((-47, -34))


def test_a_name_that_is_none_suggests_those_that_are_like_it():
    with pytest.raises(UnknownLandmark, match="left penalty area, near corner") as unknown:
        football("left penalty box, near corner")
    assert unknown.value.near[0] == "left penalty area, near corner"


def test_a_name_like_no_other_suggests_nothing():
    with pytest.raises(UnknownLandmark, match=r"^no point is called 'qqq'$"):
        football("qqq")


@pytest.mark.parametrize(
    ("name", "like"),
    [
        ("baseline", "near doubles sideline, {distance} m from the left baseline"),
        ("baseline right far", "far doubles sideline, {distance} m from the right baseline"),
        ("service", "left service line, near end"),
        ("servise", "left service line, near end"),
    ],
)
def test_a_word_of_a_name_suggests_those_that_have_it(name, like):
    with pytest.raises(UnknownLandmark) as unknown:
        find(name, load("tennis"), {})
    assert like in unknown.value.near


def test_a_distance_needs_a_number():
    with pytest.raises(UnknownLandmark, match=r"near touchline, \{distance\} m from the left goal line"):
        football("near touchline, some m from the left goal line")


@pytest.mark.parametrize("name", NAMES)
def test_every_named_point_is_found_on_its_field(name):
    template = load(name)
    size = {measure: extent.default for measure, extent in template.size.items()}
    for called, place in template.places(size).items():
        assert find(called.upper(), template, size) == place
        assert abs(place[0]) <= size["length"] / 2
        assert abs(place[1]) <= size["width"] / 2
