import json
import math
import re
from pathlib import Path

import pytest
from pydantic import ValidationError

from fields.landmarks import find
from fields.plans import other_shapes
from fields.shapes import Line, Spot
from fields.template import NAMES, load
from service.schemas.field import FieldOfPlay

OWN = {
    "template": {
        "markings": [
            {"name": "side", "line": [[-10, -5], [10, -5]]},
            {"name": "bow", "arc": {"centre": [0, 0], "start": [3, 0], "end": [0, 3]}, "width_m": 0.1},
            {"name": "ring", "circle": {"centre": [5, 0], "radius_m": 2}},
            {"name": "dot", "spot": {"centre": [0, 0], "diameter_m": 0.2}},
        ],
        "points": {"corner": [-10, -5]},
    },
    "length_m": 20,
    "width_m": 10,
    "line_width_m": 0.05,
}


def own(*markings, **more):
    return OWN | {"template": {"markings": list(markings)}} | more


def test_a_field_is_a_football_pitch_unless_said():
    field = FieldOfPlay(length_m=100, width_m=64)
    assert (field.template, field.line_width_m, field.ridge) == ("football", 0.12, None)


def test_a_ground_is_as_uneven_as_usual_in_its_sport_unless_said():
    usual = {name: FieldOfPlay(template=name).plan.uneven for name in ("football", "volleyball")}
    assert (usual["football"], usual["volleyball"], FieldOfPlay(**OWN).plan.uneven) == (0.015, 0.005, 0.015)
    assert FieldOfPlay(**OWN, uneven_m=0.004).plan.uneven == FieldOfPlay(uneven_m=0.004).plan.uneven == 0.004
    with pytest.raises(ValidationError):
        FieldOfPlay(uneven_m=0.5)


def test_how_well_a_field_is_known_is_said_by_the_names_of_its_numbers():
    assert FieldOfPlay(sigma={"length_m": 0.5}).sigma == {"length_m": 0.5}
    assert FieldOfPlay().sigma == {}
    for wrong in ({"line_width_m": 0.01}, {"length_m": 0}, {"width_m": 11}):
        with pytest.raises(ValidationError):
            FieldOfPlay(sigma=wrong)


@pytest.mark.parametrize("name", NAMES)
def test_a_template_brings_its_size(name):
    field = FieldOfPlay(template=name)
    size = load(name).size
    assert (field.length_m, field.width_m) == (size["length"].default, size["width"].default)
    assert field.plan.markings(field.size)


def test_sizes_need_not_be_given_but_are_always_told():
    assert FieldOfPlay.model_json_schema()["required"] == []
    assert FieldOfPlay.model_json_schema()["properties"]["template"]["oneOf"][0]["enum"] == list(NAMES)
    assert FieldOfPlay(template="futsal").model_dump(mode="json")["length_m"] == 40


def test_markings_of_ones_own_take_the_place_of_a_template():
    field = FieldOfPlay.model_validate(OWN)
    side, bow, ring, dot = field.plan.markings(field.size)
    assert side == Line("side", ((-10, -5), (10, -5)), 0.05)
    assert (bow.radius, bow.start, bow.end, bow.width) == (3, 0, pytest.approx(math.pi / 2), 0.1)
    assert (ring.radius, ring.end) == (2, 2 * math.pi)
    assert dot == Spot("dot", (0, 0), 0.2)
    assert field.plan.places(field.size) == {"corner": (-10, -5)}


def test_a_field_is_stored_and_read_as_it_was():
    field = FieldOfPlay.model_validate(OWN)
    assert FieldOfPlay.model_validate(field.model_dump(mode="json")) == field
    assert FieldOfPlay.model_validate(field.model_dump(mode="json", exclude_none=True)) == field


def test_markings_of_ones_own_are_white_unless_they_have_a_colour():
    line = [[-10, -5], [10, -5]]
    colours = ["white", "yellow", "black", "blue", "red", "green", "orange", "#0a5fA8"]
    given = [{"name": "plain", "line": line}, *({"name": c, "line": line, "colour": c} for c in colours)]
    field = FieldOfPlay.model_validate(own(*given))
    assert [shape.colour for shape in field.plan.markings(field.size)] == ["white", *colours]


@pytest.mark.parametrize(
    ("typed", "template"),
    [
        ("soccer", "football"),
        ("Fußball", "football"),
        ("icehockey", "ice-hockey"),
        ("Ice Hockey", "ice-hockey"),
        ("american football", "american-football"),
        ("gridiron", "american-football"),
        ("field_hockey", "hockey"),
        ("rugby", "rugby-union"),
        ("beachvolleyball", "beach-volleyball"),
    ],
)
def test_a_sport_by_another_name_is_stored_as_its_template(typed, template):
    named = FieldOfPlay.model_validate({"template": typed, "other_markings": [{"template": typed}]})
    assert named == FieldOfPlay.model_validate({"template": template, "other_markings": [{"template": template}]})


@pytest.mark.parametrize("typed", ["rugby league", "box lacrosse", "", "a" * 10**6])
def test_a_sport_that_may_be_another_one_is_not_guessed(typed):
    with pytest.raises(ValidationError, match="is none of the templates"):
        FieldOfPlay.model_validate({"template": typed})


@pytest.mark.parametrize("colour", ["mauve", "#12", "#0a5fa8ff", "", "White", 3, None])
def test_a_colour_that_is_none_is_refused(colour):
    with pytest.raises(ValidationError) as refused:
        FieldOfPlay.model_validate(own({"name": "a", "line": [[0, 0], [1, 0]], "colour": colour}))
    assert refused.value.errors()[0]["loc"][-1] == "colour"


