"""Where weights are kept, and what to do where they are missing."""

from __future__ import annotations

from pathlib import Path

from benchmarks.scenes import FOLDER

WEIGHTS = FOLDER / "learned"


def weights(name: str) -> Path:
    """The file of a net."""
    return WEIGHTS / f"{name}.pt"


def missing(names: tuple[str, ...]) -> str | None:
    """What to do before these nets can be asked; None where nothing is."""
    absent = [name for name in names if not weights(name).exists()]
    if not absent:
        return None
    command = f"python -m benchmarks.learned --nets {' '.join(absent)}"
    return f"no weights in {WEIGHTS}; to train them, hours of a core or minutes of a GPU: {command}"
