"""Batches of random pairs, each pair shown a few times: to draw one costs about as much as to learn from it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
import torch
from torch import Tensor
from torch.utils.data import DataLoader, IterableDataset, get_worker_info

from benchmarks.learned.pairs import Pair, Pairs
from benchmarks.learned.window import SIZE

SHOWN = 6
"""How often a pair is shown, on average."""
FIRST = 512
"""Pairs that are drawn before any is shown."""
PACK = 16
"""Pairs that are handed over at once."""
MIRRORED_POINTS = [1, 0, 3, 2]


@dataclass(frozen=True)
class Batch:
    """B pairs: `seen` and `template` (B, 1, height, width) in 0..1, `offsets` (B, 4, 2) in pixels."""

    seen: Tensor
    template: Tensor
    offsets: Tensor


class Drawn(IterableDataset[tuple[np.ndarray, np.ndarray]]):
    """Random pairs without end, packed: pictures (2, height, width) of bytes, offsets (4, 2). Workers draw apart."""

    def __init__(self, seed: int) -> None:
        super().__init__()
        self.seed = seed

    def __iter__(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        worker = get_worker_info()
        cv2.setNumThreads(1)
        for pair in Pairs(self.seed, worker.id if worker else 0):
            pictures = np.rint(255 * np.stack([pair.seen, pair.template])).astype(np.uint8)
            yield pictures, pair.offsets.astype(np.float32)


class Pool:
    """The last `kept` random pairs of a seed on `device`; every batch brings a few new ones, drawn by `workers`.

    Without workers they are drawn by the process itself, as they are needed.
    """

    def __init__(self, seed: int, device: torch.device, kept: int, workers: int = 0) -> None:
        self._fresh = iter(DataLoader(Drawn(seed), batch_size=PACK, num_workers=workers))
        self._random = torch.Generator(device).manual_seed(seed)
        self._pictures = torch.empty((kept, 2, SIZE[1], SIZE[0]), dtype=torch.uint8, device=device)
        self._offsets = torch.empty((kept, 4, 2), device=device)
        self.drawn, self.shown = 0, 0

    def batch(self, count: int) -> Batch:
        """Some of the pairs, about every other one mirrored."""
        while self.shown + count > SHOWN * (self.drawn - FIRST):
            self._keep(*next(self._fresh))
        self.shown += count
        device = self._offsets.device
        chosen = torch.randint(min(self.drawn, len(self._offsets)), (count,), generator=self._random, device=device)
        mirrored = torch.rand((count, 1, 1, 1), generator=self._random, device=device) < 0.5
        pictures = self._pictures[chosen].float() / 255
        pictures = torch.where(mirrored, pictures.flip(-1), pictures)
        offsets = self._offsets[chosen]
        offsets = torch.where(mirrored[..., 0], _mirrored(offsets), offsets)
        return Batch(pictures[:, :1], pictures[:, 1:], offsets)

    def _keep(self, pictures: Tensor, offsets: Tensor) -> None:
        places = (self.drawn + torch.arange(len(offsets))) % len(self._offsets)
        places = places.to(self._offsets.device)
        self._pictures[places] = pictures.to(places.device)
        self._offsets[places] = offsets.to(places.device)
        self.drawn += len(offsets)


def batch_of(pairs: list[Pair]) -> Batch:
    """The pairs as they are."""
    return Batch(
        torch.from_numpy(np.stack([pair.seen for pair in pairs]))[:, None],
        torch.from_numpy(np.stack([pair.template for pair in pairs]))[:, None],
        torch.from_numpy(np.stack([pair.offsets for pair in pairs]).astype(np.float32)),
    )


def _mirrored(offsets: Tensor) -> Tensor:
    """Displacements (B, 4, 2) of pictures whose left is their right: the points of `QUAD` swap sides as well."""
    return offsets[:, MIRRORED_POINTS] * offsets.new_tensor([-1, 1])
