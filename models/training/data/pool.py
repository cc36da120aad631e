"""The crops that training draws from: kept where it computes, each shown a few times, never twice alike."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from models.training.data.alter import altered
from models.training.data.makers import Makers


@dataclass(frozen=True)
class Batch:
    """Pictures (N, 3, S, S) RGB in 0..1, targets (N, 1, S, S), and `asked` (N, 1, S, S): 0 where no answer counts."""

    pictures: Tensor
    targets: Tensor
    asked: Tensor


class Pool:
    """The last `capacity` crops of `makers` on `device`; batches of `size` px, altered anew each time.

    A crop is shown about `repeats` times: who asks faster than that waits for new ones.
    """

    def __init__(
        self, makers: Makers, device: torch.device, capacity: int, size: int, repeats: float, seed: int
    ) -> None:
        self._makers, self._size, self._repeats = makers, size, repeats
        self._kept = torch.empty((capacity, 5, makers.size, makers.size), dtype=torch.uint8, device=device)
        self._random = torch.Generator(device).manual_seed(seed)
        self.made, self.shown = 0, 0

    def batch(self, count: int) -> Batch:
        """`count` crops drawn at random from those that are kept."""
        for pack in self._makers.made():
            self._keep(pack)
        while self.shown + count > self._repeats * self.made:
            self._keep(self._makers.wait())
        self.shown += count
        kept = min(self.made, len(self._kept))
        chosen = torch.randint(kept, (count,), generator=self._random, device=self._kept.device)
        planes = altered(self._kept[chosen].float() / 255, self._size, self._random)
        return Batch(planes[:, :3].contiguous(memory_format=torch.channels_last), planes[:, 3:4], planes[:, 4:])

    def _keep(self, pack: np.ndarray) -> None:
        places = (self.made + torch.arange(len(pack))) % len(self._kept)
        self._kept[places.to(self._kept.device)] = torch.from_numpy(pack).to(self._kept.device)
        self.made += len(pack)
