"""The program that computes a job looks for the secrets of those that started it."""

import json
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

from testbed.running import Service
from tests.unprivileged import drop_capabilities

SECRET = "whsec_" + "c2VjcmV0" * 6
SPY = """
import json, os, re, sys
sys.stdin.buffer.readline()
def tried(path):
    try:
        with open(path, "rb") as file:
            if path.endswith("environ"):
                return str(b"whsec_" in file.read())
            file.seek(int(re.search(r"(\\w+)-.*\\[stack\\]", open("/proc/%d/maps" % os.getppid()).read())[1], 16))
            return "read " + str(len(file.read(8)))
    except OSError as error:
        return type(error).__name__
worker = os.getppid()
api = open(f"/proc/{worker}/stat").read().rpartition(")")[2].split()[1]
found = [tried(f"/proc/{process}/{what}") for process in (worker, api) for what in ("environ", "mem")]
print(json.dumps({"error": {"type": "", "title": "", "detail": " ".join(found)}}))
"""


@pytest.fixture
def without_privileges():
    """Start services that may do what their user may, and nothing else."""
    # It lives as long as what it starts, which ends with it.
    with ThreadPoolExecutor(1, initializer=drop_capabilities) as thread:
        yield lambda *arguments, **settings: thread.submit(Service, *arguments, **settings).result()


def test_a_job_program_reads_neither_environment_nor_memory_of_worker_and_api(without_privileges, tmp_path):
    program = json.dumps([sys.executable, "-c", SPY])
    service = without_privileges(tmp_path / "esc", cold=True, ESC_JOB_PROGRAM=program, ESC_WEBHOOK_SECRET=SECRET)
    try:
        service.venue("spied")
        job = service.calibrated("spied")
        assert job["error"]["detail"] == " ".join(["PermissionError"] * 4)
        # What the service reads of itself is there still.
        assert "process_open_fds" in service.http.get("/metrics").text
    finally:
        assert service.stop() == 0
