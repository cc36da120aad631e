"""Stored documents that a newer version wrote: they are read tolerantly, and what is unknown in them is kept."""

import copy

import pytest
import sqlalchemy as sa
from pydantic import ValidationError

from service.schemas.base import TOLERANTLY
from service.schemas.job import Job, JobError
from service.schemas.venue import Venue, VenueIn
from service.store import tables
from service.store.documents import to_document
from service.store.jobs.task import UnreadableJob
from testbed.homes import in_both_homes
from testbed.running import venue

v = tables.venues.c


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
    assert stock.venues.alarms(["main"])["main"][0].rule == "crowd-too-loud"


def test_what_clients_send_is_read_strictly_and_what_is_stored_is_not():
    sent = venue("main") | {"crowd": 7}
    with pytest.raises(ValidationError, match="crowd"):
        VenueIn.model_validate(sent)
    document = to_document(VenueIn.model_validate(venue("main")).to_venue())
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
