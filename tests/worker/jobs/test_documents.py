"""The documents that a job program reads beside the models that its worker wrote them from."""

import json

import pytest

from service.schemas.options import Options
from service.schemas.results import View
from service.schemas.trend import Anchor
from service.schemas.venue import VENUE_EXAMPLE, VenueIn
from service.store.jobs.task import Task
from worker.jobs.documents import Document, parse, parse_task
from worker.jobs.from_schemas import camera_with_ignored_areas, light_of, pitch_of


def given_task() -> Task:
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
    return Task(
        job_id="job",
        run_token="token",
        venue=stored,
        options=Options(seed=7, parents=8),
        frames={},
        last_views={"left": View(usable=True, detail="", lines_found=0.9)},
        memories={"left": {"format": 1}},
        taken_at="2026-11-23T02:00:00Z",
        anchors={"left": Anchor(revision=3, posed=stored.cameras[0].posed)},
    )


def test_a_task_is_read_as_its_worker_wrote_it():
    written = given_task()
    read = parse_task(parse(written.model_dump_json()))
    assert read.taken_at == written.taken_at
    assert read.anchors["left"].posed.pose.position == written.anchors["left"].posed.pose.position
    assert (read.last_views["left"].lines_found, read.memories) == (0.9, {"left": {"format": 1}})
    assert read.options.model_dump(exclude={"callback_url"}) == written.options.model_dump(exclude={"callback_url"})
    assert dict(read.options) == dict(written.options)
    pitch, by_model = pitch_of(read.venue.field), pitch_of(written.venue.field)
    assert (pitch.template, pitch.others) == (by_model.template, by_model.others)
    assert len(pitch.others) > 1
    (camera,), (model,) = read.venue.cameras, written.venue.cameras
    assert light_of(camera.light) == light_of(model.light)
    engine, expected = (camera_with_ignored_areas(one, one.ignore) for one in (camera, model))
    assert engine.intrinsics.sigma == expected.intrinsics.sigma == {"fx": 4.0}
    assert (engine.ignored.area == expected.ignored.area).all()


def test_a_member_that_a_document_lacks_is_no_attribute():
    with pytest.raises(AttributeError, match="nights"):
        _ = Document(id="left").nights
