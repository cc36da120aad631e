"""The plain records of a calibration beside the models of the wire that they are parts of."""

import inspect
import json
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NotRequired, Union, get_args, get_origin, get_type_hints, is_typeddict

import pytest
from pydantic import BaseModel

from service.schemas import field, geometry, job, options, results, trend, venue
from service.schemas.results import View
from service.schemas.trend import Anchor
from service.schemas.venue import VENUE_EXAMPLE, VenueIn
from service.store.jobs import task
from worker.jobs import answers, inputs

# Where a model is, by its name.
MODELS = {
    name: model
    for module in (geometry, field, options, results, trend, job, venue, task)
    for name, model in inspect.getmembers(module, inspect.isclass)
    if issubclass(model, BaseModel)
}
INPUTS = {
    name: record
    for name, record in inspect.getmembers(inputs, inspect.isclass)
    if issubclass(record, inputs.Record) and record is not inputs.Record
}
ANSWERS = {name: record for name, record in inspect.getmembers(answers) if is_typeddict(record)}
# What of a model is not read: see `inputs.FieldOfPlay`.
DOCUMENTS = {"template", "other_markings"}


def shape(hint: Any) -> Any:
    """A type as JSON has it: without constraints, models and records by their names, words and moments as texts."""
    origin, arguments = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return shape(arguments[0])
    if origin is NotRequired:
        return shape(arguments[0])
    if origin in (Union, UnionType):
        return frozenset(shape(one) for one in arguments)
    if origin is Literal:
        return str
    if origin in (list, dict):
        return origin, *(shape(one) for one in arguments)
    if hint is NoneType or hint in (str, int, float, bool, Any):
        return hint
    return str if hint.__name__ == "datetime" else hint.__name__


def shapes(record: Any) -> dict[str, Any]:
    return {name: shape(hint) for name, hint in get_type_hints(record, include_extras=True).items()}


@pytest.mark.parametrize("name", INPUTS)
def test_a_record_that_is_read_is_a_part_of_its_model(name):
    of_model = shapes(MODELS[name])
    of_record = shapes(INPUTS[name])
    assert of_record
    for own in of_record.keys() - DOCUMENTS:
        # A calibration always has a venue, and options of its own kind.
        allowed = [of_model[own], *(of_model[own] if name == "Task" and isinstance(of_model[own], frozenset) else [])]
        assert of_record[own] in allowed, own


def test_all_options_of_a_calibration_are_read_but_for_whom_to_tell():
    assert shapes(inputs.Options).keys() == options.Options.model_fields.keys() - {"callback_url"}


@pytest.mark.parametrize("name", ANSWERS)
def test_a_record_that_is_written_is_its_model(name):
    model = MODELS[name]
    of_model = {own: one for own, one in shapes(model).items() if own in model.model_fields}
    assert shapes(ANSWERS[name]) == of_model


def given_task() -> task.Task:
    document = json.loads(json.dumps(VENUE_EXAMPLE))
    (camera,) = document["cameras"]
    camera["light"] = {"gain": [1.1, 1.0, 0.9]}
    camera["ignore"] = [[[0, 0], [9, 0], [9, 9]]]
    camera["intrinsics"]["sigma"] = {"fx": 4.0}
    markings = [
        {"name": "touchline", "line": [[-40, 20], [40, 20]], "width_m": 0.1},
        {"name": "bow", "arc": {"centre": [0, 0], "start": [5, 0], "end": [0, 5]}, "colour": "yellow"},
        {"name": "ring", "circle": {"centre": [0, 0], "radius_m": 9}},
        {"name": "dot", "spot": {"centre": [0, 0], "diameter_m": 0.2}},
    ]
    document["field"] |= {
        "template": {"markings": markings, "points": {"middle": [0, 0]}},
        "uneven_m": 0.01,
        "sigma": {"length_m": 0.5},
        "other_markings": [markings[2], {"template": "handball", "centre": [3, 1], "turned_deg": 90}],
    }
    stored = VenueIn.model_validate(document).to_venue()
    return task.Task(
        job_id="job",
        run_token="token",
        venue=stored,
        options=options.Options(seed=7, parents=8),
        frames={},
        last_views={"left": View(usable=True, detail="", lines_found=0.9)},
        memories={"left": {"format": 1}},
        taken_at="2026-11-23T02:00:00Z",
        anchors={"left": Anchor(revision=3, posed=stored.cameras[0].posed)},
    )


def alike(record: Any, model: Any) -> bool:
    """Whether a record says what the model says that it was read from."""
    if isinstance(record, inputs.Record):
        return all(alike(value, getattr(model, name)) for name, value in vars(record).items() if name not in DOCUMENTS)
    if isinstance(record, list):
        return len(record) == len(model) and all(map(alike, record, model))
    if isinstance(record, dict):
        return record.keys() == model.keys() and all(alike(record[name], model[name]) for name in record)
    return record == model


def test_a_task_is_read_as_its_worker_wrote_it():
    given = given_task()
    read = inputs.read_record(inputs.Task, json.loads(given.model_dump_json()))
    assert alike(read, given)
    assert read.venue.lights["left"].gain == [1.1, 1.0, 0.9]
    assert read.venue.field.plan == given.venue.field.plan
    assert read.venue.field.others == given.venue.field.others
    assert len(read.venue.field.others) > 1
    assert read.venue.lens_warnings == given.venue.lens_warnings == []
