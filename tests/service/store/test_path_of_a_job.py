"""What a job asks of the database on its way: a statement more here is one more of every job that there is."""

from collections import Counter
from contextlib import contextmanager
from datetime import timedelta

import pytest
import sqlalchemy as sa

from service import queue
from service.schemas.job import Progress
from service.schemas.trend import Displacement
from testbed.homes import in_both_homes
from testbed.program import DISPLACEMENT
from testbed.stock import result


@pytest.fixture
def jobs_queue(stock):
    """That of the service, in the same database."""
    queue.migrate(stock.settings.home_database_url)
    jobs_queue = queue.Queue(stock.settings.home_database_url)
    yield jobs_queue
    jobs_queue.close()


@pytest.fixture
def counted(stock):
    """Count the transactions and statements of a step."""
    seen = Counter()
    sa.event.listen(stock.engine, "commit", lambda *_: seen.update(["transactions"]))

    @sa.event.listens_for(stock.engine, "before_cursor_execute")
    def note(_, __, statement, *___):
        # What begins a transaction is a statement on SQLite alone.
        if not statement.startswith("BEGIN"):
            seen["statements"] += 1

    @contextmanager
    def counted(transactions, statements):
        seen.clear()
        yield
        assert seen["transactions"] == transactions
        assert seen["statements"] <= statements, seen

    return counted


@in_both_homes
def test_a_job_takes_few_transactions_and_statements_from_its_submission_to_its_end(stock, jobs_queue, counted):
    # The second job of a venue: the first one leaves anchors of the cameras, which the second is compared with.
    first = stock.attempts.begin(stock.submitted("v"))
    stock.attempts.finish(first, moved(first), [], memories(first))
    submission = stock.submission("v")
    with counted(transactions=1, statements=5):
        assert stock.submissions.announce(submission, 100, timedelta(hours=1)) is None
    with counted(transactions=1, statements=13):
        stock.submissions.submit(submission, 100, jobs_queue.enqueue)
    with counted(transactions=1, statements=6):
        task = stock.attempts.begin(submission.job_id)
    with counted(transactions=1, statements=1):
        stock.attempts.check_leases([task], {}, renew=False)
    with counted(transactions=1, statements=2):
        stock.attempts.check_leases([task], {task.run_token: Progress(stage="evolution", fraction=0.5)}, renew=True)
    # However many cameras there are.
    with counted(transactions=1, statements=23):
        stock.attempts.finish(task, moved(task), [], memories(task))
    assert stock.jobs.get(submission.job_id).status == "succeeded"


def memories(task):
    return {camera.id: {"jobs": 1} for camera in task.venue.cameras}


def moved(task):
    """What a job found, with how far each camera is from its anchor."""
    found = result(task.venue, True)
    anchors = {camera: anchor.revision for camera, anchor in task.anchors.items()}
    cameras = [
        camera.model_copy(update={"displacement": Displacement(**DISPLACEMENT, anchor=anchors.get(camera.id))})
        for camera in found.cameras
    ]
    return found.model_copy(update={"cameras": cameras})
