"""The paper's U-Net with a quarter of the usual filters, its shapes, and its focal loss."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

LEAK = 0.01
# Mean and deviation of typical frames, red green blue in 0..1.
MEAN = (0.40, 0.45, 0.36)
SPREAD = (0.24, 0.22, 0.24)


@dataclass(frozen=True)
class Shape:
    """Size of a U-Net: filters per level, and the side in pixels of the blocks that the first level sees as one.

    Blocks of one pixel are the paper's. Blocks of two put four pixels into the channels (space to depth) and the answer
    back into pixels (depth to space): nothing is lost, and the level with the most pixels and the fewest filters, on
    which processors spend most of their time, is gone. Written as `24-48-96-192/2`; blocks of one may be left out.
    """

    filters: tuple[int, ...]
    block: int = 1

    @classmethod
    def parse(cls, written: str) -> Shape:
        """The shape of a name; raises ValueError for what is none."""
        filters, _, block = written.partition("/")
        return cls(tuple(int(count) for count in filters.split("-")), int(block or 1))

    def __str__(self) -> str:
        filters = "-".join(str(count) for count in self.filters)
        return filters if self.block == 1 else f"{filters}/{self.block}"


PAPER = Shape((16, 32, 64, 128, 256))
SERVED = Shape((24, 48, 96, 192), block=2)
"""Two fifths of the time of the paper's."""


class UNet(nn.Module):
    """RGB (N, 3, H, W) in 0..1 to logits (N, 1, H, W); H and W multiples of 32.

    The paper names no normalisation. Batch normalisation is added: it trains faster, and folds into the convolutions;
    the ablation is made without it (`normalised` False) as well.
    """

    def __init__(self, shape: Shape = SERVED, leak: float = LEAK, *, normalised: bool = True) -> None:
        super().__init__()
        self.shape, self.normalised = shape, normalised
        filters, pixels = shape.filters, shape.block**2
        upward = list(zip(filters[-2::-1], filters[:0:-1], strict=True))
        self.register_buffer("mean", torch.tensor(MEAN).view(1, 3, 1, 1))
        self.register_buffer("spread", torch.tensor(SPREAD).view(1, 3, 1, 1))
        before = (3 * pixels, *filters[:-1])
        self.down = nn.ModuleList(_block(a, b, leak, normalised) for a, b in zip(before, filters, strict=True))
        self.grow = nn.ModuleList(nn.ConvTranspose2d(b, a, 2, stride=2) for a, b in upward)
        self.up = nn.ModuleList(_block(2 * a, a, leak, normalised) for a, _ in upward)
        self.head = nn.Conv2d(filters[0], pixels, 1)
        # Nearly every pixel is no marking: start by saying so.
        nn.init.constant_(self.head.bias, -4.0)

    def forward(self, picture: Tensor) -> Tensor:
        """Logits of a field marking per pixel."""
        x = (picture - self.mean) / self.spread
        if self.shape.block > 1:
            x = nn.functional.pixel_unshuffle(x, self.shape.block)
        kept = []
        for depth, block in enumerate(self.down):
            x = block(x if depth == 0 else nn.functional.max_pool2d(x, 2))
            kept.append(x)
        kept.pop()
        for grow, block in zip(self.grow, self.up, strict=True):
            x = block(torch.cat([kept.pop(), grow(x)], dim=1))
        x = self.head(x)
        return nn.functional.pixel_shuffle(x, self.shape.block) if self.shape.block > 1 else x


def _block(before: int, after: int, leak: float, normalised: bool) -> nn.Sequential:
    layers: list[nn.Module] = []
    for channels in (before, after):
        convolution = nn.Conv2d(channels, after, 3, padding=1, bias=not normalised)
        if not normalised:
            # Nothing else keeps what passes through twenty layers as large as it was (He et al., 2015).
            nn.init.kaiming_normal_(convolution.weight, leak)
        layers += [
            convolution,
            nn.BatchNorm2d(after) if normalised else nn.Identity(),
            nn.LeakyReLU(leak, inplace=True),
        ]
    return nn.Sequential(*layers)


def focal_loss(
    logits: Tensor, target: Tensor, gamma: float = 1.0, marked: float = 3.0, asked: Tensor | None = None
) -> Tensor:
    """Focal loss for soft targets (all (N, 1, H, W)): cross entropy weighted by |target - probability|^gamma.

    Per marked pixel of the batch. A pixel has its least loss where probability and target agree, so the output stays a
    share; `marked` is the weight of a fully marked pixel, for the few there are. `asked`: a weight of each pixel.
    """
    entropy = nn.functional.binary_cross_entropy_with_logits(logits, target, reduction="none")
    miss = (target - torch.sigmoid(logits)).abs() ** gamma
    weight = (1 + (marked - 1) * target) * (1 if asked is None else asked)
    return (weight * miss * entropy).sum() / target.sum().clamp(min=100.0)
