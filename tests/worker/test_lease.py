"""What a worker asks the database about the jobs that it computes."""

from datetime import UTC, datetime, timedelta

import pytest
import sqlalchemy as sa

from service.schemas.job import Progress
from service.store import tables
from service.store.workers import silent_jobs
from testbed.homes import in_both_homes
from worker import lease
from worker.lease import JobTimeoutError, LeaseLostError, Leases

JOBS = 5


@pytest.fixture
def asked(stock):
    """The statements about jobs that have been run."""
    statements = []

    @sa.event.listens_for(stock.engine, "before_cursor_execute")
    def note(_, __, statement, *___):
        if "jobs" in statement:
            statements.append(statement)

    return statements


@in_both_homes
def test_one_statement_asks_about_all_jobs_of_a_worker(stock, asked, monkeypatch):
    monkeypatch.setattr(lease, "ANSWER_VALID_S", 60.0)
    tasks = [stock.attempts.begin(stock.submitted(f"v{number}")) for number in range(JOBS)]
    leases = Leases(stock.attempts)
    held = [leases.begin(task, 60.0) for task in tasks]
    for one in held:
        one.__enter__()
    asked.clear()
    for _ in range(3):
        for one in held:
            one.check()
    assert len(asked) == 1
    stock.decisions.cancel(tasks[0].job_id)
    stock.attempts.begin(tasks[1].job_id)
    monkeypatch.setattr(lease, "ANSWER_VALID_S", 0.0)
    for one in held[:2]:
        with pytest.raises(LeaseLostError):
            one.check()
    for one in held[2:]:
        one.check()


@in_both_homes
def test_progress_is_written_once_a_stage_by_the_question_that_is_asked_anyway(stock, asked, monkeypatch):
    monkeypatch.setattr(lease, "PROGRESS_WAITS_S", 0.0)
    monkeypatch.setattr(lease, "BEAT_S", 60.0)
    task, silent = (stock.attempts.begin(stock.submitted(venue)) for venue in ("v", "w"))
    leases = Leases(stock.attempts)
    with leases.begin(task, 60.0) as held, leases.begin(silent, 60.0) as beside:
        held.check()
        asked.clear()
        for stage, fraction in (("segmentation", 0.1), ("segmentation", 0.2), ("evolution", 0.4), ("evolution", 0.5)):
            held.report(Progress(stage=stage, fraction=fraction))
            held.check()
            beside.check()
        # Each stage once, and in the same transaction whether the other job is still this worker's.
        assert [statement.split()[0] for statement in asked] == 2 * ["UPDATE", "SELECT"]
        assert stock.jobs.get(task.job_id).progress.fraction == 0.4
        assert stock.jobs.get(silent.job_id).progress is None
        stock.decisions.cancel(task.job_id)
        held.report(Progress(stage="refinement", fraction=0.9))
        with pytest.raises(LeaseLostError):
            held.check()
        beside.check()


@in_both_homes
def test_what_several_jobs_have_to_say_is_written_in_one_statement(stock, asked, monkeypatch):
    monkeypatch.setattr(lease, "ANSWER_VALID_S", 60.0)
    monkeypatch.setattr(lease, "PROGRESS_WAITS_S", 0.0)
    monkeypatch.setattr(lease, "BEAT_S", 60.0)
    tasks = [stock.attempts.begin(stock.submitted(f"v{number}")) for number in range(JOBS)]
    leases = Leases(stock.attempts)
    held = [leases.begin(task, 60.0).__enter__() for task in tasks]
    held[0].check()
    asked.clear()
    for number, one in enumerate(held):
        one.report(Progress(stage="evolution", fraction=number / 10))
    held[0].check()
    assert len(asked) == 1
    assert [stock.jobs.get(task.job_id).progress.fraction for task in tasks] == [0.0, 0.1, 0.2, 0.3, 0.4]


@pytest.fixture
def now(monkeypatch):
    """The time of the worker, s, as a list of one."""
    now = [100.0]
    monkeypatch.setattr(lease.time, "monotonic", lambda: now[0])
    return now


def test_an_attempt_that_has_had_its_time_does_not_go_on(stock, now):
    task = stock.attempts.begin(stock.submitted("v"))
    with Leases(stock.attempts).begin(task, 60.0) as held:
        held.check()
        now[0] += 60.1
        with pytest.raises(JobTimeoutError):
            held.check()


def test_a_lease_is_renewed_however_often_it_is_asked_about(stock, now):
    task = stock.attempts.begin(stock.submitted("v"))
    with Leases(stock.attempts).begin(task, 60.0) as held:
        held.check()
        with stock.engine.begin() as connection:
            connection.execute(sa.update(tables.jobs).values(updated_at=datetime.now(UTC) - timedelta(minutes=1)))
        assert silent(stock) == [task.job_id]
        for _ in range(4):
            now[0] += lease.BEAT_S / 2
            held.check()
        assert silent(stock) == []


def silent(stock) -> list[str]:
    with stock.engine.connect() as connection:
        return silent_jobs(connection, datetime.now(UTC), 30.0)
