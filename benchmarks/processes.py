"""Memory and processor time of running processes, from /proc; proc(5)."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

TICKS_PER_S = os.sysconf("SC_CLK_TCK")


def resident_mb(process: int) -> float:
    """Return the memory that a process has now."""
    return _status_mb(process, "VmRSS")


def peak_mb(process: int) -> float:
    """Return the most memory that a process has had."""
    return _status_mb(process, "VmHWM")


def core_s(process: int, *, children: bool = False) -> float:
    """Return user and system time of all threads; `children`: and of the processes that it has waited for."""
    fields = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
    return sum(map(int, fields[11 : 15 if children else 13])) / TICKS_PER_S


@dataclass
class Cost:
    """Core-seconds of a process and all that it starts, and the most memory that one which it started has had."""

    core_s: float = 0.0
    peak_mb: float = 0.0


SAMPLE_S = 0.02


@contextmanager
def measured(process: int) -> Iterator[Cost]:
    """Measure what a process and its descendants spend in the `with` block, and until those that began in it end."""
    cost, before = Cost(), tree(process)
    ended = threading.Event()

    def watch() -> None:
        while (begun := set(tree(process)) - set(before)) or not ended.is_set():
            for one in begun:
                with suppress(OSError, IndexError):
                    cost.peak_mb = max(cost.peak_mb, peak_mb(one))
            time.sleep(SAMPLE_S)

    watching = threading.Thread(target=watch)
    spent = sum(core_s(one, children=True) for one in before)
    watching.start()
    try:
        yield cost
    finally:
        ended.set()
        watching.join()
    cost.core_s = sum(core_s(one, children=True) for one in before) - spent


def tree(process: int) -> list[int]:
    """Return a process and its descendants."""
    parents = {}
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            parents[int(folder.name)] = int((folder / "stat").read_text().rpartition(")")[2].split()[1])
    found = [process]
    for one in found:
        found += [child for child, parent in parents.items() if parent == one]
    return found


def _status_mb(process: int, name: str) -> float:
    status = Path(f"/proc/{process}/status").read_text()
    return int(status.partition(f"{name}:")[2].split()[0]) / 1000
