"""What real processes ask of PostgreSQL, by its own log: while there is nothing to do, and for a job."""

import time

import pytest
import sqlalchemy as sa

from testbed.homes import on_servers

IDLE_S = 5
# A worker looks into the queue twice a second, and its duties look every other second.
IDLE_PER_S = 4
A_JOB_S = 2
# From the request to the end, and what the worker asks while it computes.
PER_JOB = 20


@pytest.mark.long
@on_servers
def test_an_idle_service_asks_little_of_its_database_and_a_job_not_much(start, home, postgres, tmp_path):
    url = sa.make_url(home.database_url(tmp_path / "esc"))
    postgres.log_statements_of(url.database)
    service = start().ready()
    service.venue("v", f"accept {A_JOB_S}")
    time.sleep(1)
    before, begun = postgres.transactions(), time.monotonic()
    time.sleep(IDLE_S)
    after = postgres.transactions()
    assert after - before <= IDLE_PER_S * (time.monotonic() - begun)

    before, begun = after, time.monotonic()
    job = service.submitted("v")
    time.sleep(A_JOB_S)
    assert service.end(job)["status"] == "succeeded"
    assert postgres.transactions() - before <= PER_JOB + IDLE_PER_S * (time.monotonic() - begun)
