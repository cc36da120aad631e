"""Lines that commands print, and the exit codes that they end with."""

import json
import sys
from collections.abc import Iterable, Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NoReturn

from service import build

ACCEPTED, FAILED, USAGE, REJECTED, CANNOT_TELL, BUSY = 0, 1, 2, 3, 4, 75
ZIP_START = b"PK"


def print_note(line: str) -> None:
    """Print a line to standard error; standard output is for results alone."""
    print(line, file=sys.stderr)


class OngoingTrouble:
    """Print a fault when it begins and when it is over, however often it is reported in between."""

    def __init__(self) -> None:
        self._last = ""

    def say(self, fault: str) -> None:
        """Print a fault, unless it was the last one printed."""
        if fault != self._last:
            print_note(fault)
        self._last = fault

    def over(self, recovery: str) -> None:
        """Print the recovery, if there was a fault."""
        if self._last:
            print_note(recovery)
        self._last = ""


def print_rows(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Print a line for each row: in columns below their headings at a terminal, elsewhere separated by tabs."""
    if not sys.stdout.isatty():
        for row in rows:
            print(*row, sep="\t")
        return
    lines = [headings, *rows]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    for line in lines:
        print("  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip())


def write_document(document: bytes, output: Path | None) -> None:
    """Write a file of another tool's format to `output`, or to standard output."""
    if output is None:
        sys.stdout.buffer.write(document)
    else:
        output.write_bytes(document)
        if document.startswith(ZIP_START) and output.suffix != ".zip":
            print_note(f"{output} is a zip: in this format, each camera has a file of its own (--camera writes one).")


def fail(message: str, code: int) -> NoReturn:
    """Print a line to standard error and exit with `code`."""
    print_note(message)
    sys.exit(code)


def require_extra(extra: str, module: str, what: str) -> None:
    """Exit unless the module of an extra is installed, for `what` needs it."""
    if find_spec(module) is None:
        fail(f"{what} needs the extra `{extra}`: {build.install_command(extra, sys.executable)}", FAILED)


def problem_text(headline: str, members: Mapping[str, Any]) -> str:
    """Return the headline of a problem (RFC 9457) and its members `expected`, `got` and `errors`, a line each."""
    lines = [headline]
    lines += [f"  {part}: {json.dumps(members[part])}" for part in ("expected", "got") if part in members]
    findings = [str(finding.get("message")) for finding in members.get("errors", [])]
    # The first of them is often the headline's own end.
    lines += [f"  {finding}" for finding in findings if not headline.endswith(finding)]
    return "\n".join(lines)


def key_hint(status: int) -> str:
    """Return a line about keys for the statuses 401 and 403, and nothing for others."""
    match status:
        case 401:
            return "\n  Set ESC_API_KEY to a key of this service. On its machine: esc key add NAME --scope calibrate"
        case 403:
            return "\n  Set ESC_API_KEY to a key that may. On the machine of the service: esc key list"
        case _:
            return ""
