"""Part of a stitched view that no camera sees."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

# The names of the ninths of a view, row by row.
NINTHS = (
    ("top left", "top", "top right"),
    ("left", "middle", "right"),
    ("bottom left", "bottom", "bottom right"),
)


@dataclass(frozen=True)
class Unseen:
    """Part of a view that no camera sees: its `share`, 0 to 1, and the ninths that hold most of it, emptiest first."""

    share: float
    places: Sequence[str]


def unseen_part(seen: NDArray[np.bool_]) -> Unseen:
    """Return the unseen part of a view, by where it is `seen` (H, W)."""
    counts = {
        name: np.count_nonzero(~cell)
        for names, band in zip(NINTHS, np.array_split(seen, 3), strict=True)
        for name, cell in zip(names, np.array_split(band, 3, axis=1), strict=True)
    }
    total = sum(counts.values())
    places = [name for name in sorted(counts, key=lambda name: -counts[name]) if counts[name] > 0.15 * total]
    return Unseen(total / seen.size, places)
