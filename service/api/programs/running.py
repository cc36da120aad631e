"""Asking a program of the worker's for something at once: what needs NumPy, and no job."""

from __future__ import annotations

import os
import subprocess
import threading
from collections.abc import Mapping, Sequence

import structlog

from service import child_process
from service.schemas.problems import Problem

log = structlog.get_logger()
# What a program ends with that cannot do what it was asked, and has said why on its standard error.
REFUSALS = {os.EX_UNAVAILABLE: "extra-missing", os.EX_DATAERR: "view-too-large"}


class OneAtATime:
    """Runs of a program, never two; whoever comes meanwhile is told to come again."""

    def __init__(self, what: str, longest_s: float, again_s: int) -> None:
        self._what, self._longest_s, self._again_s = what, longest_s, again_s
        self._turn = threading.Lock()

    def run(self, command: Sequence[str], environment: Mapping[str, str], given: bytes) -> bytes:
        """As `run_program`, in this turn."""
        if not self._turn.acquire(blocking=False):
            raise self.busy()
        try:
            return run_program(self._what, command, environment, given, self._longest_s)
        finally:
            self._turn.release()

    def busy(self) -> Problem:
        """What those are told that come meanwhile."""
        headers = {"Retry-After": str(self._again_s)}
        return Problem("unavailable", f"Another {self._what} is being made.", headers=headers)


def run_program(
    what: str, command: Sequence[str], environment: Mapping[str, str], given: bytes, longest_s: float
) -> bytes:
    """What a program writes to its standard output for what it is `given` on its input.

    One that cannot do it says why on its standard error and ends with one of `REFUSALS`.
    """
    try:
        done = subprocess.run(
            command,
            input=given,
            env={**child_process.without_secrets(), **environment},
            capture_output=True,
            timeout=longest_s,
            check=True,
        )
    except subprocess.TimeoutExpired as error:
        raise Problem("unavailable", f"The {what} was not done after {longest_s:g} s.") from error
    except subprocess.CalledProcessError as error:
        said = error.stderr.decode(errors="replace")
        if error.returncode in REFUSALS:
            raise Problem(REFUSALS[error.returncode], f"{said.strip()}.") from None
        log.error("a program failed", program=what, stderr=said[-2000:])
        raise
    return done.stdout
