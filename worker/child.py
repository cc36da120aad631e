"""The process that computes one job: what it is given, what it says, and how it ended.

It decodes files that strangers sent. So it gets the task and the way to the files, and no database.
"""

from __future__ import annotations

import os
import selectors
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator
from typing import IO

import structlog
from pydantic import ValidationError

from service import lifeline
from service.settings import Settings
from service.store.jobs.task import Task
from worker.message import Message

# Twice as often as a cancellation needs to reach the child.
LOOK_S = 0.5
LONGEST_LINE = 16 * 1024 * 1024
# For a process that has closed its output.
ENDING_S = 10.0
# The way to a bucket, which is in the environment alone.
TO_THE_BUCKET = ("AWS_", "HTTP_PROXY", "HTTPS_PROXY", "ALL_PROXY", "NO_PROXY")
log = structlog.get_logger()


class NoMessage(Exception):  # noqa: N818
    """What a child writes is not what a program of jobs writes."""


class Child:
    """The process; killed when the `with` block is left."""

    def __init__(self, settings: Settings, task: Task) -> None:
        # A file takes the task whole, whether or not the program ever reads it; a pipe could fill up.
        with tempfile.TemporaryFile() as given:
            given.write(task.without_addresses().model_dump_json().encode())
            given.seek(0)
            self._process = subprocess.Popen(
                settings.job_program,
                stdin=given,
                stdout=subprocess.PIPE,
                env=lifeline.without_secrets(*TO_THE_BUCKET) | _as_environment(settings) | settings.native_environment,
            )
        assert self._process.stdout is not None
        self._output: IO[bytes] = self._process.stdout

    def __enter__(self) -> Child:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()
        self._output.close()

    def messages(self) -> Iterator[Message | None]:
        """What the child says until it ends, and None at least every `LOOK_S`."""
        descriptor, pending, looked = self._output.fileno(), b"", time.monotonic()
        with selectors.DefaultSelector() as selector:
            selector.register(descriptor, selectors.EVENT_READ)
            while True:
                if selector.select(LOOK_S):
                    chunk = os.read(descriptor, 65536)
                    if not chunk:
                        return
                    *lines, pending = (pending + chunk).split(b"\n")
                    if len(pending) > LONGEST_LINE:
                        raise NoMessage(f"its program wrote a line of more than {LONGEST_LINE} bytes")
                    yield from (message for line in lines if (message := _understood(line)))
                if time.monotonic() - looked >= LOOK_S:
                    looked = time.monotonic()
                    yield None

    def how_it_ended(self) -> str:
        """For the job's error, after the output has ended."""
        try:
            code = self._process.wait(ENDING_S)
        except subprocess.TimeoutExpired:
            return "Its process closed its output and went on with no result; see the worker's log."
        if code == -signal.SIGKILL:
            return "Its process was killed, most likely for lack of memory."
        if code < 0:
            return f"Its process died of {signal.Signals(-code).name}; see the worker's log."
        return f"Its process ended with code {code} and no result; see the worker's log."


def _understood(line: bytes) -> Message | None:
    try:
        return Message.model_validate_json(line)
    except ValidationError:
        log.warning("not understood", line=line[:500].decode(errors="replace"))
        return None


def _as_environment(settings: Settings) -> dict[str, str]:
    """What the child needs to compute and to find the same files, however this process was configured."""
    return {
        "ESC_DATA": str(settings.data.absolute()),
        "ESC_BLOB_URL": settings.home_blob_url,
        "ESC_MODEL": str(settings.model.absolute()),
        "ESC_PROVIDER": settings.provider,
        "ESC_THREADS": str(settings.threads),
        "ESC_LOG_FORMAT": settings.log_format,
        "ESC_LOG_LEVEL": settings.log_level,
    }
