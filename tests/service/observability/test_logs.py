"""Log lines: they may be lost, and contain no secrets."""

import subprocess
import sys
from pathlib import Path

import pytest

SPEAK = """
import logging, structlog
from service.observability import logs
from service.settings import Settings
logs.configure(Settings())
for _ in range(1000):
    structlog.get_logger().info("request", path="/livez")
    logging.getLogger("dbos").warning("slow")
print("still there")
"""


def test_what_is_logged_may_be_lost_but_stops_nobody():
    with Path("/dev/full").open("wb") as full:
        said = subprocess.run([sys.executable, "-c", SPEAK], stdout=subprocess.PIPE, stderr=full, timeout=60)
    assert said.stdout == b"still there\n"


FAIL = """
import structlog
from service.observability import logs
from service.settings import Settings
logs.configure(Settings(log_format="{}"))
def connect(database_url):
    raise OSError("unreachable")
try:
    connect("postgresql://esc:" + "hun" + "ter2@db/esc")
except OSError:
    structlog.get_logger().exception("request failed")
"""


@pytest.mark.parametrize("form", ["json", "console"])
def test_an_exception_is_logged_with_where_it_was_raised_and_nothing_of_what_was_at_hand(form):
    said = subprocess.run([sys.executable, "-c", FAIL.format(form)], capture_output=True, text=True, timeout=60).stderr
    assert "OSError: unreachable" in said
    assert "in connect" in said
    assert "hunter2" not in said
