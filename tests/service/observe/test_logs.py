import subprocess
import sys
from pathlib import Path

SPEAK = """
import logging, structlog
from service.observe import logs
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
