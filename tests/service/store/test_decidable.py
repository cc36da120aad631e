"""What can still be decided about a calibration is what is then not refused."""

from service.store.jobs.decisions import OpenDecisions
from testbed.homes import in_one_home_first
from tests.problems import refused

BOTH = frozenset({"left", "right"})
NOTHING = OpenDecisions(frozenset(), reject=False)


@in_one_home_first
def test_poses_that_hold_can_be_rejected_and_then_accepted(stock):
    stock.venue("v")
    job = stock.calibrated("v")
    assert stock.decisions.decidable(job) == OpenDecisions(frozenset(), reject=True)
    stock.decisions.reject(job)
    assert stock.decisions.decidable(job) == OpenDecisions(BOTH, reject=False)
    stock.decisions.accept(job)
    assert stock.decisions.decidable(job) == OpenDecisions(frozenset(), reject=True)


def test_of_a_result_that_was_accepted_in_part_the_other_cameras_can_be_accepted(stock):
    stock.venue("v")
    job = stock.calibrated("v", accepted=["left"])
    assert stock.decisions.decidable(job) == OpenDecisions(frozenset({"right"}), reject=True)
    stock.decisions.accept(job, ["right"])
    assert stock.decisions.decidable(job) == OpenDecisions(frozenset(), reject=True)


def test_nothing_can_be_decided_about_a_venue_that_somebody_changed_since(stock):
    stock.venue("v")
    job = stock.calibrated("v", accepted=["left"])
    stock.moved_by_hand("v", -3.0)
    assert stock.decisions.decidable(job) == OpenDecisions(frozenset(), reject=False, is_outdated=True)
    for decide in (stock.decisions.accept, stock.decisions.reject):
        with refused("venue-moved-on"):
            decide(job)


def test_nothing_can_be_decided_about_a_job_without_poses_or_without_its_venue(stock):
    stock.venue("v")
    waiting = stock.submitted("v")
    assert stock.decisions.decidable(waiting) == NOTHING
    stock.decisions.cancel(waiting)
    job = stock.calibrated("v")
    stock.venues.delete("v")
    assert stock.decisions.decidable(job) == NOTHING
