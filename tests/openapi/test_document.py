"""The OpenAPI document is fit for generators of clients."""

import re

import pytest

from service.schemas.problems import PROBLEM_TYPES
from tests.openapi.__main__ import document

VERBS = re.compile(
    "(accept|add|adopt|calibrate|cancel|check|delete|draw|explain|export|fetch|get|list|patch|plan|put|receive|reject|report|"
    "restore|resubmit|revoke|stream|submit)(_[a-z]+)+"
)
# Types of problems that no route answers: they are errors of jobs, or of addresses and methods that are no routes, or
# faults of the service.
OF_NO_ROUTE = {
    "method-not-allowed",
    "no-lens",
    "no-pose",
    "unknown-landmark",
    "no-field-fit",
    "no-markings-in-view",
    "model-missing",
    "provider-missing",
    "job-timeout",
    "job-crashed",
    "job-abandoned",
    "internal-error",
}


@pytest.fixture(scope="module")
def made():
    return document()


def operations(made):
    for paths in (made["paths"], made["webhooks"]):
        for path in paths.values():
            yield from path.values()


def properties(made):
    for name, schema in made["components"]["schemas"].items():
        for member, content in schema.get("properties", {}).items():
            yield f"{name}.{member}", content


def reached(made, beginnings):
    """The names of the schemas that some parts of the document refer to, directly or not."""
    schemas, names, waiting = made["components"]["schemas"], set(), [str(beginnings)]
    while waiting:
        new = set(re.findall(r"#/components/schemas/(\w+)", waiting.pop())) - names
        names |= new
        waiting += [str(schemas[name]) for name in new]
    return {name: schemas[name] for name in names}


def answered(made):
    responses = [operation["responses"] for path in made["paths"].values() for operation in path.values()]
    return reached(made, [responses, made["webhooks"]])


def sent(made):
    bodies = [one["requestBody"] for path in made["paths"].values() for one in path.values() if "requestBody" in one]
    return reached(made, bodies)


def is_described(made, schema):
    """Whether a schema, or all that it may be, has a description."""
    if "$ref" in schema:
        schema = made["components"]["schemas"][schema["$ref"].rpartition("/")[2]]
    choice = [one for one in schema.get("anyOf", schema.get("oneOf", [])) if one.get("type") != "null"]
    return bool(schema.get("description")) or (bool(choice) and all(is_described(made, one) for one in choice))


def test_what_clients_send_is_closed_and_what_they_are_answered_is_open(made):
    objects = {name: one for name, one in sent(made).items() if "properties" in one}
    assert len(objects) > 20
    assert {name for name, one in objects.items() if one.get("additionalProperties") is not False} == set()
    assert {name for name, one in answered(made).items() if one.get("additionalProperties") is False} == set()


def test_words_that_later_versions_may_add_are_no_enumerations_in_answers(made):
    job = made["components"]["schemas"]["Job"]["properties"]
    assert job["status"]["x-extensible-enum"] == ["queued", "running", "succeeded", "failed", "cancelled"]
    words = [text for text in map(str, answered(made).values()) if "'enum'" in text and "'x-extensible-enum'" in text]
    assert [text for text in words if re.search(r"'(status|cause|verdict|rule|stage)': {[^}]*'enum'", text)] == []
    assert made["components"]["schemas"]["OptionsIn"]["properties"]["preset"]["enum"] == ["esc", "paper", "scpr"]


def test_a_result_is_told_by_its_kind_and_may_be_of_a_kind_to_come(made):
    known, other, nothing = made["components"]["schemas"]["Job"]["properties"]["result"]["anyOf"]
    assert known["discriminator"]["propertyName"] == "kind"
    kinds = made["components"]["schemas"]["Job"]["properties"]["kind"]["x-extensible-enum"]
    assert known["discriminator"]["mapping"].keys() == set(kinds)
    for reference in known["oneOf"]:
        assert "kind" in made["components"]["schemas"][reference["$ref"].rpartition("/")[2]]["required"]
    assert (other["properties"].keys(), nothing) == ({"kind"}, {"type": "null"})


def test_operations_are_verbs_with_objects_each_once(made):
    ids = [operation["operationId"] for operation in operations(made)]
    assert [name for name in ids if not VERBS.fullmatch(name)] == []
    assert len(set(ids)) == len(ids)
    assert {"submit_calibration", "get_job", "export_venue_poses", "receive_job_end"} < set(ids)


def test_every_property_parameter_and_operation_is_described(made):
    assert [name for name, content in properties(made) if not is_described(made, content)] == []
    parameters = [(one["operationId"], given) for one in operations(made) for given in one.get("parameters", ())]
    assert [(where, given["name"]) for where, given in parameters if not given.get("description")] == []
    assert [one["operationId"] for one in operations(made) if not one.get("description")] == []


def test_every_type_of_problem_is_listed_where_it_can_be_answered(made):
    listed = {
        address.rpartition("/")[2]
        for operation in operations(made)
        for response in operation["responses"].values()
        for address in response.get("x-problem-types", ())
    }
    assert PROBLEM_TYPES.keys() - listed == OF_NO_ROUTE
    responses = made["paths"]["/venues/{venue_id}/calibrate"]["post"]["responses"]
    assert responses["429"]["x-problem-types"] == [
        "/problems/queue-full",
        "/problems/rate-limited",
        "/problems/too-many-unknown-keys",
    ]
    assert "`/problems/queue-full`: Too many jobs are waiting." in responses["429"]["description"]


def test_the_document_says_whose_it_is_under_which_licence_and_where(made):
    assert made["info"]["license"]["identifier"] == "Apache-2.0"
    assert made["info"]["contact"]["name"]
    assert made["servers"][0]["url"] == "/"
