"""Disks that are full: real ones, small, in memory."""

import errno
import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def may_mount() -> bool:
    """True if this process may mount a disk; within a container root often may not."""
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


def _filled(disk: Path, file: int, leave_bytes: int) -> bool:
    """Make a file so long that no more than so many bytes are left; False: others wrote meanwhile."""
    found = os.statvfs(disk)
    try:
        os.posix_fallocate(file, 0, found.f_bavail * found.f_frsize - leave_bytes)
    except OSError as error:
        if error.errno != errno.ENOSPC:
            raise
        os.ftruncate(file, 0)
        return False
    return True


@contextmanager
def filled(disk: Path, leave_bytes: int = 0) -> Iterator[None]:
    """No more than so many bytes can be written."""
    filling = disk / "filling"
    with filling.open("wb") as file:
        while not _filled(disk, file.fileno(), leave_bytes):
            pass
    try:
        yield
    finally:
        filling.unlink()
