"""Each removal and each tightening of the interface is named, and no addition is."""

import copy
import json

import pytest

from tests.openapi.__main__ import document, last_document, without_words
from tests.openapi.comparing import findings

RELEASED = json.loads(last_document().read_text())
SCHEMAS = ("components", "schemas")
VENUE_IN, VENUE, OPTIONS = ((*SCHEMAS, name) for name in ("VenueIn", "Venue", "OptionsIn"))
ONE = ("paths", "/venues/{venue_id}")


def at(made, *way):
    for step in way:
        made = made[step]
    return made


def changed(change):
    made = copy.deepcopy(RELEASED)
    change(made)
    return findings(RELEASED, made)


REMOVED = {
    "GET /livez: was removed": lambda made: made["paths"].pop("/livez"),
    "DELETE /venues/{venue_id}: was removed": lambda made: at(made, *ONE).pop("delete"),
    "GET /jobs: the query parameter cursor was removed": lambda made: [
        at(made, "paths", "/jobs", "get", "parameters").remove(one)
        for one in list(at(made, "paths", "/jobs", "get", "parameters"))
        if one["name"] == "cursor"
    ],
    "PUT /venues/{venue_id}: body.accept: was removed": lambda made: at(made, *VENUE_IN, "properties").pop("accept"),
    "GET /venues: 200.venues[].lens: was removed": lambda made: at(made, *VENUE, "properties").pop("lens"),
    "GET /venues: 200.venues[].cameras: may be absent": lambda made: at(made, *VENUE, "required").remove("cameras"),
    "GET /venues/{venue_id}: the header ETag of the answer 200 was removed": lambda made: at(
        made, *ONE, "get", "responses", "200", "headers"
    ).pop("ETag"),
    "webhook alarm: was removed": lambda made: made["webhooks"].pop("alarm"),
}
NARROWED = {
    "body.accept: is required": lambda made: at(made, *VENUE_IN, "required").append("accept"),
    "body.accept: all is no longer taken": lambda made: at(made, *VENUE_IN, "properties", "accept", "enum").remove(
        "all"
    ),
    "body.cameras: maxItems is 8, was 32": lambda made: at(made, *VENUE_IN, "properties", "cameras").update(maxItems=8),
    "body.options.parents: minimum is 8, was 2": lambda made: at(made, *OPTIONS, "properties", "parents").update(
        minimum=8
    ),
    "body.options.flat: is string, was boolean": lambda made: at(made, *OPTIONS, "properties", "flat").update(
        type="string"
    ),
    "200.venues[].name: is integer, was string": lambda made: at(made, *VENUE, "properties", "name").update(
        type="integer"
    ),
    "the query parameter venue is required": lambda made: [
        one.update(required=True) for one in at(made, "paths", "/jobs", "get", "parameters") if one["name"] == "venue"
    ],
    "needs [{'key': ['admin']}], not [{'key': ['read']}]": lambda made: at(made, *ONE, "get").update(
        security=[{"key": ["admin"]}]
    ),
}
ADDED = {
    "a route": lambda made: made["paths"].update({"/news": made["paths"]["/livez"]}),
    "a field that may be left out": lambda made: at(made, *VENUE_IN, "properties").update(crowd={"type": "integer"}),
    "a field of an answer": lambda made: at(made, *VENUE, "properties").update(crowd={"type": "integer"}),
    "a parameter that may be left out": lambda made: at(made, *ONE, "get").update(
        parameters=[*at(made, *ONE, "get").get("parameters", ()), {"in": "query", "name": "fields", "schema": {}}]
    ),
    "a word of a request": lambda made: at(made, *VENUE_IN, "properties", "accept", "enum").append("some"),
    "a word of an answer": lambda made: at(made, *VENUE, "properties", "accept", "x-extensible-enum").append("some"),
    "the result of another kind of job": lambda made: at(made, *SCHEMAS, "Job", "properties", "result", "anyOf").append(
        {"type": "object", "properties": {"crowd": {"type": "integer"}}, "required": ["crowd"]}
    ),
    "a wider limit": lambda made: at(made, *VENUE_IN, "properties", "cameras").update(maxItems=64),
}


@pytest.mark.parametrize("finding", [*REMOVED, *NARROWED])
def test_what_breaks_a_client_is_named_with_its_place(finding):
    change = (REMOVED | NARROWED)[finding]
    assert any(finding in found for found in changed(change)), changed(change)


@pytest.mark.parametrize("addition", ADDED)
def test_an_addition_is_none(addition):
    assert changed(ADDED[addition]) == []


def test_the_service_of_today_takes_and_answers_what_that_of_the_last_release_did():
    now = document()
    assert findings(RELEASED, now) == []
    # What is kept of a release says the same as what it was made from.
    assert findings(now, without_words(now)) == findings(without_words(now), now) == []
