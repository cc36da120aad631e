"""Base class of the three nets."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TypeVar

import torch
from torch import Tensor, nn

from benchmarks.learned.pool import Batch
from benchmarks.learned.weights import weights

N = TypeVar("N", bound=nn.Module)


class Net(nn.Module, ABC):
    """A net that can be trained and asked; `tried_steps`: the numbers of steps at which it is validated."""

    tried_steps: tuple[int, ...]

    @abstractmethod
    def loss(self, batch: Batch) -> Tensor:
        """Return the loss of a batch, ()."""

    @abstractmethod
    def answer(self, seen: Tensor, template: Tensor, steps: int | None = None) -> Tensor:
        """The displacements (B, 4, 2) of the four points in pixels, after so many steps or as many as are best."""


def convolved(layers: nn.Module, pictures: Tensor) -> Tensor:
    """The output of layers; with half the bits while they learn, which costs a processor or a GPU half the time."""
    with torch.autocast(pictures.device.type, torch.bfloat16, enabled=layers.training):
        return layers(pictures).float()


def loaded(name: str, net: N) -> N:
    """A net with the weights that were trained."""
    net.load_state_dict(torch.load(weights(name), map_location="cpu", weights_only=True))
    return net.eval()
