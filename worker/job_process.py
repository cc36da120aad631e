"""The process of one job: starts the job program and reads its messages.

The program decodes files that strangers sent. So it gets the task and the files, and no access to database or store.
"""

import os
import selectors
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from typing import IO

import structlog
from pydantic import ValidationError

from service import child_process
from service.schemas.base import TOLERANTLY
from service.schemas.programs.files import split_files
from service.settings import Settings
from service.store.jobs.task import Task
from worker.compute_resources import ComputeResources
from worker.fork_server import ForkedProcess, ForkServer, ForkServerError
from worker.protocol import Files, JobRequest, Message

# Twice as often as a cancellation needs to reach the child.
POLL_S = 0.5
MAX_LINE_BYTES = 16 * 1024 * 1024
MAX_PICTURE_BYTES = 1024 * 1024 * 1024
# For a process that has closed its output.
EXIT_S = 10.0
# What jobs load beside their program, once they need it.
LOADED = ("numpy.ma", "onnxruntime", "worker.calibration.recovery")
log = structlog.get_logger()


class ProtocolError(Exception):
    """The output of the child process breaks the protocol of job programs."""


class JobPrograms:
    """Starts job programs: modules of this Python by fork from a process that has loaded what they need, on Linux."""

    def __init__(self, settings: Settings) -> None:
        self.resources = ComputeResources.of(settings)
        self._command = settings.job_program
        self._environment = child_process.without_secrets() | settings.native_environment
        self._server: ForkServer | None = None
        match self._command:
            case [sys.executable, *flags, "-m", module] if sys.platform == "linux":
                command = [sys.executable, *flags, "-m", "worker.fork_server", module, *LOADED]
                self._server = ForkServer(command, self._environment)

    def prepare(self) -> None:
        """Load what the first job needs before it comes."""
        if self._server is not None:
            self._server.start()

    def start(self, stdin: IO[bytes], stdout: int) -> "ForkedProcess | subprocess.Popen[bytes]":
        """Start a job program with its standard input and output."""
        if self._server is not None:
            try:
                return self._server.run(stdin.fileno(), stdout)
            except ForkServerError as error:
                log.warning("job programs start slowly", why=str(error))
        return subprocess.Popen(self._command, stdin=stdin, stdout=stdout, env=self._environment)

    def close(self) -> None:
        """End what is kept for programs to come."""
        if self._server is not None:
            self._server.close()


class JobProcess:
    """A running job program, killed when the `with` block is left. `pictures`: those of its result, by name."""

    def __init__(self, programs: JobPrograms, task: Task, files: Files) -> None:
        self.pictures: dict[str, bytes] = {}
        ours, its = os.pipe()
        self._output = os.fdopen(ours, "rb")
        try:
            # A file takes all of it, whether or not the program ever reads it; a pipe could fill up.
            with tempfile.TemporaryFile() as given:
                JobRequest.of(task, programs.resources, files).write(given, files)
                given.seek(0)
                self._process = programs.start(given, its)
        except BaseException:
            self._output.close()
            raise
        finally:
            os.close(its)

    def __enter__(self) -> "JobProcess":
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.wait()
        self._output.close()

    def messages(self) -> Iterator[Message | None]:
        """Yield the messages of the program until it ends, and None at least every `POLL_S`."""
        descriptor, pending, looked = self._output.fileno(), bytearray(), time.monotonic()
        last: Message | None = None
        with selectors.DefaultSelector() as selector:
            selector.register(descriptor, selectors.EVENT_READ)
            while True:
                if selector.select(POLL_S):
                    chunk = os.read(descriptor, 65536)
                    if not chunk:
                        return
                    pending += chunk
                    while last is None and (line := _take_line(pending)):
                        message = _parse_message(line)
                        if message is not None and message.last:
                            last = message
                            if sum(last.pictures.values()) > MAX_PICTURE_BYTES:
                                raise ProtocolError(f"its program drew more than {MAX_PICTURE_BYTES} bytes of pictures")
                        elif message is not None:
                            yield message
                    if last is not None and len(pending) >= sum(last.pictures.values()):
                        self.pictures = split_files(pending, last.pictures)
                        yield last
                        return
                if time.monotonic() - looked >= POLL_S:
                    looked = time.monotonic()
                    yield None

    def exit_reason(self) -> str:
        """Say in words why the process ended without a result, for the error of the job."""
        try:
            code = self._process.wait(EXIT_S)
        except subprocess.TimeoutExpired:
            return "Its process closed its output and went on with no result; see the worker's log."
        # Native code that gets no memory aborts.
        if code in (-signal.SIGKILL, -signal.SIGABRT):
            return "Its process was killed, most likely for lack of memory; ESC_JOB_MEMORY_MB says what one may take."
        if code < 0:
            return f"Its process died of {signal.Signals(-code).name}; see the worker's log."
        return f"Its process ended with code {code} and no result; see the worker's log."


def _parse_message(line: bytes) -> Message | None:
    try:
        return Message.model_validate_json(line, **TOLERANTLY)
    except ValidationError:
        log.warning("not understood", line=line[:500].decode(errors="replace"))
        return None


def _take_line(pending: bytearray) -> bytes | None:
    """Remove and return the first line of `pending`; None if it is not complete."""
    line, end, rest = pending.partition(b"\n")
    if not end:
        if len(pending) > MAX_LINE_BYTES:
            raise ProtocolError(f"its program wrote a line of more than {MAX_LINE_BYTES} bytes")
        return None
    pending[:] = rest
    return bytes(line + end)
