"""What whoever watches the service gets to know, and what it costs the database."""

from datetime import UTC, datetime, timedelta

import pytest
import sqlalchemy as sa

from service.schemas.job import JobError
from service.store.statistics.counters import STAGE, HistogramBuckets, add, read
from service.store.statistics.job_outcome import ENDED, ERRORS, STAGES, JobOutcome
from service.store.statistics.snapshot import read_statistics
from testbed.homes import in_both_homes
from testbed.stock import result

NOON = datetime(2026, 11, 21, 12, tzinfo=UTC)
TIMES = HistogramBuckets("t", (1, 5))


@pytest.fixture
def counted(engine):
    """Count something, and give all that was counted."""

    def counted(*amounts):
        with engine.begin() as connection:
            for amount in amounts:
                add(connection, amount)
            return read(connection)

    return counted


@in_both_homes
def test_observations_fall_into_the_buckets_that_prometheus_means(counted):
    found = counted(TIMES.of(1), TIMES.of(1.5), TIMES.of(99))
    assert TIMES.read(found) == ([("1", 1), ("5", 2), ("+Inf", 3)], pytest.approx(101.5))
    assert TIMES.read(found, "of nobody") == ([("1", 0), ("5", 0), ("+Inf", 0)], 0)


def test_what_an_older_release_counted_under_other_bounds_is_not_lost(counted):
    found = counted(HistogramBuckets("t", (2, 50)).of(1.5), HistogramBuckets("t", (2, 50)).of(40), TIMES.of(0.5))
    assert TIMES.read(found)[0] == [("1", 1), ("5", 2), ("+Inf", 3)]


def end(**values):
    shown = {
        "kind": "calibration",
        "status": "failed",
        "result": None,
        "error": None,
        "created_at": NOON,
        "started_at": NOON + timedelta(seconds=3),
        "finished_at": NOON + timedelta(seconds=10),
        "attempts": 1,
    }
    return JobOutcome(**(shown | values)).tallies()


def test_an_error_that_nobody_knows_makes_no_new_series():
    odd = JobError(type="/problems/the-program-made-this-up", title="", detail="")
    assert end(error=odd)[ENDED, ("failed", "", "other")] == 1
    for kind in ERRORS[:-1]:
        known = JobError(type=f"/problems/{kind}", title="", detail="")
        assert end(error=known)[ENDED, ("failed", "", kind)] == 1


def test_a_stage_that_nobody_knows_makes_no_new_series(stock):
    odd = result(stock.venue("v"), accepted=True).model_copy(update={"timings_s": {"decode": 0.2, "magic": 1.0}})
    stages = {labels[0] for metric, labels in end(status="succeeded", result=odd) if metric == f"{STAGE.metric}_bucket"}
    assert stages == {"decode"} < set(STAGES)


def test_a_job_that_was_never_begun_has_only_an_end():
    assert end(status="cancelled", started_at=None) == {(ENDED, ("cancelled", "", "")): 1}


def test_a_clock_that_was_set_back_makes_no_negative_times():
    early = end(started_at=NOON - timedelta(seconds=5), finished_at=NOON - timedelta(seconds=1))
    assert min(early.values()) >= 0


def test_a_look_reads_no_table_from_end_to_end_that_grows_with_jobs_or_venues(stock):
    stock.ended("v", NOON, callback_url="https://example.com/")
    stock.submitted("w")
    asked = []

    @sa.event.listens_for(stock.engine, "before_cursor_execute")
    def _(connection, cursor, statement, parameters, context, many):
        asked.append((statement, parameters))

    seen = read_statistics(stock.engine, 10)
    assert (seen.callbacks_waiting, [waiting.jobs for waiting in seen.queue.values()], seen.running) == (1, [1], 0)
    selects = [(statement, values) for statement, values in asked if statement.startswith("SELECT")]
    with stock.engine.connect() as connection:
        steps = [
            row[-1]
            for statement, values in selects
            for row in connection.exec_driver_sql(f"EXPLAIN QUERY PLAN {statement}", values)
        ]
    assert any("jobs" in step for step in steps)
    grows = ("jobs", "venues", "deliveries", "venue_quality", "revisions")
    assert [
        step for step in steps if step.startswith("SCAN") and step.split()[1] in grows and "INDEX" not in step
    ] == []
