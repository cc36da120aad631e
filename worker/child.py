"""The process that computes one job: what it is given, what it says, and how it ended.

It decodes files that strangers sent. So it gets the task and the files, and no way to the database or the store.
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
from service.wire.programs.files import files_in
from worker.message import Files, Given, Means, Message

# Twice as often as a cancellation needs to reach the child.
LOOK_S = 0.5
LONGEST_LINE = 16 * 1024 * 1024
MOST_PICTURES = 1024 * 1024 * 1024
# For a process that has closed its output.
ENDING_S = 10.0
log = structlog.get_logger()


class NoMessage(Exception):  # noqa: N818
    """What a child writes is not what a program of jobs writes."""


class Child:
    """The process; killed when the `with` block is left. `pictures`: the files that came with its result, by name."""

    def __init__(self, settings: Settings, task: Task, files: Files) -> None:
        self.pictures: dict[str, bytes] = {}
        # A file takes all of it, whether or not the program ever reads it; a pipe could fill up.
        with tempfile.TemporaryFile() as given:
            Given.of(task, Means.of(settings), files).write(given, files)
            given.seek(0)
            self._process = subprocess.Popen(
                settings.job_program,
                stdin=given,
                stdout=subprocess.PIPE,
                env=lifeline.without_secrets() | settings.native_environment,
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
        descriptor, pending, looked = self._output.fileno(), bytearray(), time.monotonic()
        last: Message | None = None
        with selectors.DefaultSelector() as selector:
            selector.register(descriptor, selectors.EVENT_READ)
            while True:
                if selector.select(LOOK_S):
                    chunk = os.read(descriptor, 65536)
                    if not chunk:
                        return
                    pending += chunk
                    while last is None and (line := _first_line(pending)):
                        message = _understood(line)
                        if message is not None and message.last:
                            last = message
                            if sum(last.pictures.values()) > MOST_PICTURES:
                                raise NoMessage(f"its program drew more than {MOST_PICTURES} bytes of pictures")
                        elif message is not None:
                            yield message
                    if last is not None and len(pending) >= sum(last.pictures.values()):
                        self.pictures = files_in(pending, last.pictures)
                        yield last
                        return
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


def _first_line(pending: bytearray) -> bytes | None:
    """Take the first line of what has come, None if it is not whole."""
    line, end, rest = pending.partition(b"\n")
    if not end:
        if len(pending) > LONGEST_LINE:
            raise NoMessage(f"its program wrote a line of more than {LONGEST_LINE} bytes")
        return None
    pending[:] = rest
    return bytes(line + end)
