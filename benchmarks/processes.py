"""Memory and processor time of running processes, from /proc; proc(5)."""

from __future__ import annotations

import os
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


def _status_mb(process: int, name: str) -> float:
    status = Path(f"/proc/{process}/status").read_text()
    return int(status.partition(f"{name}:")[2].split()[0]) / 1000
