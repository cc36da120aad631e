"""Live poses in the store: the newest report, the minutes, and the alarms that ring by them."""

from datetime import UTC, datetime, timedelta

import pytest
import sqlalchemy as sa

from service.schemas.health import Alarms as Rules
from service.schemas.live import LiveReport, LiveState
from service.store import tables
from service.store.statistics.snapshot import read_statistics
from testbed.homes import in_both_homes
from worker.duties.alarms import AlarmTimer
from worker.duties.retention import Retention

pytestmark = in_both_homes


def camera(name="left", status="measured", **more):
    counts = {"measured": 12, "coasted": 0} | {key: more.pop(key) for key in ("measured", "coasted") if key in more}
    return {
        "id": name,
        "status": status,
        "stream": f"rtsp://10.1.0.7/{name}",
        "pictures": sum(counts.values()),
        "turned_deg": 0.1,
        "latency_ms": {"p50": 40.0, "p99": 60.0},
        **counts,
        **more,
    }


def report(*cameras, **more):
    return LiveReport.model_validate(
        {"started_at": "2026-11-23T10:00:00Z", "host": "truck", "destinations": [], "cameras": cameras, **more}
    )


def told(stock, *cameras, **more):
    stock.live.report("v", report(*(cameras or [camera()]), **more))


def time_passes(stock, **time):
    """All that live poses go by was so much earlier."""
    by = timedelta(**time)
    with stock.engine.begin() as connection:
        row = connection.execute(sa.select(tables.live_reports)).one()
        watched = {
            name: {what: (datetime.fromisoformat(at) - by).isoformat() for what, at in one.items()}
            for name, one in row.watched.items()
        }
        document = earlier(row.document, by) | {"others": [earlier(one, by) for one in row.document["others"]]}
        due_at = row.alarm_due_at and row.alarm_due_at - by
        moments = {"document": document, "reported_at": row.reported_at - by, "alarm_due_at": due_at}
        connection.execute(sa.update(tables.live_reports).values(watched=watched, **moments))


def earlier(sender, by):
    """What is stored of a process, so much earlier."""
    moments = {"first_at", "reported_at"} & sender.keys()
    return sender | {what: (datetime.fromisoformat(sender[what]) - by).isoformat() for what in moments}


def rings(stock):
    AlarmTimer(stock.venues).poll()
    return [(alarm.rule, alarm.camera) for alarm in stock.venues.health("v").alarms]


@pytest.fixture
def watched(stock):
    venue = stock.venue("v")
    stock.venues.put(venue.model_copy(update={"alarms": Rules(live=True)}))
    return stock


def test_the_newest_report_is_kept_and_runs_for_five_seconds(stock):
    stock.venue("v")
    assert stock.live.state("v") == LiveState()
    told(stock, camera(stream="rtsp://user:secret@10.1.0.7/main"))
    told(stock, camera(stream="rtsp://user:secret@10.1.0.7/main", turned_deg=0.3))
    state = stock.live.state("v")
    assert (state.running, state.host, state.cameras[0].turned_deg) == (True, "truck", 0.3)
    assert state.cameras[0].stream == "rtsp://***@10.1.0.7/main"
    time_passes(stock, seconds=6)
    assert not stock.live.state("v").running
    told(stock, stopped=True)
    assert not stock.live.state("v").running


def test_reports_add_up_by_the_minute_with_the_worst_of_each_and_go_after_a_week(stock):
    stock.venue("v")
    told(stock, camera(turned_deg=0.2, latency_ms={"p50": 10, "p99": 90}))
    told(stock, camera(turned_deg=0.1, latency_ms={"p50": 30, "p99": 50}), camera("right", measured=0, coasted=3))
    minutes = stock.live.history("v", 60)
    # A minute may have ended between the two.
    lefts = [minute.cameras["left"] for minute in minutes]
    assert sum(left.measured for left in lefts) == sum(left.pictures for left in lefts) == 24
    assert max(left.turned_deg for left in lefts) == 0.2
    assert max(left.latency_ms.p99 for left in lefts) == 90
    assert minutes[-1].cameras["right"].coasted == 3
    retention = Retention(stock.settings, stock.expiry, stock.blobs, stock.workers, lambda _: None)
    retention.round(datetime.now(UTC) + timedelta(days=6))
    assert stock.live.history("v", 60) == minutes
    retention.round(datetime.now(UTC) + timedelta(days=8))
    assert stock.live.history("v", 60) == []


def test_what_was_reported_of_a_venue_goes_with_it(stock):
    stock.venue("v")
    told(stock)
    stock.venues.delete("v")
    assert stock.live.newest(["v"]) == {}
    assert stock.live.history("v", 60) == []


