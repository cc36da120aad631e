"""The map of the code in docs/architecture.md: printed by `python -m tests.architecture` from the import contracts.

A room is a package or a module; what it is for is the first sentence of its docstring, what it may import is what
`make check` holds it to.
"""

from __future__ import annotations

import ast
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
# In the order in which data flows.
PLACES = ("service", "worker", "worker.calibration")


def tables() -> str:
    """A table of the rooms of each place, from the top down: each may import what stands in rows below it."""
    return "\n\n".join(f"### {place.replace('.', '/')}\n\n{_table(place)}" for place in PLACES)


def purpose(module: str) -> str:
    """The first sentence of the docstring of a package or module."""
    folder = ROOT / module.replace(".", "/")
    path = folder / "__init__.py" if folder.is_dir() else folder.with_suffix(".py")
    said = ast.get_docstring(ast.parse(path.read_text()))
    assert said, f"{path} says nothing of itself"
    return " ".join(said.split("\n\n")[0].split())


def layers(place: str) -> list[list[str]]:
    """The rooms of a place, as the import contracts have them: those of a row know nothing of each other."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    (its,) = [one for one in contracts if one.get("containers") == [place]]
    return [[room.strip() for room in row.split("|")] for row in its["layers"]]


def _table(place: str) -> str:
    lines = ["| row, room | what it is |", "|---|---|"]
    for number, row in enumerate(layers(place), 1):
        lines += [f"| {number} `{room}` | {purpose(f'{place}.{room}')} |" for room in row]
    return "\n".join(lines)


if __name__ == "__main__":
    print(tables())
