"""What a list of jobs costs: the same however many jobs there are, whatever it is filtered by."""

from contextlib import contextmanager
from datetime import UTC, datetime

import pytest
import sqlalchemy as sa

from service.store import tables
from service.store.jobs.queries import JobPage
from testbed.homes import in_both_homes

# So many that reading all of them, or all of the commonest kind, takes longer than a list may.
JOBS, VENUES, PAGE = 4000, 200, 50
# An entry that is shown costs SQLite some forty steps, any other a few.
MOST_ENTRIES, STEPS_OF_AN_ENTRY = 5 * PAGE, 10
LISTS = [
    {"venue": venue, "status": status, "kind": kind}
    for venue in (None, "v7")
    for status in (None, "succeeded", "failed", "queued")
    for kind in (None, "calibration", "locate")
]


@pytest.fixture
def many(stock):
    """Thousands of calibrations that succeeded, and hidden among the oldest a few of everything else."""
    document = {"callback_url": None, "dry_run": False}
    common = {
        "priority": 100,
        "options": document,
        "content_hash": "c",
        "venue_document": {},
        "frames": {},
        "attempt": 1,
        "revision": 1,
        "created_at": datetime(2026, 11, 21, tzinfo=UTC),
        "updated_at": datetime(2026, 11, 21, tzinfo=UTC),
        "finished_at": datetime(2026, 11, 21, tzinfo=UTC),
    }
    rows = [
        common
        | {
            "id": f"01KAJ3Q6WZ5T3Y8R0N{number:08d}",
            "venue": f"v{number % VENUES}",
            "kind": "locate" if number in (7, 8, 9) else "calibration",
            "status": {7: "failed", 207: "failed"}.get(number, "succeeded"),
        }
        for number in range(JOBS)
    ]
    with stock.engine.begin() as connection:
        connection.execute(sa.insert(tables.jobs), rows)
        if connection.dialect.name == "postgresql":
            # It does so by itself, after a while.
            connection.execute(sa.text("ANALYZE"))
    return stock


@in_both_homes
def test_a_list_goes_through_no_more_jobs_than_it_shows(many):
    for filters in LISTS:
        with work_of(many.engine) as work:
            many.jobs.page(JobPage(PAGE, **filters))
        assert max(work) <= MOST_ENTRIES, filters


@in_both_homes
def test_what_is_asked_about_one_venue_goes_through_no_jobs_of_others(many):
    questions = {
        "its last calibrations": lambda: many.past_calibrations.of("v7", 12),
        "its newest result": lambda: many.past_calibrations.newest_result("v7"),
        "what runs there": lambda: many.past_calibrations.active(["v7", "v8"]),
        "whether it is busy": lambda: many.submissions.same_as("v7", None, "c"),
    }
    for name, ask in questions.items():
        with work_of(many.engine) as work:
            ask()
        assert max(work) <= MOST_ENTRIES, name


@in_both_homes
def test_a_list_asks_no_question_for_each_of_its_jobs(stock):
    for name in ("a", "b", "c"):
        stock.calibrated(name, callback_url="https://example.com/")
        stock.submitted(name)
    with work_of(stock.engine) as work:
        jobs = stock.jobs.page(JobPage(10)).jobs
    assert len(work) == 4
    alone = [stock.jobs.get(job.id) for job in jobs]
    assert jobs == alone
    assert sorted(job.queue_position for job in jobs if job.status == "queued") == [1, 2, 3]


@contextmanager
def work_of(engine):
    """How many entries of table or index each statement goes through: at most so many, of SQLite."""
    statements, work = [], []

    def note(connection, cursor, statement, parameters, *_):
        statements.append((statement, parameters))

    sa.event.listen(engine, "before_cursor_execute", note)
    yield work
    sa.event.remove(engine, "before_cursor_execute", note)
    asked = [(statement, parameters) for statement, parameters in statements if "SELECT" in statement]
    with engine.connect() as connection:
        for statement, parameters in asked:
            if engine.dialect.name == "postgresql":
                explained = connection.exec_driver_sql(f"EXPLAIN (ANALYZE, FORMAT JSON) {statement}", parameters)
                work.append(_entries(explained.scalar()[0]["Plan"]))
            else:
                work.append(_steps(connection, statement, parameters) // STEPS_OF_AN_ENTRY)


def _entries(node):
    own = node["Actual Rows"] + node.get("Rows Removed by Filter", 0)
    return max(own, *map(_entries, node.get("Plans", [])), 0)


def _steps(connection, statement, parameters):
    """Of the virtual machine of SQLite."""
    counted, every = [], 10
    driver = connection.connection.driver_connection
    driver.set_progress_handler(lambda: counted.append(1), every)
    connection.exec_driver_sql(statement, parameters).all()
    driver.set_progress_handler(None, every)
    return len(counted) * every
