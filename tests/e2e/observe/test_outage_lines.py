"""The log while a database is away."""

import json
import logging
import time
from collections import Counter
from contextlib import suppress

import pytest
import sqlalchemy as sa
import structlog

from service.observability import outage_lines
from service.observability.outage_lines import OutageLines
from testbed.homes import on_servers

pytestmark = pytest.mark.slow


@pytest.mark.long
@on_servers
def test_a_database_that_is_away_is_a_line_a_minute_for_each_thing_that_fails_and_no_traceback(start, home):
    service = start("up", ESC_AUTH="off").ready()
    service.venue("v")
    log = service.data / "log"
    before, begun = log.stat().st_size, time.monotonic()
    with home.database_away(service.data):
        # What needs the database asks for it every second or so, and callers ask in between.
        for _ in range(30):
            assert service.http.get("/venues/v").status_code == 503
            time.sleep(0.3)
    lines = [json.loads(line) for line in log.read_bytes()[before:].splitlines()]
    minutes = 1 + int((time.monotonic() - begun) // 60)
    # The same thing may fail in two ways: a connection that ends, and one that is refused.
    failures = Counter((line["event"], line["error"].partition(":")[0]) for line in lines if "error" in line)
    assert any(event == "storage unavailable" for event, _ in failures)
    assert max(failures.values()) <= minutes
    assert not [line for line in lines if "exception" in line]
    assert Counter(line["event"] for line in lines)["request"] >= 30


def test_the_next_line_says_how_many_were_left_out_and_other_errors_keep_their_tracebacks(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(outage_lines.time, "monotonic", lambda: now[0])
    lines, error = OutageLines(), sa.exc.OperationalError("SELECT 1", {}, Exception("connection refused"))

    def said(event, error):
        with suppress(structlog.DropEvent):
            return lines.structured(None, "", {"event": event, "exc_info": error})

    assert said("away", error)["error"] == "OperationalError: (builtins.Exception) connection refused"
    assert [said("away", error) for _ in range(5)] == [None] * 5
    assert "left_out" not in said("put off", error)
    now[0] += 61
    assert said("away", error)["left_out"] == 5
    mistake = ValueError("a mistake")
    assert [said("away", mistake) for _ in range(2)] == [{"event": "away", "exc_info": mistake}] * 2


def test_what_other_libraries_log_of_it_is_thinned_too():
    lines, error = OutageLines(), sa.exc.OperationalError("SELECT 1", {}, Exception("connection refused"))
    records = [
        logging.LogRecord("dbos", logging.WARNING, "", 0, "no answer to %s", (number,), (type(error), error, None))
        for number in range(3)
    ]
    assert [lines.filter(record) for record in records] == [True, False, False]
    assert (
        records[0].getMessage() == "no answer to 0 (error: OperationalError: (builtins.Exception) connection refused)"
    )
    assert records[0].exc_info is None
