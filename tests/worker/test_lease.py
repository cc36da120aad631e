"""What a worker asks the database about the jobs that it computes."""

import time

import pytest
import sqlalchemy as sa

from service.schemas.job import Progress
from tests.homes import in_both_homes
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
def test_progress_is_written_once_a_stage_and_is_a_look_as_well(stock, asked):
    task = stock.attempts.begin(stock.submitted("v"))
    with Leases(stock.attempts).begin(task, 60.0) as held:
        asked.clear()
        for fraction in (0.1, 0.2, 0.3):
            held.report(Progress(stage="segmentation", fraction=fraction))
        for fraction in (0.4, 0.5):
            held.report(Progress(stage="evolution", fraction=fraction))
        assert len(asked) == 2
        assert stock.jobs.get(task.job_id).progress.fraction == 0.4
        stock.decisions.cancel(task.job_id)
        with pytest.raises(LeaseLostError):
            held.report(Progress(stage="refinement", fraction=0.9))


def test_an_attempt_that_has_had_its_time_does_not_go_on(stock):
    task = stock.attempts.begin(stock.submitted("v"))
    with Leases(stock.attempts).begin(task, 0.05) as held:
        held.check()
        time.sleep(0.1)
        with pytest.raises(JobTimeoutError):
            held.check()
