"""DHN: DeTone, Malisiewicz, Rabinovich, "Deep Image Homography Estimation", 2016.

A network in the manner of VGG looks at both pictures as two channels of one and says at once how far four points are
displaced. Theirs has eight layers of 64 and 128 filters, 34 million weights and pictures of 128 x 128; this one has
as many layers of 24 to 96 and 0.8 million, for a processor.
"""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional

from benchmarks.learned.net import Net, convolved
from benchmarks.learned.pool import Batch
from benchmarks.learned.window import SIZE

CHANNELS = (24, 48, 72, 96)
HIDDEN = 256
LARGEST_PX = 32.0
"""What an answer of 1 means: four points of two coordinates begin near 0 and end below it."""


class Dhn(Net):
    """Two pictures (B, 1, height, width) to the displacements (B, 4, 2) of the four points, in pixels."""

    tried_steps = (1,)

    def __init__(self) -> None:
        super().__init__()
        self.layers = vgg(CHANNELS)
        pixels = (SIZE[0] >> len(CHANNELS) + 1) * (SIZE[1] >> len(CHANNELS) + 1)
        self.head = nn.Sequential(
            nn.Flatten(), nn.Linear(CHANNELS[-1] * pixels, HIDDEN), nn.ReLU(), nn.Dropout(0.1), nn.Linear(HIDDEN, 8)
        )

    def forward(self, seen: Tensor, template: Tensor) -> Tensor:
        """One shot."""
        both = torch.cat([seen, template], dim=1).contiguous(memory_format=torch.channels_last)
        return LARGEST_PX * self.head(convolved(self.layers, both)).reshape(-1, 4, 2)

    def loss(self, batch: Batch) -> Tensor:
        """The mean distance of a coordinate, less strict below a pixel."""
        return functional.smooth_l1_loss(self(batch.seen, batch.template), batch.offsets)

    def answer(self, seen: Tensor, template: Tensor, steps: int | None = None) -> Tensor:
        """Return the displacements, without gradients."""
        with torch.no_grad():
            return self(seen, template)


def vgg(channels: Sequence[int]) -> nn.Sequential:
    """Layers for two pictures as two channels: a first one at half the size, and a pooling after every two."""
    layers: list[nn.Module] = [nn.Conv2d(2, channels[0], 5, stride=2, padding=2), *_after(channels[0])]
    before = channels[0]
    for stage, width in enumerate(channels):
        for taken in (before, width)[1 if stage == 0 else 0 :]:
            layers += [nn.Conv2d(taken, width, 3, padding=1, bias=False), *_after(width)]
        layers.append(nn.MaxPool2d(2))
        before = width
    return nn.Sequential(*layers)


def _after(width: int) -> tuple[nn.Module, nn.Module]:
    return nn.BatchNorm2d(width), nn.ReLU(inplace=True)
