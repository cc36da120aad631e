"""Alarms of venues: each begins once and is over once."""

from service.schemas.health import Alarms as Rules
from service.schemas.job import JobError
from service.store.statistics.snapshot import read_statistics
from testbed.homes import in_both_homes, in_one_home_first
from worker.duties.alarms import AlarmTimer

URL = "https://example.com/alarms"
ERROR = JobError(type="/problems/no-markings-in-view", title="", detail="")


def watched(stock, **rules):
    venue = stock.venue("v")
    stock.venues.put(venue.model_copy(update={"alarms": Rules(callback_url=URL, **rules)}))


def told(stock):
    return [(event.data.rule, event.type.removeprefix("alarm.")) for event in stock.alarms_told()]


def rings(stock):
    return [(alarm.rule, alarm.camera) for alarm in stock.venues.health("v").alarms]


def failed(stock, **options):
    task = stock.attempts.begin(stock.submitted("v", **options))
    stock.attempts.fail(task, ERROR)


def test_a_venue_without_rules_is_ok_whatever_happens(stock):
    stock.venue("v")
    for _ in range(3):
        stock.calibrated("v", accepted=False)
    health = stock.venues.health("v")
    assert (health.state, health.alarms, health.rejected_in_a_row) == ("ok", [], 3)
    assert stock.venues.health("nowhere") is None


def test_taking_a_rejected_result_by_hand_ends_the_row(stock):
    watched(stock, rejected_in_a_row=1)
    job = stock.calibrated("v", accepted=False)
    assert rings(stock) == [("rejected-in-a-row", None)]
    stock.decisions.accept(job)
    assert rings(stock) == []


def test_a_camera_that_moved_far_rings_until_it_moves_less(stock):
    watched(stock, moved_since_last_px=0.001)
    stock.calibrated("v")
    assert rings(stock) == [("moved-since-last", "left"), ("moved-since-last", "right")]
    why = stock.venues.health("v").alarms[0].why
    assert why.startswith("Camera left moved by 0.0 px (0.00 degrees, 0.001 m)")
    # Somebody put it there, which is no movement.
    stock.moved_by_hand("v", -3.0)
    assert rings(stock) == []
    assert told(stock) == [("moved-since-last", "began")] * 2 + [("moved-since-last", "ended")] * 2


def test_drift_adds_up_until_it_rings_and_restoring_ends_it(stock):
    stock.venue("v")
    stock.calibrated("v")
    step = stock.venues.health("v").cameras[0].drift.pixels
    watched(stock, moved_since_first_px=2.5 * step)
    for rung in (False, True, True):
        stock.calibrated("v")
        assert bool(rings(stock)) == rung
    assert told(stock) == [("moved-since-first", "began")] * 2
    stock.venues.restore("v", 2)
    assert rings(stock) == []
    assert told(stock)[2:] == [("moved-since-first", "ended")] * 2


@in_both_homes
def test_what_was_not_calibrated_for_long_rings_without_anything_happening(stock):
    watched(stock, not_calibrated_for_h=24)
    duty = AlarmTimer(stock.venues)
    duty.poll()
    assert rings(stock) == []
    stock.time_passes(hours=25)
    for _ in range(2):
        assert duty.poll() > 0
    assert (rings(stock), told(stock)) == ([("not-calibrated", None)], [("not-calibrated", "began")])
    stock.calibrated("v")
    assert told(stock)[1:] == [("not-calibrated", "ended")]
    stock.time_passes(hours=25)
    duty.poll()
    assert told(stock)[2:] == [("not-calibrated", "began")]


def test_an_alarm_names_the_setting_that_it_goes_by(stock):
    watched(stock, rejected_in_a_row=1)
    stock.calibrated("v", accepted=False)
    (alarm,) = stock.venues.health("v").alarms
    assert (alarm.setting, getattr(Rules(rejected_in_a_row=1), alarm.setting)) == ("rejected_in_a_row", 1)
    assert stock.alarms_told()[0].data.setting == "rejected_in_a_row"


@in_one_home_first
def test_alarms_go_with_their_venue(stock):
    watched(stock, rejected_in_a_row=1)
    stock.calibrated("v", accepted=False)
    stock.venues.delete("v")
    stock.venue("v")
    assert (rings(stock), stock.venues.health("v").rejected_in_a_row) == ([], 0)


@in_both_homes
def test_what_rings_is_told_to_whoever_watches_and_only_so_much_of_it(stock):
    watched(stock, rejected_in_a_row=1, moved_since_last_px=0.001)
    stock.calibrated("v")
    stock.calibrated("v", accepted=False)
    seen = read_statistics(stock.engine, 10)
    assert seen.alarms == {"moved-since-last": 2, "rejected-in-a-row": 1}
    assert [(ringing.venue, ringing.rule) for ringing in seen.ringing] == [
        ("v", "moved-since-last"),
        ("v", "rejected-in-a-row"),
    ]
    assert seen.venues[0].drift_px == stock.venues.health("v").cameras[0].drift.pixels
    assert len(read_statistics(stock.engine, 1).ringing) == 1
