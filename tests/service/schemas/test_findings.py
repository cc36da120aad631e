"""Validation errors in words of the document."""

import copy
import time

import pytest
from pydantic import ValidationError

from service.schemas.findings import describe_errors
from service.schemas.options import Options
from service.schemas.venue import VENUE_EXAMPLE, VenueIn


def wrong(model, document):
    with pytest.raises(ValidationError) as refused:
        model.model_validate(document)
    return describe_errors(refused.value.errors(), model, document)


def with_value(path, value):
    """The example of a venue, one of its values another one."""
    document = copy.deepcopy(VENUE_EXAMPLE)
    inner = document
    for step in path[:-1]:
        inner = inner[step]
    inner[path[-1]] = value
    return document


LEFT = ("cameras", 0)


@pytest.mark.parametrize(
    ("path", "value", "words"),
    [
        ((*LEFT, "image_sise"), [3072, 1728], "cameras.left.image_sise is not known; did you mean image_size?"),
        (("fields",), {}, "fields is not known; did you mean field?"),
        ((*LEFT, "pose", "rotaton"), [0, 0, 0], "cameras.left.pose.rotaton is not known; did you mean rotation?"),
        (("field", "length"), 105, "field.length is not known; did you mean length_m?"),
        (
            (*LEFT, "colour"),
            1,
            "cameras.left.colour is not known; known are id, image_size, intrinsics, pose, ",
        ),
        (("alarms",), {"moved_since_last_px": 0}, "alarms.moved_since_last_px: expected more than 0 px, came 0"),
        (("webhooks",), [{"url": "x"}], "webhooks.0.url: expected an address such as https://"),
        (("field", "length_m"), "abc", "field.length_m: expected a number, came 'abc'"),
        ((*LEFT, "pose", "position", 2), None, "cameras.left.pose.position.2: expected a number, came null"),
        ((*LEFT, "image_size", 0), 10.5, "cameras.left.image_size.0: expected a whole number, came 10.5"),
        ((*LEFT, "image_size"), [1, 2, 3], "cameras.left.image_size: expected at most 2 entries, came 3"),
        (
            (*LEFT, "pose", "rotation"),
            [102.2, 12.0, -9.0],
            "cameras.left.pose.rotation.0: expected 10 rad or less, came 102.2; it is a Rodrigues vector in radians, "
            "and these look like degrees",
        ),
        (
            (*LEFT, "pose", "position", 1),
            -4949.0,
            "cameras.left.pose.position.1: expected -3466 m or more, came -4949.0; it is in metres: are these "
            "centimetres or millimetres?",
        ),
        ((*LEFT, "pose"), "there", "cameras.left.pose: expected an object, came 'there'"),
        (("accept",), "ech", "accept: expected 'each' or 'all', came 'ech'"),
        (("cameras",), {}, "cameras: expected a list, came an object"),
        (("schedule",), {}, "schedule.cron is missing"),
        ((*LEFT, "pose", "position"), [0, 0, -1], "cameras.left: camera left stands at z = -1 m"),
        (("id",), "Left!", "id: expected an id, at most 64 small letters, digits, - and _, the first"),
        (("name",), "a\nb", "name: expected text without control characters, came 'a\\nb'"),
        (
            ("field", "length_m"),
            10500,
            "field.length_m: expected 400 m or less, came 10500; it is in metres: are these centimetres",
        ),
        (("field", "length_m"), 344, "field.length_m: football: 60 to 130 m, not 344 (are these feet?)"),
    ],
)
def test_each_mistake_is_told_in_words_of_the_document(path, value, words):
    assert any(told.startswith(words) for told in wrong(VenueIn, with_value(path, value)))


@pytest.mark.parametrize(
    ("typed", "proposed"),
    [("Cam 1", "cam-1"), ("Süd 01", "sud-01"), ("Øst/Łódź", "ost-lodz"), ("-Straße_", "strasse"), ("камера", None)],
)
def test_an_id_that_is_spelt_like_what_was_typed_is_proposed(typed, proposed):
    (told,) = wrong(VenueIn, with_value((*LEFT, "id"), typed))
    assert told.endswith(f"; {proposed} would do" if proposed else f"came {typed!r}")


def test_a_sport_that_is_none_is_the_only_complaint_and_the_nearest_one_is_named():
    (told,) = wrong(VenueIn, with_value(("field",), {"template": "voleyball"}))
    assert told.startswith("field.template: voleyball is none of")
    assert told.endswith("did you mean volleyball?")


def test_what_is_absent_is_missing():
    document = {name: part for name, part in VENUE_EXAMPLE.items() if name != "field"}
    assert wrong(VenueIn, document) == ["field is missing"]


def test_how_a_schema_came_to_a_part_is_not_told():
    markings = [{"name": "a", "lines": [[0, 0], [1, 1]]}]
    field = {"length_m": 20, "width_m": 10, "line_width_m": 0.05, "template": {"name": "own", "markings": markings}}
    told = wrong(VenueIn, with_value(("field",), field))
    assert "field.template.markings.0.lines is not known; did you mean line?" in told


def test_a_part_of_another_model_is_not_proposed():
    assert not any("image_size" in told for told in wrong(Options, {"image_sise": 1}))


def test_long_values_and_names_are_told_in_short():
    (told,) = wrong(VenueIn, with_value(("field", "length_m"), "9" * 10_000))
    assert len(told) < 120


def test_a_document_of_many_wrong_names_is_told_at_once():
    document = VENUE_EXAMPLE | {f"camera{'s' * 2000}{number}": 1 for number in range(400)}
    begun = time.process_time()
    told = wrong(VenueIn, document)
    assert len(told) == 400
    assert time.process_time() - begun < 1
