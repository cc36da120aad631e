"""Jobs that a newer version submitted, with something in them that the workers of this one do not know."""

import pytest
import sqlalchemy as sa

from service.store import tables
from testbed.homes import in_one_home_first
from testbed.parameters import try_first
from testbed.running import wait_for
from tests.e2e.observe.figures import families
from tests.problems import problem_of

j = tables.jobs.c


def changed(service, job_id, **values):
    with service.database() as connection:
        connection.execute(sa.update(tables.jobs).where(j.id == job_id).values(**values))


def options_of(service, job_id):
    with service.database() as connection:
        return connection.execute(sa.select(j.options).where(j.id == job_id)).scalar_one()


def two_rounds_pass(service):
    """Wait until the worker has looked after all jobs once more, from its beginning to its end."""
    for _ in range(2):
        last = heartbeat(service)
        wait_for(lambda last=last: heartbeat(service) > last)


def heartbeat(service):
    with service.database() as connection:
        return connection.execute(sa.select(sa.func.max(tables.workers.c.seen_at))).scalar_one()


def log_of(service):
    return (service.data / "log").read_text()


def unreadable(service):
    return sum(sample.value for sample in families(service)["esc_worker_unreadable_jobs"].samples)


@in_one_home_first
def test_a_job_with_options_of_a_newer_version_waits_for_a_worker_of_that_version(start, worker_beside):
    service = start("serve")
    newer, plain = (service.submitted(service.venue(name)) for name in ("newer", "plain"))
    asked = options_of(service, newer)
    changed(service, newer, options=asked | {"zoom": "fit"})
    worker = worker_beside(service, "first")
    # The others go on.
    assert service.end(plain)["status"] == "succeeded"
    wait_for(lambda: unreadable(service) == 1)
    two_rounds_pass(service)
    assert (service.job(newer)["status"], service.job(newer)["attempt"]) == ("queued", 0)
    # It is told of once, however often it is met.
    assert log_of(service).count("job left to a worker of a newer version") == 1
    assert "zoom" in log_of(service)
    assert worker.poll() is None
    # A worker that can read it, which is what another one is once the option is gone, takes it.
    changed(service, newer, options=asked)
    worker_beside(service, "second")
    end = service.end(newer)
    assert (end["status"], end["attempt"]) == ("succeeded", 1)
    assert service.calibrated("newer", shade=1)["status"] == "succeeded"
    wait_for(lambda: unreadable(service) == 0)


def test_a_job_that_no_worker_can_read_can_be_cancelled_and_its_frames_are_not_submitted_again_otherwise(start):
    service = start("serve")
    job = service.submitted(service.venue("newer"))
    changed(service, job, options=options_of(service, job) | {"zoom": "fit"}, kind="zooming")
    assert service.job(job)["kind"] == "zooming"
    assert service.http.post(f"/jobs/{job}/cancel").json()["status"] == "cancelled"
    changed(service, job, kind="calibration")
    answer = service.http.post(f"/jobs/{job}/again")
    assert problem_of(answer) == (409, "job-of-newer-version")
    assert "zoom" in answer.json()["detail"]


def test_a_job_that_a_worker_broke_off_before_it_began_is_put_back(start, worker_beside):
    """As one of 0.1.0 does with a job that it cannot read."""
    service = start("serve")
    broken = service.submitted(service.venue("broken"))
    with service.database() as connection:
        connection.exec_driver_sql("UPDATE workflow_status SET status = 'ERROR'")
    worker_beside(service, "worker")
    end = service.end(broken)
    assert (end["status"], end["attempt"]) == ("succeeded", 1)


@pytest.mark.parametrize("given_up", try_first(["MAX_RECOVERY_ATTEMPTS_EXCEEDED", "CANCELLED"]))
def test_one_job_whose_rows_are_broken_does_not_keep_another_from_its_end(start, worker_beside, given_up):
    service = start("serve")
    first, second, of_broken_venue = (service.submitted(service.venue(name)) for name in ("first", "second", "third"))
    changed(service, first, options={"dry_run": "perhaps"})
    with service.database() as connection:
        broken = sa.update(tables.venues).where(tables.venues.c.id == "third")
        connection.execute(broken.values(document={"no": "venue"}))
        connection.exec_driver_sql(f"UPDATE workflow_status SET status = '{given_up}'")
    worker_beside(service, "worker")
    for job in (second, of_broken_venue):
        assert service.end(job)["error"]["type"] == "/problems/job-abandoned"
    assert service.job(first)["status"] == "queued"
    two_rounds_pass(service)
    assert log_of(service).count("cannot end or begin a job that the queue has given up") == 1
