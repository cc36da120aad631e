"""What real processes ask of PostgreSQL, as it counts itself: while there is nothing to do, and for a job."""

import time

import psycopg

from tests.homes import on_servers

IDLE_S = 10
A_JOB_S = 3
# What a session has done is in the statistics after a second.
STATISTICS_S = 1.5
# Of `esc up`: a worker looks into the queue twice a second, and its duties now and then.
IDLE_PER_S = 5
# From the request to the end, with what the worker asks while it computes for so long.
PER_JOB = 20


def transactions(service):
    """How many there have been, without this one and those that have just ended."""
    with psycopg.connect(service.database_url) as connection:
        query = "SELECT xact_commit + xact_rollback FROM pg_stat_database WHERE datname = current_database()"
        return connection.execute(query).fetchone()[0]


@on_servers
def test_an_idle_service_asks_little_of_its_database_and_a_job_not_much(start):
    service = start().ready()
    service.venue("v", f"accept {A_JOB_S}")
    time.sleep(STATISTICS_S)
    before, begun = transactions(service), time.monotonic()
    time.sleep(IDLE_S)
    after = transactions(service)
    assert after - before <= IDLE_PER_S * (time.monotonic() - begun)

    before, begun = after, time.monotonic()
    job = service.submitted("v")
    time.sleep(A_JOB_S)
    assert service.end(job)["status"] == "succeeded"
    time.sleep(STATISTICS_S)
    after = transactions(service)
    assert after - before <= PER_JOB + IDLE_PER_S * (time.monotonic() - begun)
