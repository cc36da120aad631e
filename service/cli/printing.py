"""What commands print: lines and progress, and what went wrong, as lines with an exit code."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    from service.client import Client
    from service.schemas.job import Job
    from service.schemas.job import Progress as Step

ACCEPTED, FAILED, USAGE, REJECTED, BUSY = 0, 1, 2, 3, 75
ZIP_START = b"PK"


def print_note(line: str) -> None:
    """Print a line for whoever looks; results alone go to standard output."""
    print(line, file=sys.stderr)


class OngoingTrouble:
    """Prints what goes wrong when it begins and when it is over, however often it is said in between."""

    def __init__(self) -> None:
        self._said = ""

    def say(self, words: str) -> None:
        """Print it, unless it was the last thing said."""
        if words != self._said:
            print_note(words)
        self._said = words

    def over(self, words: str) -> None:
        """Print that it is over, if anything was wrong."""
        if self._said:
            print_note(words)
        self._said = ""


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
    """Write a file of another tool's format to where it is wanted."""
    if output is None:
        sys.stdout.buffer.write(document)
    else:
        output.write_bytes(document)
        if document.startswith(ZIP_START) and output.suffix != ".zip":
            print_note(f"{output} is a zip: in this format, each camera has a file of its own (--camera writes one).")


def fail(message: str, code: int) -> NoReturn:
    """End with a line on standard error."""
    print_note(message)
    sys.exit(code)


def problem_text(headline: str, members: Mapping[str, Any]) -> str:
    """A problem with the parts of it that say what is wrong."""
    lines = [headline]
    lines += [f"  {part}: {json.dumps(members[part])}" for part in ("expected", "got") if part in members]
    findings = [str(finding.get("message")) for finding in members.get("errors", [])]
    # The first of them is often the headline's own end.
    lines += [f"  {finding}" for finding in findings if not headline.endswith(finding)]
    return "\n".join(lines)


def key_hint(status: int) -> str:
    """What to do about an answer that is the same whatever was asked."""
    match status:
        case 401:
            return "\n  Set ESC_API_KEY to a key of this service. On its machine: esc key add NAME --scope calibrate"
        case 403:
            return "\n  Set ESC_API_KEY to a key that may. On the machine of the service: esc key list"
        case _:
            return ""


# How far a job is


def follow_to_end(client: Client, job: Job) -> Job:
    """A job at its end; how far it is, is shown meanwhile."""
    with job_progress_bar() as show:
        return client.follow(job, lambda job: show(job.progress, _queue_text(job)))


@contextmanager
def job_progress_bar() -> Iterator[Callable[[Step | None, str], None]]:
    """A line that shows how far a calibration is, where somebody looks at the terminal."""
    with progress_bar() as show:
        yield lambda step, otherwise: show(*((step.stage, step.fraction) if step else (otherwise, 0.0)))


@contextmanager
def progress_bar() -> Iterator[Callable[[str, float], None]]:
    """A line that shows what is done and which part of it is, where somebody looks at the terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True, soft_wrap=True, highlight=False, markup=False)
    columns = (TextColumn("{task.description:<14}"), BarColumn(), TextColumn("{task.percentage:3.0f} %"))
    with Progress(*columns, TimeElapsedColumn(), console=console, disable=not console.is_terminal) as shown:
        line = shown.add_task("waiting", total=1.0)
        yield lambda name, part: shown.update(line, completed=part, description=name)


def _queue_text(job: Job) -> str:
    return f"queued, {job.queue_position}." if job.queue_position else "starting"
