"""Numbers of the field that results offer: to whom they belong, how they are stored and undone."""

import numpy as np
import pytest

from service.schemas.field import FieldOfPlay
from service.schemas.results import AdoptableNumber
from service.store.memories import newest_memories
from testbed.homes import in_one_home_first
from testbed.stock import result
from tests.problems import refused
from tests.service.store.test_refined import refined
from worker.calibration.geometry.field import Field
from worker.jobs.from_schemas import pitch_of

RIDGE, LENGTH = ("ridge_height_m", 0.0, 0.332), ("length_m", 105.0, 104.6)
HIPPED = [[-18.5, 0.0, 0.332], [18.5, 0.0, 0.332]]


def night(stock, *numbers, accepted=True, **options):
    """A job that offers numbers of the field, whose cameras remember a night; gives its id."""
    task = stock.attempts.begin(stock.submitted("v", **options))
    found = result(task.venue, accepted)
    offered = [AdoptableNumber(name=name, given=given, value=value, sigma=0.02) for name, given, value in numbers]
    cameras = [camera.model_copy(update={"refined": refined(camera.pose)}) for camera in found.cameras]
    memories = {camera.id: {"jobs": 1} for camera in cameras if camera.accepted}
    told = found.model_copy(update={"adoptable": offered, "cameras": cameras})
    stock.attempts.finish(task, told, [], memories)
    return task.job_id


def adopted(stock, job, name="ridge_height_m"):
    """The field after a number was stored."""
    return stock.adoption.adopt_number("v", job, name).field


def offered(stock, job):
    return list(stock.adoption.adoptable_numbers(job))


def newest(stock):
    return stock.venues.history("v", None, 1)[0]


def length(stock):
    return stock.venues.get("v").field.length_m


@in_one_home_first
def test_a_ridge_is_stored_as_a_revision_of_its_own_and_moves_no_camera(stock):
    stock.venue("v")
    job = night(stock, RIDGE)
    before = stock.venues.get("v")
    field = adopted(stock, job)
    assert field == before.field.model_copy(update={"ridge": HIPPED})
    after = stock.venues.get("v")
    assert (after.field, after.cameras) == (field, before.cameras)
    revision = newest(stock)
    assert (revision.revision, revision.cause, revision.job, revision.ridge) == (3, "adopted", job, HIPPED)
    assert {name: (one.before, one.after) for name, one in revision.field_numbers.items()} == {
        "ridge_height_m": (0.0, 0.332)
    }
    # They were put where they were on another field; drift is counted from there all the same.
    assert [camera.drift_since for camera in revision.cameras] == [1, 1]
    changes = [one.event.data.changed for one in stock.events.since("v", 0, ["venue.*"], 99).events[1:]]
    assert changes == [["field"]]


def test_memories_and_trends_end_with_it_as_with_any_other_field_that_is_put(stock):
    stock.venue("v")
    job = night(stock, RIDGE)
    with stock.engine.connect() as connection:
        assert newest_memories(connection, "v") == {"left": {"jobs": 1}, "right": {"jobs": 1}}
    adopted(stock, job)
    with stock.engine.connect() as connection:
        assert newest_memories(connection, "v") == {}
    assert stock.trends.of(stock.venues.get("v"), "left").anchor is None
    assert stock.adoption.refined_of_venue(stock.venues.get("v")) == {}


def test_to_store_it_again_changes_nothing(stock):
    stock.venue("v")
    job = night(stock, RIDGE)
    assert adopted(stock, job) == adopted(stock, job)
    assert newest(stock).revision == 3
    assert offered(stock, job) == []


def test_a_ridge_and_a_length_of_one_job_are_stored_one_after_the_other_in_any_order(stock):
    stock.venue("v")
    job = night(stock, RIDGE, LENGTH)
    assert offered(stock, job) == ["ridge_height_m", "length_m"]
    assert adopted(stock, job, "length_m").length_m == 104.6
    assert offered(stock, job) == ["ridge_height_m"]
    both = adopted(stock, job)
    # The ridge is the one that the lines were asked for, of a pitch of 105 m, stretched with that.
    assert (both.length_m, both.ridge[1]) == (104.6, pytest.approx([18.5 * 104.6 / 105.0, 0.0, 0.332]))
    assert offered(stock, job) == []
    assert adopted(stock, job) == both


@in_one_home_first
def test_restoring_the_revision_before_takes_a_length_back_and_the_one_after_brings_it_again(stock):
    stock.venue("v")
    job = night(stock, LENGTH)
    adopted(stock, job, "length_m")
    assert length(stock) == 104.6
    stock.venues.restore("v", 2)
    assert (length(stock), newest(stock).cause, newest(stock).restored_from) == (105.0, "restored", 2)
    assert offered(stock, job) == ["length_m"]
    stock.venues.restore("v", 3)
    assert length(stock) == 104.6
    stock.venues.restore("v", 1)
    assert length(stock) == 105.0
    assert stock.venues.restorable(stock.venues.get("v"), [1, 2, 3, 4, 5]) == {1, 2, 3, 4, 5}


