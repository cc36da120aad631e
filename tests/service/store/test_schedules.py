"""Schedules of venues: fired once, by one worker, whatever happens to workers."""

from collections import Counter
from datetime import UTC, datetime, timedelta

import pytest

from service.schemas.schedule import InvalidSchedule, Schedule, next_time, phase_of
from service.store.schedules import ScheduleRepository
from testbed.homes import in_both_homes

NOON = datetime(2026, 11, 21, 12, tzinfo=UTC)
LEASE = timedelta(minutes=10)


def at(text: str) -> datetime:
    return datetime.fromisoformat(text).replace(tzinfo=UTC)


@pytest.mark.parametrize(
    ("cron", "zone", "after", "expected"),
    [
        ("*/15 * * * *", "UTC", "2026-11-21T12:00", "2026-11-21T12:15"),
        ("0 3 * * *", "Europe/Berlin", "2026-11-21T12:00", "2026-11-22T02:00"),
        ("0 3 * * *", "Asia/Tokyo", "2026-11-21T12:00", "2026-11-21T18:00"),
        ("0 9 * * sat", "UTC", "2026-11-21T12:00", "2026-11-28T09:00"),
        # Summer begins in Berlin: there is no half past two.
        ("30 2 * * *", "Europe/Berlin", "2026-03-28T12:00", "2026-03-29T01:00"),
        ("30 2 * * *", "Europe/Berlin", "2026-03-29T01:00", "2026-03-30T00:30"),
    ],
)
def test_a_schedule_fires_by_the_clock_on_the_wall(cron, zone, after, expected):
    assert next_time(cron, zone, at(after)) == at(expected)


def test_venues_with_the_same_schedule_fire_one_after_the_other_within_a_quarter_of_an_hour():
    times = [next_time("*/15 * * * *", "UTC", NOON, phase_of(f"venue-{n}")) for n in range(1000)]
    assert NOON < min(times) < max(times) <= NOON + timedelta(minutes=15)
    # 1000 in 900 s.
    assert max(Counter(times).values()) < 10
    assert times[0] == next_time("*/15 * * * *", "UTC", NOON, phase_of("venue-0"))


@pytest.mark.parametrize(
    ("cron", "longest"), [("0 3 * * *", timedelta(minutes=15)), ("*/5 * * * *", timedelta(minutes=5))]
)
def test_how_late_a_venue_fires_is_bounded_and_always_the_same(cron, longest):
    exact = next_time(cron, "UTC", NOON)
    for place in (0.001, 0.5, 0.999):
        first = next_time(cron, "UTC", exact - timedelta(seconds=1), place)
        assert exact <= first < exact + longest
        # From within the time that it is late, it is still to come; afterwards it is the next time's.
        assert next_time(cron, "UTC", first - timedelta(seconds=1), place) == first
        assert next_time(cron, "UTC", first, place) == first + (next_time(cron, "UTC", exact) - exact)


def test_a_venue_fires_before_the_next_time_even_where_times_follow_at_different_distances():
    night = "0,5 3 * * *"
    first = next_time(night, "UTC", at("2026-11-21T02:59"), 0.999)
    assert at("2026-11-21T03:00") < first < at("2026-11-21T03:05")
    second = next_time(night, "UTC", first, 0.999)
    assert at("2026-11-21T03:05") < second <= at("2026-11-21T03:20")


def test_a_schedule_that_must_be_exact_is(stock, schedules):
    spread = put(stock).next_at
    exact = put(stock, exact=True).next_at
    assert (exact.minute % 15, exact.second) == (0, 0)
    assert spread != exact
    (firing,) = schedules.claim_due(exact, exact + LEASE, 10)
    schedules.done(firing, exact, None, None)
    state = stock.venues.health("v").schedule
    assert (state.last_at, state.next_at) == (exact, exact + timedelta(minutes=15))


@pytest.mark.parametrize(
    ("cron", "zone"),
    [
        ("0 0 30 2 *", "UTC"),
        ("61 * * * *", "UTC"),
        ("* * * * * *", "UTC"),
        ("x", "UTC"),
        ("* * * * *", "../etc/passwd"),
    ],
)
def test_what_never_fires_is_no_schedule(cron, zone):
    with pytest.raises(InvalidSchedule):
        next_time(cron, zone, NOON)


@pytest.fixture
def schedules(stock):
    return ScheduleRepository(stock.engine)


def put(stock, cron="*/15 * * * *", exact=False):
    schedule = None if cron is None else Schedule(cron=cron, exact=exact)
    stock.schedule("v", schedule)
    return stock.venues.health("v").schedule


@in_both_homes
def test_a_time_that_came_fires_once(stock, schedules):
    due = put(stock).next_at
    assert schedules.claim_due(due - timedelta(seconds=1), due, 10) == []
    (firing,) = schedules.claim_due(due, due + LEASE, 10)
    assert (firing.venue, firing.due_at) == ("v", due)
    # Another worker.
    assert schedules.claim_due(due, due + LEASE, 10) == []
    schedules.done(firing, due, None, "the camera is away")
    state = stock.venues.health("v").schedule
    assert (state.next_at, state.last_error) == (due + timedelta(minutes=15), "the camera is away")
    assert schedules.claim_due(due, due + LEASE, 10) == []


@in_both_homes
def test_times_that_were_missed_fire_once(stock, schedules):
    due = put(stock).next_at
    late = due + timedelta(hours=5, minutes=1)
    (firing,) = schedules.claim_due(late, late + LEASE, 10)
    schedules.done(firing, late, None, None)
    assert schedules.claim_due(late, late + LEASE, 10) == []
    assert stock.venues.health("v").schedule.next_at == due + timedelta(hours=5, minutes=15)


@in_both_homes
def test_what_a_worker_died_over_is_fired_again_for_the_same_time(stock, schedules):
    due = put(stock).next_at
    (first,) = schedules.claim_due(due, due + LEASE, 10)
    (again,) = schedules.claim_due(due + LEASE, due + 2 * LEASE, 10)
    assert again == first


@in_both_homes
def test_a_schedule_that_is_changed_or_taken_away_fires_no_more(stock, schedules):
    due = put(stock).next_at
    (firing,) = schedules.claim_due(due, due + LEASE, 10)
    changed = put(stock, "0 3 * * *")
    schedules.done(firing, due, None, "too late")
    assert stock.venues.health("v").schedule == changed
    # Put again as it is, it goes on where it was.
    assert put(stock, "0 3 * * *") == changed
    assert put(stock, None) is None
    assert schedules.claim_due(due + timedelta(days=9), due + timedelta(days=9), 10) == []
