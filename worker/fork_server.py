"""Starts a program by fork from a process that has imported what it needs.

No run waits for imports, or pays for them. The server sees no request: each run reads its own standard input. A run is
a child of the process that started it, as one of `subprocess.Popen` is: the server forks twice, and that process is the
nearest subreaper (prctl(2)) of what the first fork leaves behind. Linux only.

`python -m worker.fork_server PROGRAM MODULE...` is the server of a module `PROGRAM`; it imports the others, too.
"""

import contextlib
import ctypes
import gc
import importlib
import os
import runpy
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence

PR_SET_CHILD_SUBREAPER = 36
# For the imports, on a busy machine with a slow disk.
ANSWER_S = 60.0
POLL_S = 0.01
LONGEST_REQUEST = 1 << 20


class ForkServerError(Exception):
    """Raised when a fork server does not start a run, even after it was started anew."""


class ForkServer:
    """A fork server as seen by the process that starts runs; it ends with that process, and is replaced if it dies.

    `command` starts `python -m worker.fork_server` with its arguments, `environment` is that of all runs.
    """

    def __init__(self, command: Sequence[str], environment: Mapping[str, str]) -> None:
        self._command, self._environment = command, environment
        self._lock = threading.Lock()
        self._socket: socket.socket | None = None

    def start(self) -> None:
        """Start the server, which imports while its first run has not been asked for."""
        with self._lock:
            self._connect()

    def run(self, stdin: int, stdout: int) -> "ForkedProcess":
        """Start a run with these files as its standard input and output; raises `ForkServerError`."""
        with self._lock:
            for _ in range(2):
                with contextlib.suppress(OSError):
                    return ForkedProcess(fork_by(self._connect(), b"run", [stdin, stdout]))
                self._end()
        raise ForkServerError(f"no process could be forked from {' '.join(self._command)}; see the log")

    def _connect(self) -> socket.socket:
        if self._socket is None:
            adopt_orphans()
            self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            self._socket.settimeout(ANSWER_S)
            with theirs:
                # It ends when this end of the socket is closed, and is a child to be waited for until then.
                self._process = subprocess.Popen(
                    self._command, stdin=theirs.fileno(), stdout=subprocess.DEVNULL, env=self._environment
                )
        return self._socket

    def close(self) -> None:
        """End the server; runs go on."""
        with self._lock:
            self._end()

    def _end(self) -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket = None
            self._process.kill()
            self._process.wait()


class ForkedProcess:
    """A run, as `subprocess.Popen` has it: its `pid`, to be waited for once."""

    def __init__(self, pid: int) -> None:
        self.pid = pid
        self._code: int | None = None

    def kill(self) -> None:
        """Send SIGKILL, unless it has been waited for."""
        if self._code is None:
            os.kill(self.pid, signal.SIGKILL)

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its end, return its exit code or the negative number of its signal; raises `TimeoutExpired`."""
        until = None if timeout is None else time.monotonic() + timeout
        while self._code is None:
            ended, status = os.waitpid(self.pid, 0 if until is None else os.WNOHANG)
            if ended:
                self._code = os.waitstatus_to_exitcode(status)
            elif until is not None and time.monotonic() >= until:
                raise subprocess.TimeoutExpired(str(self.pid), timeout or 0.0)
            else:
                time.sleep(POLL_S)
        return self._code


def main(program: str, *modules: str) -> None:
    """Import, then fork for each request; run the program in what was forked."""
    # A terminal sends it to all of its processes: this one ends with the one that started it.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for module in (program, *modules):
        importlib.import_module(module)
    if len(os.listdir("/proc/self/task")) > 1:  # noqa: PTH208  (no path is needed)
        raise RuntimeError(f"{program} started threads, which a fork would lack")
    # What is shared stays shared: the collector of a run does not write to it.
    gc.collect()
    gc.freeze()
    serve(socket.socket(fileno=0))
    signal.signal(signal.SIGINT, signal.default_int_handler)
    sys.argv[:] = [program]
    sys.modules.pop(program, None)
    runpy.run_module(program, run_name="__main__", alter_sys=True)


def adopt_orphans() -> None:
    """Make this process the parent of what its descendants leave behind."""
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def fork_by(server: socket.socket, request: bytes, files: Sequence[int]) -> int:
    """Have a server fork a child of this process; return its id. Raises `OSError` where the server has ended.

    `files` are its first ones, standard input, output and error; what is missing it has of the server.
    """
    socket.send_fds(server, [request], files)
    answer = server.recv(LONGEST_REQUEST)
    if not answer:
        raise BrokenPipeError("the fork server has ended")
    return int(answer)


def serve(requests: socket.socket) -> bytes:
    """Fork for each request; return the request in what was forked, which has the files of the request."""
    starter = os.getppid()
    while True:
        request, files, _, _ = socket.recv_fds(requests, LONGEST_REQUEST, 3)
        if not request:
            os._exit(0)
        first = os.fork()
        if first:
            for file in files:
                os.close(file)
            os.waitpid(first, 0)
            continue
        first = os.getpid()
        if os.fork():
            os._exit(0)
        # Only its parent can wait for it.
        while (parent := os.getppid()) == first:
            time.sleep(0.001)
        if parent != starter:
            os._exit(1)
        requests.send(str(os.getpid()).encode())
        requests.close()
        for number, file in enumerate(files):
            os.dup2(file, number)
            os.close(file)
        return request


if __name__ == "__main__":
    main(*sys.argv[1:])
