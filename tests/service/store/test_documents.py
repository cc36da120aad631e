"""Stored documents: 0.1.0 can read them, nothing of them is lost on the way, and what is newer than this is kept."""

import copy
import json
from pathlib import Path

import jsonschema
import pytest
import sqlalchemy as sa
from pydantic import ValidationError

from service.schemas.base import TOLERANTLY
from service.schemas.geometry import Light, Moved
from service.schemas.job import Job, JobError
from service.schemas.results import AdoptableNumber, CrossCheck, LensChange, Proposal, Refined
from service.schemas.trend import Displacement
from service.schemas.venue import Venue, VenueIn
from service.store import tables
from service.store.documents import join_additions, result_columns, stored_result, stored_venue, venue_columns
from service.store.jobs.task import UnreadableJob
from testbed.homes import in_both_homes
from testbed.program import DISPLACEMENT
from testbed.running import venue
from testbed.stock import result

OF_0_1_0 = json.loads((Path(__file__).parents[2] / "openapi" / "0.1.0.json").read_text())
RIDGE = AdoptableNumber(name="ridge_height_m", given=0.0, value=0.332, sigma=0.051, moves_m={"left": 0.08})
LIGHT = Light(gain=[1.1, 1.0, 0.9])
v = tables.venues.c


def refuse_unknown(schema_of, document):
    """As 0.1.0 reads: by its own schema, in which no object may have a member that is not named."""
    schema = {"$ref": f"#/components/schemas/{schema_of}", "components": OF_0_1_0["components"]}
    jsonschema.validate(document, schema)


def everything():
    put = venue("main") | {
        "view": {},
        "recover": "accept",
        "alarms": {"trend_m": 0.2, "knocked": True},
        "schedule": {"cron": "0 3 * * *", "frames": 4, "options": {"seed": 3}},
        "webhooks": [{"url": "https://example.com/"}],
    }
    put["field"] |= {"uneven_m": 0.004, "sigma": {"width_m": 0.2}}
    put["cameras"] = [camera | {"source": "http://10.1.0.7/a.jpg"} for camera in put["cameras"]]
    put["cameras"][0]["light"] = LIGHT.model_dump()
    return VenueIn.model_validate(put).to_venue()


def whole_result(of):
    """With every field, and every word of one that has a default, that 0.1.0 does not know."""
    pose, lens = of.cameras[0].pose, of.cameras[0].intrinsics
    refined = Refined(pose=pose, intrinsics=lens, covariance=None, sigma=None, longer=0.1, differs_m=None)
    change = LensChange(longer=0.1, sigma=0.1, since=None, words=None)
    more = {
        "light": LIGHT,
        "refined": refined,
        "lens_change": change,
        "nights": 3,
        "knocked": True,
        "seen_by_network": "full",
        "proposed": Proposal(
            pose=pose, sigma=None, moved=Moved(rotation_deg=11.2, position_m=0.3, pixels=None), found=0.97
        ),
        "cross_check": CrossCheck(apart_m=0.01, expected_m=0.01),
        "displacement": Displacement(anchor=1, **DISPLACEMENT),
    }
    found = result(of, accepted=True)
    cameras = [found.cameras[0].model_copy(update=more), *found.cameras[1:]]
    own = {"warnings": ["no sigma"], "adoptable": [RIDGE], "path": "anywhere"}
    return found.model_copy(update={"cameras": cameras, **own})


def test_0_1_0_can_read_the_document_of_a_venue_and_nothing_of_it_is_lost():
    of = everything()
    document, additions = venue_columns(of)
    refuse_unknown("Venue", document)
    assert additions == {
        "own": {"view": {}, "recover": "accept"},
        "of_parts": {
            "alarms": {"trend_m": 0.2, "knocked": True},
            "schedule": {"frames": 4},
            "field": {"uneven_m": 0.004, "sigma": {"width_m": 0.2}},
        },
        "of_cameras": {"left": {"light": {"gain": [1.1, 1.0, 0.9]}}},
    }
    assert stored_venue(document, additions) == of
    # The guard itself: a whole document is one that 0.1.0 refuses.
    with pytest.raises(jsonschema.ValidationError):
        refuse_unknown("Venue", join_additions(document, additions))


def test_0_1_0_can_read_the_document_of_a_result_and_nothing_of_it_is_lost():
    found = whole_result(everything())
    document, additions = result_columns(found)
    refuse_unknown("Result", document)
    assert stored_result(document, additions) == found
    with pytest.raises(jsonschema.ValidationError):
        refuse_unknown("Result", join_additions(document, additions))


