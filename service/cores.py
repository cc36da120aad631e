"""Number of cores by affinity and control groups.

A container that may use two of 64 cores and starts 64 threads has each of them throttled most of the time.
"""

import os
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

MINE, GROUPS = Path("/proc/self/cgroup"), Path("/sys/fs/cgroup")


def usable_cores(mine: Path = MINE, groups: Path = GROUPS) -> int:
    """Return the number of whole usable cores, at least one."""
    try:
        cores = len(os.sched_getaffinity(0))
    except AttributeError:  # not Linux
        cores = os.cpu_count() or 1
    return max(1, int(min([cores, *_quotas(mine, groups)])))


def _quotas(mine: Path, groups: Path) -> Iterator[float]:
    """Yield the quotas of the process's control groups and of their parents, in cores."""
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
    # `max`, or -1 in version 1, is no limit.
    if allowed.isdecimal() and period.isdecimal() and int(period):
        yield int(allowed) / int(period)


def _read(file: Path) -> str:
    try:
        return file.read_text()
    except OSError:
        return ""
