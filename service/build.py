"""Version and commit of this program, and commands that install its extras."""

import shlex
import subprocess
from functools import cache
from importlib import metadata
from pathlib import Path

PACKAGE = "esc-calibration"
HERE = Path(__file__).parent
# `setup.py` writes it into a wheel.
COMMIT = HERE / "commit.txt"


def version() -> str:
    """Return the version of the release."""
    return metadata.version(PACKAGE)


@cache
def commit() -> str | None:
    """Return the commit that the wheel was built from, or of the clone that this runs in; None if unknown."""
    if COMMIT.is_file():
        return COMMIT.read_text().strip() or None
    if not (HERE.parent / ".git").exists():
        return None
    command = ["git", "-C", str(HERE), "rev-parse", "HEAD"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=5).stdout.strip()
    except (OSError, subprocess.SubprocessError):
        return None


def description() -> str:
    """Return version and commit for people: `0.3.0 (commit 76a150ef32b1)`."""
    known = commit()
    return version() if known is None else f"{version()} (commit {known[:12]})"


def install_command(extra: str, python: str = "python") -> str:
    """Return the command that installs the packages of an extra for this interpreter (`python`).

    It names the packages and not the extra: this project is on no index, and anybody could claim its name there.
    """
    declared = [text.partition(";") for text in metadata.requires(PACKAGE) or ()]
    packages = [name.strip() for name, _, marker in declared if f'extra == "{extra}"' in marker.replace("'", '"')]
    return shlex.join([python, "-m", "pip", "install", *packages])