def test_a_tracked_camera_that_is_not_measured_rings_after_ten_seconds_until_it_is(watched):
    right = camera("right", status="stored", stream=None, measured=0)
    told(watched, camera(status="coasted", measured=0, coasted=12), right)
    assert rings(watched) == []
    time_passes(watched, seconds=11)
    told(watched, camera(status="refused", measured=0, coasted=12), right)
    assert rings(watched) == [("live-not-measured", "left")]
    assert "Camera left was not measured in its stream since" in watched.venues.health("v").alarms[0].why
    # One of many pictures is enough: lines may be looked for in every tenth alone.
    told(watched, camera(status="coasted", measured=1, coasted=9), right)
    assert rings(watched) == []
    events = watched.events.since("v", 0, ["alarm.*"], 100).events
    assert [(event.event.type, event.event.data.setting) for event in events] == [
        ("alarm.began", "live"),
        ("alarm.ended", "live"),
    ]


def test_poses_that_come_late_for_a_minute_ring(watched):
    late = camera(latency_ms={"p50": 400, "p99": 1200})
    told(watched, late)
    time_passes(watched, seconds=55)
    told(watched, late)
    assert rings(watched) == []
    time_passes(watched, seconds=6)
    told(watched, late)
    assert rings(watched) == [("live-late", "left")]
    told(watched)
    assert rings(watched) == []


def test_a_process_that_is_not_heard_of_rings_unless_it_was_told_to_end(watched):
    told(watched)
    time_passes(watched, seconds=31)
    assert rings(watched) == [("live-silent", None)]
    assert "on truck" in watched.venues.health("v").alarms[0].why
    told(watched)
    assert rings(watched) == []
    told(watched, stopped=True)
    time_passes(watched, seconds=31)
    assert rings(watched) == []


def of(process, **more):
    """What a report says of its process."""
    return {"host": f"host-{process}", "pid": 1, **more}


def test_one_of_two_processes_is_missed_though_the_other_reports_or_ends_in_order(watched):
    for process in ("a", "b", "a"):
        told(watched, **of(process))
    assert [(one.host, one.running) for one in watched.live.state("v").others] == [("host-b", True)]
    time_passes(watched, seconds=31)
    told(watched, **of("b"))
    assert rings(watched) == [("live-silent", None)]
    assert "on host-a" in watched.venues.health("v").alarms[0].why
    assert [(one.host, one.running) for one in watched.live.state("v").others] == [("host-a", False)]
    told(watched, **of("b", stopped=True))
    assert rings(watched) == [("live-silent", None)]
    told(watched, **of("a"))
    assert rings(watched) == []
    told(watched, **of("a", stopped=True))
    time_passes(watched, seconds=31)
    assert (rings(watched), watched.live.state("v").others) == ([], [])


def test_a_process_does_not_hide_that_another_one_does_not_measure(watched):
    blind, stored = camera(status="coasted", measured=0, coasted=12), camera(status="stored", stream=None, measured=0)
    for process, reported in (("a", blind), ("b", stored), ("a", blind)):
        told(watched, reported, **of(process))
    time_passes(watched, seconds=11)
    told(watched, blind, **of("a"))
    told(watched, stored, **of("b"))
    assert rings(watched) == [("live-not-measured", "left")]


def test_a_process_that_takes_the_place_of_one_that_died_is_the_only_one_that_is_missed(watched):
    told(watched, **of("a", started_at="2026-11-23T10:00:00Z"))
    time_passes(watched, seconds=3)
    for _ in range(2):
        told(watched, **of("a", started_at="2026-11-23T11:00:00Z"))
        assert watched.live.state("v").others == []
        time_passes(watched, seconds=29)
    told(watched, **of("a", started_at="2026-11-23T11:00:00Z"))
    assert rings(watched) == []
    told(watched, **of("a", started_at="2026-11-23T11:00:00Z", stopped=True))
    time_passes(watched, seconds=31)
    assert rings(watched) == []


def test_a_process_that_is_missed_for_a_day_is_missed_no_more(watched):
    for process in ("a", "b", "a"):
        told(watched, **of(process))
    for hours in (0, 25):
        time_passes(watched, hours=hours)
        told(watched, **of("b"))
    assert (rings(watched), watched.live.state("v").others) == ([], [])


def test_prometheus_reads_whether_it_runs_what_is_measured_and_how_late_poses_are(stock):
    stock.venue("v")
    told(stock, camera(measured=6, coasted=2), camera("right", status="stored", stream=None, measured=0))
    (live,) = read_statistics(stock.engine, 10).live
    assert (live.venue, live.running, live.measured_share, live.latency_p99_s) == ("v", True, 0.75, 0.06)
    time_passes(stock, seconds=6)
    (live,) = read_statistics(stock.engine, 10).live
    assert (live.running, live.latency_p99_s) == (False, None)
    assert read_statistics(stock.engine, 0).live == []


def test_a_venue_without_the_rule_never_rings_and_is_looked_at_once(stock):
    stock.venue("v")
    told(stock)
    time_passes(stock, seconds=31)
    assert stock.venues.with_alarms_due(10) == ["v"]
    assert rings(stock) == []
    assert stock.venues.with_alarms_due(10) == []
