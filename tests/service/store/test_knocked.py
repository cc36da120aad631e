"""A knocked camera that was found again: proposed until a person accepts it, or stored at once."""

import pytest

from service.schemas.geometry import Moved
from service.schemas.results import Proposal
from service.store.memories import newest_memories
from testbed.stock import result
from tests.service.store.test_alarms import rings, told, watched
from tests.service.store.test_partly import standing
from tests.trending import displacement

WORDS = "turned by 11.2 degrees and moved by 0.30 m, and found again: 97% of the lines are seen there"
MEMORY = {"format": 1}


def knocked(stock, *, recovered):
    """A calibration that finds the left camera elsewhere, and stores it there or proposes it; the right one is well."""
    job_id = stock.submitted("v")
    task = stock.attempts.begin(job_id)
    found = result(task.venue, ["left", "right"] if recovered else ["right"])
    left, right = found.cameras
    moved = Moved(rotation_deg=11.2, position_m=0.3, pixels=400.0)
    left = left.model_copy(
        update={
            "knocked": True,
            "moved": moved,
            "displacement": displacement(1.0, anchor=1),
            "rejected_because": None if recovered else WORDS,
            "proposed": None if recovered else Proposal(pose=left.pose, sigma=None, moved=moved, found=0.97),
        }
    )
    told = found.model_copy(update={"cameras": [left, right]})
    stock.attempts.finish(task, told, [], {"left": MEMORY} if recovered else {})
    return job_id


def newest(stock):
    return stock.venues.history("v", None, 1)[0]


def test_a_proposal_is_stored_by_accepting_the_job_and_by_nothing_else(stock):
    stock.venue("v")
    job = knocked(stock, recovered=False)
    assert standing(stock) == {"left": -1.0, "right": -0.999}
    assert stock.decisions.decidable(job).accept == {"left"}
    stock.decisions.accept(job, ["left"])
    assert standing(stock) == {"left": -0.999, "right": -0.999}
    assert newest(stock).cause == "accepted"


def test_what_is_accepted_at_once_is_a_revision_with_a_cause_of_its_own_and_can_be_undone(stock):
    stock.venue("v")
    job = knocked(stock, recovered=True)
    assert (newest(stock).cause, newest(stock).job) == ("recovered", job)
    with stock.engine.connect() as connection:
        assert newest_memories(connection, "v")["left"] == MEMORY
    stock.decisions.reject(job)
    assert standing(stock) == {"left": -1.0, "right": -1.0}


def test_the_trend_of_a_camera_begins_anew_where_it_was_found(stock):
    stock.calibrated("v")
    before = stock.trends.of(stock.venue("v"), "left", None).anchor
    knocked(stock, recovered=True)
    found = stock.trends.of(stock.venue("v"), "left", None)
    assert (found.anchor, found.points[-1].across_m) == (newest(stock).revision, pytest.approx(0.0))
    assert found.anchor != before


def test_an_alarm_rings_for_a_knocked_camera_with_how_far_it_turned_until_somebody_accepts_it(stock):
    watched(stock, knocked=True)
    job = knocked(stock, recovered=False)
    (alarm,) = stock.venues.health("v").alarms
    assert (alarm.rule, alarm.camera, alarm.why) == ("knocked", "left", f"Camera left was {WORDS}.")
    stock.venues.update_alarms("v")
    assert rings(stock) == [("knocked", "left")]
    stock.decisions.accept(job, ["left"])
    assert (rings(stock), told(stock)) == ([], [("knocked", "began"), ("knocked", "ended")])


def test_a_knocked_camera_rings_no_alarm_that_nobody_asked_for(stock):
    watched(stock, rejected_in_a_row=3)
    knocked(stock, recovered=False)
    assert rings(stock) == []


def test_a_camera_that_was_accepted_where_it_was_found_is_told_with_the_movement(stock):
    watched(stock, moved_since_last_px=0.001)
    knocked(stock, recovered=True)
    (left,) = [alarm for alarm in stock.venues.health("v").alarms if alarm.camera == "left"]
    assert left.why.endswith("and was found again.")