@pytest.mark.parametrize(
    ("field", "where", "message"),
    [
        (
            {"template": "curling"},
            ("template", "name"),
            "curling is none of the templates american-football, basketball",
        ),
        ({"length_m": 59}, ("length_m",), "football: 60 to 130 m, not 59"),
        ({"template": "basketball", "line_width_m": 0.3}, ("line_width_m",), "basketball: 0.02 to 0.12 m, not 0.3"),
        ({"template": "handball", "width_m": 13}, ("width_m",), "handball: 17 to 22 m, not 13"),
        ({"template": "rugby-union", "measures_m": {"in_goal": 40}}, ("measures_m",), "in_goal: 5 to 22 m, not 40"),
        ({"template": "rugby-union", "measures_m": {"goal": 8}}, ("measures_m",), "leaves open: in_goal"),
        ({"measures_m": {"in_goal": 8}}, ("measures_m",), "leaves open: nothing"),
        ({"template": OWN["template"]}, ("length_m",), "Field required"),
        (own({"name": "a"}), ("template", "layout", "markings", 0), "exactly one of line, arc, circle and spot"),
        (
            own({"name": "a", "line": [[0, 0], [0, 0]]}),
            ("template", "layout", "markings", 0),
            "the same point twice in a row",
        ),
        (
            own({"name": "a", "arc": {"centre": [0, 0], "start": [3, 0], "end": [0, 4]}}),
            ("template", "layout", "markings", 0, "arc"),
            "start is 3.00 m from the centre, end 4.00 m",
        ),
        (own({"name": "a", "line": [[0, 0], [20, 10]]}), (), "a leaves the 20 x 10 m of the field, whose centre is"),
        (
            own({"name": "a", "circle": {"centre": [0, 0], "radius_m": 7.1}}),
            (),
            "a leaves the 20 x 10 m of the field, whose centre is the origin",
        ),
        (own(), ("template", "layout", "markings"), "at least 1 item"),
    ],
)
def test_a_field_that_is_none_is_refused_and_the_place_named(field, where, message):
    with pytest.raises(ValidationError) as refused:
        FieldOfPlay.model_validate(field)
    first = refused.value.errors()[0]
    assert first["loc"] == where
    assert message in first["msg"]


def test_the_documented_fields_are_fields():
    document = (Path(__file__).parents[3] / "docs" / "fields.md").read_text()
    examples = re.findall(r"```json\n(.*?)```", document, re.DOTALL)
    assert len(examples) == 3
    for example in examples:
        field = FieldOfPlay.model_validate(json.loads(example)["field"])
        assert field.plan.markings(field.size)


def test_the_names_in_the_document_are_found():
    document = (Path(__file__).parents[3] / "docs" / "fields.md").read_text()
    examples = document.partition("## Names of points")[2].partition("Examples:")[2].partition("(any number)")[0]
    names = re.findall(r"`([^`]*)`", examples)
    assert len(names) == 4
    field = FieldOfPlay()
    for name in names:
        assert find(name, field.plan, field.size)


def test_other_markings_are_fields_of_other_sports_and_markings_one_by_one():
    field = FieldOfPlay.model_validate(
        {
            "other_markings": [
                {"template": "handball", "centre": [10, 5], "turned_deg": 90},
                {"name": "run-up", "line": [[0, -30], [40, -30]], "width_m": 0.05},
            ]
        }
    )
    others = other_shapes(field.model_dump()["other_markings"], field.size)
    names = [shape.name for shape in others]
    assert names[0] == "run-up"
    (side,) = [shape for shape in others if shape.name == "left goal line"]
    # Turned by a right angle, its left end is the near one.
    assert {round(y, 1) for _, y in side.points} == {round(5 - 20 + 0.025, 1)}
    assert FieldOfPlay.model_validate(field.model_dump(mode="json")) == field


@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        ({"template": "quidditch"}, "none of the templates"),
        ({"template": "handball", "length_m": 500}, "400"),
        ({"template": "handball", "measures_m": {"hash": 5}}, "hash is not among"),
        ({"name": "neither"}, "exactly one of line"),
        ([None, None], "valid dictionary"),
    ],
)
def test_other_markings_that_cannot_be_are_refused(wrong, told):
    with pytest.raises(ValidationError, match=told):
        FieldOfPlay.model_validate({"other_markings": [wrong]})


def test_a_ground_is_shared_by_so_many_sports_at_most():
    with pytest.raises(ValidationError, match="17 fields of other sports: at most 16"):
        FieldOfPlay.model_validate({"other_markings": [{"template": "padel"}] * 17})


def test_a_ridge_may_end_at_the_goal_lines_to_a_millimetre_and_no_farther_out():
    assert FieldOfPlay(length_m=99.617, width_m=67.8, ridge=[[-49.809, 0, 0.2], [49.809, 0, 0.2]]).ridge
    with pytest.raises(ValidationError, match="from its middle, not at -50 and 49 m along, 0 m"):
        FieldOfPlay(length_m=99.617, width_m=67.8, ridge=[[-50, 0, 0.2], [49, 0, 0.2]])


def test_the_ridge_of_a_field_is_stretched_with_a_length_and_a_width_that_are_adopted():
    crowned = FieldOfPlay(length_m=105, width_m=68, ridge=[[-52.5, 3.4, 0.2], [52.5, 3.4, 0.2]])
    assert crowned.with_number("length_m", 104).ridge == [[-52, 3.4, 0.2], [52, 3.4, 0.2]]
    assert crowned.with_number("width_m", 66).ridge == [
        [-52.5, pytest.approx(3.3), 0.2],
        [52.5, pytest.approx(3.3), 0.2],
    ]
