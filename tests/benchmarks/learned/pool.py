"""Batches of random pairs, each pair shown a few times: to draw one costs about as much as to learn from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from tests.benchmarks.learned.pairs import Pair, Pairs
from tests.benchmarks.learned.window import SIZE

KEPT = 4096
SHOWN = 4
"""How often a pair is shown, on average."""
MIRRORED_POINTS = [1, 0, 3, 2]


@dataclass(frozen=True)
class Batch:
    """B pairs: `seen` and `template` (B, 1, height, width) in 0..1, `offsets` (B, 4, 2) in pixels."""

    seen: Tensor
    template: Tensor
    offsets: Tensor


class Pool:
    """The last `KEPT` random pairs of a seed; every batch brings a few new ones."""

    def __init__(self, seed: int) -> None:
        self.pairs = iter(Pairs(seed))
        self.rng = np.random.default_rng([21, seed])
        self.kept: list[tuple[np.ndarray, np.ndarray]] = []
        self.drawn = 0

    def batch(self, count: int) -> Batch:
        """Some of the pairs, every other one mirrored."""
        for _ in range(max(1, count // SHOWN) if self.kept else 4 * count):
            self._draw()
        chosen = [self.kept[i] for i in self.rng.integers(len(self.kept), size=count)]
        pictures, offsets = (np.stack(part) for part in zip(*chosen, strict=True))
        mirrored = self.rng.random(count) < 0.5
        pictures[mirrored] = pictures[mirrored, :, :, ::-1]
        offsets[mirrored] = offsets[mirrored][:, MIRRORED_POINTS] * [-1, 1]
        both = torch.from_numpy(pictures).float() / 255
        return Batch(both[:, :1], both[:, 1:], torch.from_numpy(offsets))

    def _draw(self) -> None:
        pair = next(self.pairs)
        packed = np.stack([_packed(pair.seen), _packed(pair.template)])
        if len(self.kept) < KEPT:
            self.kept.append((packed, pair.offsets.astype(np.float32)))
        else:
            self.kept[self.drawn % KEPT] = (packed, pair.offsets.astype(np.float32))
        self.drawn += 1


def batch_of(pairs: list[Pair]) -> Batch:
    """The pairs as they are."""
    return Batch(
        torch.from_numpy(np.stack([pair.seen for pair in pairs]))[:, None],
        torch.from_numpy(np.stack([pair.template for pair in pairs]))[:, None],
        torch.from_numpy(np.stack([pair.offsets for pair in pairs]).astype(np.float32)),
    )


def _packed(picture: np.ndarray) -> np.ndarray:
    assert picture.shape == SIZE[::-1]
    return np.rint(255 * picture).astype(np.uint8)
