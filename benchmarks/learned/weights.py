"""Files of the weights: those that were trained, and those that training goes on from."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from benchmarks.scenes import FOLDER

TRAINED = Path(__file__).parent / "trained"
CHECKPOINTS = FOLDER / "learned"


def weights(name: str) -> Path:
    """The file of a trained net, its matrices in half precision."""
    return TRAINED / f"{name}.pt"


def checkpoint(name: str) -> Path:
    """The file of a net and its optimiser in the course of training."""
    return CHECKPOINTS / f"{name}.pt"


def missing(names: tuple[str, ...]) -> str | None:
    """Return what the nets lack, and how to get it, in words; None if they can answer."""
    absent = [name for name in names if not weights(name).exists()]
    if absent:
        command = f"python -m benchmarks.learned --nets {' '.join(absent)}"
        return f"no weights in {TRAINED}; to train them, hours of a core or minutes of a GPU: {command}"
    if find_spec("torch") is None:
        return "expected PyTorch, which is not installed: pip install '.[bench]'"
    return None
