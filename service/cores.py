"""How many cores this process may use: those of the machine, less what others keep it from.

A container that may use two of 64 cores and starts 64 threads has each of them stopped for most of its time.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

MINE, GROUPS = Path("/proc/self/cgroup"), Path("/sys/fs/cgroup")


def usable_cores(mine: Path = MINE, groups: Path = GROUPS) -> int:
    """Whole cores, at least one: by affinity, and by the quotas of the control groups that the process is in."""
    try:
        cores = len(os.sched_getaffinity(0))
    except AttributeError:  # not Linux
        cores = os.cpu_count() or 1
    return max(1, int(min([cores, *_quotas(mine, groups)])))


def _quotas(mine: Path, groups: Path) -> Iterator[float]:
    """In cores, of the group and of all above it."""
    for line in _read(mine).splitlines():
        _, controllers, path = line.split(":", 2)
        for group in (PurePosixPath(path), *PurePosixPath(path).parents):
            if not controllers:
                yield from _quota(*_read(groups / str(group).lstrip("/") / "cpu.max").split())
            elif "cpu" in controllers.split(","):
                folder = groups / "cpu" / str(group).lstrip("/")
                yield from _quota(
                    _read(folder / "cpu.cfs_quota_us").strip(), _read(folder / "cpu.cfs_period_us").strip()
                )


def _quota(allowed: str = "", period: str = "") -> Iterator[float]:
    # `max`, or -1 in version 1: as much as there is.
    if allowed.isdecimal() and period.isdecimal() and int(period):
        yield int(allowed) / int(period)


def _read(file: Path) -> str:
    try:
        return file.read_text()
    except OSError:
        return ""
