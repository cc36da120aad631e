"""Printing of what benchmarks measure: sections of Markdown, heads of tables, figures in common."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence

import numpy as np


def print_sections(
    chosen: Iterable[str], sections: Mapping[str, Callable[..., Iterable[str]]], *arguments: object
) -> None:
    """Print the lines of the chosen sections below their names, each line as soon as it is known."""
    for name in chosen:
        print(f"\n## {name}\n", flush=True)
        for line in sections[name](*arguments):
            print(line, flush=True)


def table_head(columns: str) -> str:
    """Return the first two lines of a Markdown table by its columns, between which ` | ` stands."""
    return f"| {columns} |\n{'|---' * (columns.count('|') + 1)}|"


def rms(values: Sequence[float] | np.ndarray) -> float:
    """Return the root of the mean square; 0 of nothing."""
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else 0.0


def spread(values: Sequence[float], digits: int = 1) -> str:
    """Return the median, and in brackets the least and the most."""
    if not len(values):
        return "none"
    return f"{np.median(values):.{digits}f} ({min(values):.{digits}f} to {max(values):.{digits}f})"
