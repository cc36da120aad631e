"""OTLE: Jiang et al., "Optimizing Through Learned Errors for Accurate Sports Field Registration", WACV 2020.

A first guess of four points, then a network that looks at the picture and the template as it is laid by them, and says
how wrong they are; the guess is moved down the slope of what it says, through the warp. Theirs are two ResNet-18 of 11
million weights; here the first guess is DHN's, the error is told by a network in the same manner with 0.2 million,
for a processor.
"""

from __future__ import annotations

from functools import cached_property

import torch
from torch import Tensor, nn
from torch.nn import functional

from benchmarks.learned.dhn import Dhn, vgg
from benchmarks.learned.net import Net, convolved, loaded
from benchmarks.learned.pool import Batch
from benchmarks.learned.warp import homographies, warped

CHANNELS = (24, 48, 64, 64)
SMALLEST_PX, LARGEST_PX = 0.05, 12.0
"""How wrong the candidates are that errors are learnt from."""
STEPS, FIRST_STEP_PX, LAST_STEP_PX = 80, 0.6, 0.05


class Otle(Net):
    """A mask and the template, each (B, 1, height, width), to how far four points are off: log(1 + pixels), (B,)."""

    tried_steps = (20, 40, 80)

    def __init__(self) -> None:
        super().__init__()
        self.layers = vgg(CHANNELS)
        self.head = nn.Sequential(
            nn.AdaptiveAvgPool2d(1), nn.Flatten(), nn.Linear(CHANNELS[-1], 64), nn.ReLU(), nn.Linear(64, 1)
        )

    def forward(self, seen: Tensor, template: Tensor, offsets: Tensor) -> Tensor:
        """The error of the displacements (B, 4, 2)."""
        laid = warped(template, homographies(offsets))
        both = torch.cat([seen, laid], dim=1).contiguous(memory_format=torch.channels_last)
        return functional.softplus(self.head(convolved(self.layers, both)).squeeze(1))

    def loss(self, batch: Batch) -> Tensor:
        """Between what it says of random candidates and how wrong they are."""
        offsets = batch.offsets + candidate_errors(batch.offsets)
        wrong = (offsets - batch.offsets).norm(dim=-1).mean(dim=1)
        return functional.smooth_l1_loss(self(batch.seen, batch.template, offsets), wrong.log1p(), beta=0.1)

    def answer(self, seen: Tensor, template: Tensor, steps: int | None = None) -> Tensor:
        """From DHN's guess down the slope; of all steps, the displacements of which the least error is said."""
        return self.descended(seen, template, self.first_guess.answer(seen, template), steps or STEPS)

    @cached_property
    def first_guess(self) -> Dhn:
        """DHN as it was trained; no part of this net, and not kept with it."""
        return loaded("dhn", Dhn()).to(next(self.parameters()).device)

    def descended(self, seen: Tensor, template: Tensor, first: Tensor, steps: int) -> Tensor:
        """Return the displacements by descent from a first guess (B, 4, 2)."""
        offsets = first.clone().requires_grad_()
        optimiser = torch.optim.Adam([offsets], lr=FIRST_STEP_PX, betas=(0.8, 0.95))
        best, least = first.clone(), first.new_full((len(first),), torch.inf)
        for step in range(steps + 1):
            for group in optimiser.param_groups:
                group["lr"] = FIRST_STEP_PX * (LAST_STEP_PX / FIRST_STEP_PX) ** (step / max(steps, 1))
            said = self(seen, template, offsets)
            better = said.detach() < least
            best[better], least[better] = offsets.detach()[better], said.detach()[better]
            optimiser.zero_grad(set_to_none=True)
            said.sum().backward(inputs=[offsets])
            optimiser.step()
        return best


def candidate_errors(offsets: Tensor) -> Tensor:
    """Errors (B, 4, 2) of any size: what wrong poses do to the four points, and what they do not."""
    batch, device = len(offsets), offsets.device
    size = SMALLEST_PX * (LARGEST_PX / SMALLEST_PX) ** torch.rand(batch, 1, 1, device=device)
    either_way = torch.randint(0, 2, (batch, 1, 1), device=device) * 2 - 1
    of_a_pose = offsets[torch.randperm(batch, device=device)] * either_way
    of_a_pose = of_a_pose / of_a_pose.norm(dim=-1).mean(dim=1).clamp(min=0.1)[:, None, None]
    of_none = torch.randn(batch, 4, 2, device=device)
    mixed = of_a_pose + torch.rand(batch, 1, 1, device=device) * of_none
    return size * mixed / mixed.norm(dim=-1).mean(dim=1)[:, None, None]
