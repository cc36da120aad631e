"""Values of a parsed file with their places in it, so that a wrong one is refused with place, expectation and value."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NoReturn

# Characters of a wrong value that a message repeats.
LONGEST_SHOWN = 60


class FileRefusedError(ValueError):
    """A file is no calibration that can be read: says file, place, what was expected and what came."""

    def __init__(self, file: str, place: str, expected: str, got: str) -> None:
        where = f"{file}, {place}" if place else file
        super().__init__(f"{where}: expected {expected}, got {got}")


@dataclass(frozen=True)
class Node:
    """A value of a parsed file: numbers, text, lists and mappings; `place`: its path from the top, as in `a.b[2]`."""

    file: str
    place: str
    value: Any

    def refuse(self, expected: str, got: str | None = None) -> NoReturn:
        """Raise `FileRefusedError` for this value, or for what `got` names of it."""
        raise FileRefusedError(self.file, self.place, expected, _shown(self.value) if got is None else got)

    def __contains__(self, key: str) -> bool:
        return isinstance(self.value, dict) and self.value.get(key) is not None

    def __getitem__(self, key: str) -> "Node":
        """Return a member of a mapping; refuse a value that has none of that name."""
        if not isinstance(self.value, dict):
            self.refuse(f"a mapping with {key}")
        if self.value.get(key) is None:
            self.refuse(f"a member {key}", _shown(list(self.value)))
        return self._below(key)

    def get(self, key: str) -> "Node | None":
        """Return a member of a mapping, or None where it is absent or null."""
        return self._below(key) if key in self else None

    def __bool__(self) -> bool:
        """True, whatever the value: a node is there or None."""
        return True

    def members(self) -> "Iterator[tuple[str, Node]]":
        """Yield the names and values of a mapping."""
        if not isinstance(self.value, dict):
            self.refuse("a mapping")
        for key in self.value:
            yield str(key), self._below(key)

    def elements(self, least: int = 1) -> "list[Node]":
        """Return the elements of a list of at least so many."""
        if not isinstance(self.value, list) or len(self.value) < least:
            self.refuse(f"a list of {least} or more")
        return [Node(self.file, f"{self.place}[{n}]", value) for n, value in enumerate(self.value)]

    def text(self) -> str:
        """Return a text."""
        if not isinstance(self.value, str):
            self.refuse("text")
        return self.value

    def flag(self) -> bool:
        """Return a boolean, which some files write as 0 or 1."""
        if self.value not in (True, False):
            self.refuse("true or false")
        return bool(self.value)

    def size(self) -> tuple[int, int]:
        """Return the width and height of a picture."""
        width, height = (side.integer(1) for side in self.elements(2))
        return width, height

    def number(self) -> float:
        """Return a finite number."""
        if not _is_number(self.value):
            self.refuse("a finite number")
        return float(self.value)

    def integer(self, least: int = 0) -> int:
        """Return a whole number."""
        if not _is_number(self.value) or self.value != int(self.value) or self.value < least:
            self.refuse(f"a whole number from {least}")
        return int(self.value)

    def numbers(self, *counts: int) -> list[float]:
        """Return the numbers of a list, of a row or of a column, in so many as one of the counts; no counts: any."""
        found = self.value if isinstance(self.value, list) else [self.value]
        if len(found) == 1 and isinstance(found[0], list):
            found = found[0]
        elif found and all(isinstance(one, list) and len(one) == 1 for one in found):
            found = [one for (one,) in found]
        if not all(map(_is_number, found)) or (counts and len(found) not in counts):
            self.refuse(f"{' or '.join(map(str, counts)) or 'a list of'} finite numbers")
        return [float(one) for one in found]

    def matrix(self, rows: int, columns: int) -> list[list[float]]:
        """Return a matrix, from its rows or from all of its numbers row by row."""
        value = self.value
        if isinstance(value, list) and value and not isinstance(value[0], list):
            data = self.numbers(rows * columns)
            return [data[start : start + columns] for start in range(0, rows * columns, columns)]
        if not isinstance(value, list) or len(value) != rows:
            self.refuse(f"a matrix of {rows}x{columns} numbers")
        return [row.numbers(columns) for row in self.elements()]

    def _below(self, key: str) -> "Node":
        return Node(self.file, f"{self.place}.{key}" if self.place else str(key), self.value[key])


def _is_number(value: Any) -> bool:
    try:
        return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:
        # A whole number beyond what a float holds.
        return False


def _shown(value: Any) -> str:
    if isinstance(value, list):
        names = [str(one) for one in value[:8]]
        words = f"[{', '.join(names)}{', ...' if len(value) > 8 else ''}]"
    elif isinstance(value, dict):
        words = f"a mapping with {', '.join(map(str, list(value)[:8])) or 'nothing'}"
    else:
        words = repr(value)
    return words if len(words) <= LONGEST_SHOWN else f"{words[:LONGEST_SHOWN]}..."
