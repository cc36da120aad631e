"""How the calibrations of a venue ended, read in bulk."""

from datetime import UTC, datetime, timedelta

from testbed.homes import in_both_homes

NOW = datetime(2026, 11, 21, 12, tzinfo=UTC)


@in_both_homes
def test_the_ends_of_calibrations_are_told_newest_first(stock):
    jobs = [
        stock.ended("v", NOW + timedelta(minutes=number), accepted=accepted, dry_run=accepted is True)
        for number, accepted in enumerate((True, False, None))
    ]
    stock.ended("another", NOW)
    ends = stock.past_calibrations.of("v", 10)
    assert [end.job for end in ends] == jobs[::-1]
    assert [(end.status, end.accepted, end.dry_run) for end in ends] == [
        ("failed", None, False),
        ("succeeded", False, False),
        ("succeeded", True, True),
    ]
    assert ends[0].finished_at == NOW + timedelta(minutes=2)
    assert (ends[0].moved_px, ends[0].stitch_error_px) == (None, None)
    assert ends[2].moved_px == max(moved.pixels for moved in ends[2].moved.values())
    assert [end.job for end in stock.past_calibrations.of("v", 1)] == jobs[2:]


@in_both_homes
def test_the_newest_result_is_that_of_the_last_job_that_has_one(stock):
    ends = stock.past_calibrations
    assert ends.newest_result("v") is None
    rejected = stock.ended("v", NOW, accepted=False)
    stock.ended("v", NOW, accepted=None)
    assert ends.newest_result("v") == rejected


@in_both_homes
def test_what_waits_or_runs_is_known_by_its_venue(stock):
    waiting = stock.submitted("v")
    stock.ended("another", NOW)
    assert stock.past_calibrations.active(["v", "another", "nowhere"]) == {"v": waiting}
