"""IHN: Cao, Hu, Luo, Lakemeyer, "Iterative Deep Homography Estimation", CVPR 2022.

One network makes features of both pictures. Each step moves the places of the first picture's features by the
homography of now, looks at how much the second picture is like them around there, and says from that how the four
points have to move on. Theirs is in two scales, with 256 features and a correlation at a quarter of the picture's
size; this one is in one scale, has 32 features, and asks from every eighth pixel of the mask what is at every fourth of
the template: 0.2 million weights, for a processor.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn
from torch.nn import functional

from benchmarks.learned.net import Net, convolved
from benchmarks.learned.pool import Batch
from benchmarks.learned.warp import LARGEST_PX, homographies, moved, pixels
from benchmarks.learned.window import SIZE

FEATURES, HIDDEN = 32, 64
ASKED_EVERY, ANSWERED_EVERY = 8, 4
RADIUS, LEVELS = 4, 2
STEP_PX = 8.0
"""What an answer of 1 means."""
LEARNT_STEPS, STEPS = 4, 6
OLDER = 0.8
"""How much less a step counts in the loss than the next one."""


class Ihn(Net):
    """Two pictures (B, 1, height, width) to the displacements (B, 4, 2) of the four points after each step."""

    tried_steps = (2, 4, 6, 8, 12)

    def __init__(self) -> None:
        super().__init__()
        self.features = nn.Sequential(
            *_block(1, 24, 5, stride=2),
            *_block(24, FEATURES, 3, stride=2),
            *_block(FEATURES, FEATURES, 3),
            *_block(FEATURES, FEATURES, 3, dilation=2),
            nn.Conv2d(FEATURES, FEATURES, 3, padding=1),
        )
        likenesses = LEVELS * (2 * RADIUS + 1) ** 2
        self.aggregate = nn.Sequential(
            nn.Conv2d(likenesses + 2, HIDDEN, 1),
            nn.ReLU(inplace=True),
            *_block(HIDDEN, HIDDEN, 3),
            nn.MaxPool2d(2),
            *_block(HIDDEN, HIDDEN, 3),
            nn.MaxPool2d(2),
            *_block(HIDDEN, HIDDEN, 3),
            nn.Flatten(),
            nn.Linear(HIDDEN * (SIZE[0] // 32) * (SIZE[1] // 32), 8),
        )

    def forward(self, seen: Tensor, template: Tensor, steps: int) -> list[Tensor]:
        """The displacements after each step, from none on."""
        asking, answering = convolved(self.features, torch.cat([seen, template]).contiguous()).chunk(2)
        asking = functional.avg_pool2d(asking, ASKED_EVERY // ANSWERED_EVERY)
        levels = likeness(asking, answering)
        places = pixels(ASKED_EVERY).to(seen)
        offsets = seen.new_zeros(len(seen), 4, 2)
        after = []
        for _ in range(steps):
            with torch.no_grad():
                at = moved(places, homographies(offsets))
            around = torch.cat([looked_up(level, at, ANSWERED_EVERY << i) for i, level in enumerate(levels)], dim=-1)
            told = torch.cat([around, (at - places) / ASKED_EVERY], dim=-1).transpose(1, 2)
            told = told.reshape(len(seen), -1, SIZE[1] // ASKED_EVERY, SIZE[0] // ASKED_EVERY)
            step = STEP_PX * convolved(self.aggregate, told).reshape(-1, 4, 2)
            offsets = offsets + step
            after.append(offsets)
            offsets = offsets.detach().clamp(-LARGEST_PX, LARGEST_PX)
        return after

    def loss(self, batch: Batch) -> Tensor:
        """The mean distance of a coordinate over the steps, of which the later count more."""
        after = self(batch.seen, batch.template, LEARNT_STEPS)
        weights = [OLDER ** (len(after) - 1 - step) for step in range(len(after))]
        losses = [functional.smooth_l1_loss(offsets, batch.offsets, beta=0.5) for offsets in after]
        weighted = torch.stack([weight * loss for weight, loss in zip(weights, losses, strict=True)])
        return weighted.sum() / sum(weights)

    def answer(self, seen: Tensor, template: Tensor, steps: int | None = None) -> Tensor:
        """Return the displacements after the last step, without gradients."""
        with torch.no_grad():
            return self(seen, template, steps or STEPS)[-1]


def likeness(asking: Tensor, answering: Tensor) -> list[Tensor]:
    """Correlate each asking place (Q of them) with all of the answering ones: (B, Q, h, w), then at half the size."""
    asked = (asking / math.sqrt(asking.shape[1])).flatten(2).transpose(1, 2)
    levels = []
    for _ in range(LEVELS):
        levels.append((asked @ answering.flatten(2)).unflatten(2, answering.shape[2:]))
        # The mean of likenesses is the likeness to the mean.
        answering = functional.avg_pool2d(answering, 2)
    return levels


def looked_up(level: Tensor, at: Tensor, every: int) -> Tensor:
    """The likeness (B, Q, h, w) around places (B, Q, 2) in pixels, (B, Q, (2 radius + 1)²); `every`: pixels a cell."""
    batch, asked, height, width = level.shape
    cells = (at - (every - 1) / 2) / every
    steps = torch.arange(-RADIUS, RADIUS + 1).to(at)
    beside = torch.cartesian_prod(steps, steps).flip(-1)
    around = cells.reshape(-1, 1, 2) + beside
    grid = 2 * around / at.new_tensor([width - 1, height - 1]) - 1
    sampled = functional.grid_sample(
        level.reshape(-1, 1, height, width), grid.reshape(len(around), 2 * RADIUS + 1, -1, 2), align_corners=True
    )
    return sampled.reshape(batch, asked, -1)


def _block(taken: int, given: int, size: int, stride: int = 1, dilation: int = 1) -> tuple[nn.Module, ...]:
    return (
        nn.Conv2d(taken, given, size, stride, padding=dilation * (size // 2), dilation=dilation, bias=False),
        nn.BatchNorm2d(given),
        nn.ReLU(inplace=True),
    )