def test_a_length_that_somebody_has_put_since_is_not_taken_back(stock):
    venue = stock.venue("v")
    adopted(stock, night(stock, LENGTH), "length_m")
    measured = venue.field.model_copy(update={"length_m": 104.7})
    stock.venues.put(stock.venues.get("v").model_copy(update={"field": measured}))
    stock.venues.restore("v", 1)
    assert length(stock) == 104.7


def test_nothing_is_stored_of_a_job_whose_poses_do_not_hold(stock):
    stock.venue("v")
    rejected, dry = night(stock, RIDGE, accepted=False), night(stock, RIDGE, dry_run=True)
    first = night(stock, RIDGE)
    second = night(stock, RIDGE, accepted=["left"])
    assert [offered(stock, job) for job in (rejected, dry, first)] == [[], [], []]
    for job in (rejected, dry, first):
        with refused("venue-moved-on") as moved:
            adopted(stock, job)
        assert moved.value.parts["got"] == 3
    assert offered(stock, second) == ["ridge_height_m"]
    stock.moved_by_hand("v", -3.0)
    with refused("venue-moved-on"):
        adopted(stock, second)
    assert stock.venues.get("v").field.ridge is None


def test_poses_that_a_person_accepted_or_restored_hold_too_and_so_do_refined_ones(stock):
    stock.venue("v")
    by_hand = night(stock, RIDGE, accepted=False)
    stock.decisions.accept(by_hand)
    assert offered(stock, by_hand) == ["ridge_height_m"]
    night(stock)
    assert offered(stock, by_hand) == []
    stock.venues.restore("v", 2)
    assert offered(stock, by_hand) == ["ridge_height_m"]
    last = night(stock, RIDGE)
    stock.adoption.adopt_refined("v", "left")
    assert adopted(stock, last).ridge == HIPPED


def test_on_a_field_that_was_put_since_nothing_is_offered(stock):
    venue = stock.venue("v")
    job = night(stock, RIDGE)
    wider = venue.field.model_copy(update={"width_m": 69.0})
    stock.venues.put(stock.venues.get("v").model_copy(update={"field": wider}))
    assert offered(stock, job) == []
    with refused("venue-moved-on"):
        adopted(stock, job)


def test_a_number_that_the_sport_does_not_allow_is_refused_with_its_limits(stock):
    stock.venue("v")
    job = night(stock, ("length_m", 105.0, 131.5), ("ridge_height_m", 0.0, -0.1))
    reasons = {name: one.refused_because for name, one in stock.adoption.adoptable_numbers(job).items()}
    assert reasons == {
        "length_m": "football: 60 to 130 m, not 131.5",
        "ridge_height_m": "the ridge must be 0 to 3 m high, not -0.1 m",
    }
    with refused("field-number-refused", "60 to 130 m"):
        adopted(stock, job, "length_m")
    assert newest(stock).revision == 2


def test_what_a_job_does_not_offer_and_jobs_of_other_venues_are_refused(stock):
    stock.venue("v")
    stock.venue("w")
    with refused("field-number-not-found") as problem:
        adopted(stock, night(stock, RIDGE), "width_m")
    assert problem.value.parts["expected"] == ["ridge_height_m"]
    for job in (stock.calibrated("w"), "01KAJ3Q6WZ5T3Y8R0N4M2C7B1D"):
        with refused("job-not-found"):
            adopted(stock, job)
        assert offered(stock, job) == []


def test_a_calibration_that_runs_meanwhile_is_rejected(stock):
    stock.venue("v")
    job = night(stock, RIDGE)
    running = stock.attempts.begin(stock.submitted("v"))
    adopted(stock, job)
    stock.attempts.finish(running, result(running.venue, True), [])
    assert stock.jobs.get(running.job_id).result.rejected_because == "the venue was changed while the job ran"


@pytest.mark.parametrize("given", [{}, {"ridge": [[-18.5, 1.0, 0.2], [18.5, 1.0, 0.2]]}])
@pytest.mark.parametrize("size", [{"length_m": 105, "width_m": 68}, {"length_m": 90, "width_m": 90}])
def test_a_field_gets_the_ridge_that_calibrations_have_asked_the_lines_for(given, size):
    field = FieldOfPlay(**size, **given)
    higher: Field = pitch_of(field).raised(0.332 - field.number("ridge_height_m"))
    np.testing.assert_allclose(field.with_number("ridge_height_m", 0.332).ridge, higher.ridge)