def test_every_field_that_0_1_0_does_not_know_is_among_the_additions_or_has_its_default():
    """A field that is added to what is stored must be added to documents.py as well, for as long as 0.1.0 is read."""
    of = everything()
    for name, model in (("Venue", of), ("Result", whole_result(of))):
        known = OF_0_1_0["components"]["schemas"][name]["properties"].keys()
        columns = venue_columns(of) if name == "Venue" else result_columns(model)
        assert type(model).model_fields.keys() - known <= columns[1]["own"].keys(), name
        camera = type(model.cameras[0])
        known = OF_0_1_0["components"]["schemas"][camera.__name__]["properties"].keys()
        assert camera.model_fields.keys() - known <= columns[1]["of_cameras"]["left"].keys(), name


def test_what_0_1_0_took_out_of_a_venue_does_not_come_back_with_the_additions():
    document, additions = venue_columns(everything())
    del document["alarms"]
    document["cameras"] = document["cameras"][1:]
    back = stored_venue(document, additions)
    assert (back.alarms, [camera.light for camera in back.cameras]) == (None, [None])


@in_both_homes
def test_what_a_newer_version_wrote_into_a_venue_is_kept_when_this_one_moves_it(stock):
    stock.venue("main")
    with stock.engine.begin() as connection:
        document = copy.deepcopy(connection.scalar(sa.select(v.document)))
        document |= {"crowd": {"seats": 7}, "lens": "breathing"}
        document["cameras"][1]["lamp"] = "on"
        connection.execute(sa.update(tables.venues).values(document=document))
    assert stock.venues.get("main").lens == "breathing"
    stock.moved_by_hand("main", 3.0)
    with stock.engine.begin() as connection:
        after = connection.scalar(sa.select(v.document))
    assert (after["crowd"], after["cameras"][1]["lamp"], after["lens"]) == ({"seats": 7}, "on", "breathing")
    assert after["cameras"][0]["pose"]["position"][0] == 3.0


@in_both_homes
def test_an_alarm_by_a_rule_of_a_newer_version_rings_on(stock):
    stock.venue("main")
    with stock.engine.begin() as connection:
        row = {"venue": "main", "rule": "crowd-too-loud", "camera": "", "since": stock.venues.now(), "why": "Loud."}
        connection.execute(sa.insert(tables.alarms).values(row))
    stock.moved_by_hand("main", 3.0)
    assert [alarm.rule for alarm in stock.venues.health("main").alarms] == ["crowd-too-loud"]
    assert stock.venue_summaries.alarms(["main"])["main"][0].rule == "crowd-too-loud"


def test_what_clients_send_is_read_strictly_and_what_is_stored_is_not():
    sent = venue("main") | {"crowd": 7}
    with pytest.raises(ValidationError, match="crowd"):
        VenueIn.model_validate(sent)
    document, _ = venue_columns(everything())
    document |= {"crowd": 7, "lens": "breathing", "accept": "some"}
    document["field"] |= {"template": "quidditch", "roof": {}}
    document["cameras"][0]["intrinsics"] |= {"model": "pinhole", "lamp": 1}
    read = Venue.model_validate(document, **TOLERANTLY)
    assert (read.lens, read.field.template, read.cameras[0].intrinsics.model) == ("breathing", "quidditch", "pinhole")
    # Whoever computes with it reads words strictly.
    with pytest.raises(ValidationError, match="lens"):
        Venue.model_validate(document, extra="ignore")


def test_a_result_of_a_kind_that_is_new_is_left_out():
    job = Job.model_config["json_schema_extra"]["examples"][0] | {"status": "succeeded", "result": {"crowd": 7}}
    assert Job.model_validate(job | {"kind": "counting"}, **TOLERANTLY).result is None
    with pytest.raises(ValidationError):
        Job.model_validate(job, **TOLERANTLY)


@in_both_homes
def test_a_job_that_a_newer_worker_began_waits_again_when_it_comes_to_one_that_cannot_read_it(stock):
    job_id = stock.submitted("main")
    begun = stock.attempts.begin(job_id)
    asked = begun.options.model_dump(mode="json")
    with stock.engine.begin() as connection:
        connection.execute(sa.update(tables.jobs).values(options=asked | {"zoom": "fit"}))
    # The queue hands it to a worker of this version once the newer one is silent.
    with pytest.raises(UnreadableJob, match="zoom"):
        stock.attempts.begin(job_id)
    assert stock.jobs.get(job_id).status == "queued"
    assert stock.attempts.check_leases([begun], {}, renew=False) == set()
    assert not stock.attempts.abandon(job_id, JobError(type="", title="", detail=""), seconds=60)
    with pytest.raises(UnreadableJob):
        stock.attempts.reclaim(job_id, 0)
    with stock.engine.begin() as connection:
        connection.execute(sa.update(tables.jobs).values(options=asked))
    assert stock.attempts.reclaim(job_id, 0) is not None
    assert stock.attempts.begin(job_id).attempt == 2
