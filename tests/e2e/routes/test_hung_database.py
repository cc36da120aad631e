"""A database that hangs, or was restarted: what callers see of it, and for how long."""

import time
from concurrent.futures import ThreadPoolExecutor

import httpx
import pytest
import sqlalchemy as sa

from service.api.context import STREAM_PATIENCE_S
from service.store.database import connect, migrate, without_timeouts
from testbed.homes import on_servers
from tests.e2e.routes.event_stream import followed

# More than there are threads and connections.
CALLERS = 60
# A test machine is busy.
BUSY_S = 5
READY_S = 3 + BUSY_S
# For a thread, for a connection and for the lock that somebody else has.
LONGEST_S = 3 * 5 + BUSY_S


def asked(service, path):
    """Status, problem and seconds of an answer."""
    begun = time.monotonic()
    # A client of one's own: a shared one has a limit of connections.
    answer = httpx.get(service.url + path, timeout=120)
    return answer, time.monotonic() - begun


@on_servers
def test_a_locked_table_is_told_within_seconds_and_readiness_at_once(start, home):
    service = start("serve", ESC_AUTH="off")
    service.venue("v")
    with ThreadPoolExecutor(CALLERS) as callers, home.table_locked(service.data, "venues, jobs"):
        waiting = [callers.submit(asked, service, "/venues/v") for _ in range(CALLERS)]
        time.sleep(0.5)
        for path, status in (("/livez", 200), ("/readyz", 503), ("/readyz", 503)):
            answer, seconds = asked(service, path)
            assert (answer.status_code, seconds < READY_S) == (status, True)
        assert answer.json()["parts"]["database"] == "gave no answer within 2 s"
        answers = [waited.result() for waited in waiting]
    assert {answer.status_code for answer, _ in answers} == {503}
    assert {answer.headers["retry-after"] for answer, _ in answers} == {"5"}
    assert {answer.json()["detail"] for answer, _ in answers} <= {
        "What the request needs is locked in its database by another transaction.",
        "All connections to its database are busy.",
    }
    assert max(seconds for _, seconds in answers) < LONGEST_S
    assert asked(service, "/venues/v")[0].status_code == 200


@on_servers
def test_who_follows_a_venue_hears_within_seconds_that_the_database_is_away(start, home):
    service = start("serve", ESC_AUTH="off")
    service.venue("v")
    with followed(service, "v") as stream:
        stream.next()
        with home.database_away(service.data):
            begun = time.monotonic()
            with pytest.raises((EOFError, httpx.RemoteProtocolError)):
                stream.next()
            assert time.monotonic() - begun < STREAM_PATIENCE_S + 2 * BUSY_S
            assert asked(service, "/venues/v/events")[0].status_code == 503


@pytest.mark.long
@on_servers
def test_a_restarted_database_costs_no_request_that_comes_after_it(start, home):
    service = start("serve", ESC_AUTH="off")
    service.venue("v")
    with ThreadPoolExecutor(8) as callers:
        list(callers.map(lambda _: asked(service, "/venues/v"), range(40)))
        home.kill_database()
        answers = list(callers.map(lambda _: asked(service, "/venues/v")[0], range(40)))
    assert {answer.status_code for answer in answers} == {200}
    assert asked(service, "/readyz")[0].json()["parts"]["database"] == "ok"


@on_servers
def test_no_statement_of_a_request_is_preceded_by_another_that_tries_the_connection(home, tmp_path):
    engine = connect(home.database_url(tmp_path))
    migrate(engine)
    with engine.connect() as watching:
        committed = sa.text("SELECT xact_commit FROM pg_stat_database WHERE datname = current_database()")

        def count():
            watching.execute(sa.text("SELECT pg_stat_force_next_flush()"))
            watching.rollback()
            return watching.scalar(committed)

        other, before = connect(home.database_url(tmp_path)), count()
        for _ in range(20):
            with other.connect() as connection, connection.begin():
                connection.execute(sa.text("SELECT 1"))
        other.dispose()
        assert count() - before < 30
    engine.dispose()


@on_servers
def test_what_nobody_waits_for_may_take_longer_than_a_request(home, tmp_path):
    engine = connect(home.database_url(tmp_path))
    limit = sa.text("SELECT current_setting('statement_timeout'), current_setting('lock_timeout')")
    with engine.connect() as connection:
        assert connection.execute(limit).one() == ("15s", "5s")
    with without_timeouts(engine).connect() as connection:
        assert connection.execute(limit).one() == ("10min", "10min")
    # The same connection once more, for a request.
    with engine.connect() as connection:
        assert connection.execute(limit).one() == ("15s", "5s")
    engine.dispose()


@on_servers
@pytest.mark.parametrize("options", ["-c statement_timeout=7s"])
def test_an_operator_sets_other_limits_in_the_url(home, tmp_path, options):
    url = sa.make_url(home.database_url(tmp_path)).update_query_dict({"options": options})
    engine = connect(url.render_as_string(hide_password=False))
    with engine.connect() as connection:
        assert connection.scalar(sa.text("SHOW statement_timeout")) == "7s"
        assert connection.scalar(sa.text("SHOW idle_in_transaction_session_timeout")) == "1min"
    engine.dispose()
