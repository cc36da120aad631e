"""Disks that are full: real ones, small, in memory."""

import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def may_mount() -> bool:
    """Whether this process may make a disk; within a container root often may not."""
    return os.geteuid() == 0 and subprocess.run(["unshare", "--mount", "true"], capture_output=True).returncode == 0


@contextmanager
def small_disk(folder: Path, megabytes: int) -> Iterator[Path]:
    """A disk of its own, gone with everything on it at the end."""
    folder.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={megabytes}m", "tmpfs", folder], check=True)
    try:
        yield folder
    finally:
        # Lazily: processes that were killed a moment ago may still hold files.
        subprocess.run(["umount", "--lazy", folder], check=True)


@contextmanager
def filled(disk: Path, leave_bytes: int = 0) -> Iterator[None]:
    """No more than so many bytes can be written."""
    filling = disk / "filling"
    found = os.statvfs(disk)
    with filling.open("wb") as file:
        os.posix_fallocate(file.fileno(), 0, found.f_bavail * found.f_frsize - leave_bytes)
    try:
        yield
    finally:
        filling.unlink()
