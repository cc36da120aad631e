"""Files of the trained weights, and the command that makes them."""

from __future__ import annotations

from pathlib import Path

from benchmarks.scenes import FOLDER

WEIGHTS = FOLDER / "learned"


def weights(name: str) -> Path:
    """The file of a net."""
    return WEIGHTS / f"{name}.pt"


def missing(names: tuple[str, ...]) -> str | None:
    """Return how to train the nets that have no weights, in words; None if all have them."""
    absent = [name for name in names if not weights(name).exists()]
    if not absent:
        return None
    command = f"python -m benchmarks.learned --nets {' '.join(absent)}"
    return f"no weights in {WEIGHTS}; to train them, hours of a core or minutes of a GPU: {command}"
