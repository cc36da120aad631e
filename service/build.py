"""What this program was built from: its version, and the commit of a build that was made in a clone."""

from __future__ import annotations

import subprocess
from functools import cache
from importlib import metadata
from pathlib import Path

HERE = Path(__file__).parent
# `setup.py` writes it into a wheel.
COMMIT = HERE / "commit.txt"


def version() -> str:
    """The version of the release."""
    return metadata.version("esc-calibration")


@cache
def commit() -> str | None:
    """The commit, of a wheel that it was built from, or of the clone that this runs in; None: nobody knows."""
    if COMMIT.is_file():
        return COMMIT.read_text().strip() or None
    if not (HERE.parent / ".git").exists():
        return None
    asked = ["git", "-C", str(HERE), "rev-parse", "HEAD"]
    try:
        return subprocess.run(asked, capture_output=True, text=True, check=True, timeout=5).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return None


def description() -> str:
    """Both, for people: `0.2.0 (commit 76a150ef32b1)`."""
    known = commit()
    return version() if known is None else f"{version()} (commit {known[:12]})"
