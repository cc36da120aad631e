"""The paper's U-Net with a quarter of the usual filters, and its focal loss."""

from __future__ import annotations

import torch
from torch import Tensor, nn

FILTERS = (16, 32, 64, 128, 256)
LEAK = 0.01
# Of typical frames, red green blue in 0..1.
MEAN = (0.40, 0.45, 0.36)
SPREAD = (0.24, 0.22, 0.24)


class UNet(nn.Module):
    """RGB (N, 3, H, W) in 0..1 to logits (N, 1, H, W); H and W multiples of 16.

    The paper names no normalisation. Batch normalisation is added: it trains faster, and folds into the convolutions.
    """

    def __init__(self, leak: float = LEAK) -> None:
        super().__init__()
        self.register_buffer("mean", torch.tensor(MEAN).view(1, 3, 1, 1))
        self.register_buffer("spread", torch.tensor(SPREAD).view(1, 3, 1, 1))
        before = (3, *FILTERS[:-1])
        self.down = nn.ModuleList(_block(a, b, leak) for a, b in zip(before, FILTERS, strict=True))
        self.grow = nn.ModuleList(nn.ConvTranspose2d(b, a, 2, stride=2) for a, b in _steps_up())
        self.up = nn.ModuleList(_block(2 * a, a, leak) for a, _ in _steps_up())
        self.head = nn.Conv2d(FILTERS[0], 1, 1)
        # Nearly every pixel is no marking: start by saying so.
        nn.init.constant_(self.head.bias, -4.0)

    def forward(self, picture: Tensor) -> Tensor:
        """Logits of a field marking per pixel."""
        x = (picture - self.mean) / self.spread
        kept = []
        for depth, block in enumerate(self.down):
            x = block(x if depth == 0 else nn.functional.max_pool2d(x, 2))
            kept.append(x)
        kept.pop()
        for grow, block in zip(self.grow, self.up, strict=True):
            x = block(torch.cat([kept.pop(), grow(x)], dim=1))
        return self.head(x)


def _steps_up() -> list[tuple[int, int]]:
    """Filters after and before each upward step, deepest first."""
    return list(zip(FILTERS[-2::-1], FILTERS[:0:-1], strict=True))


def _block(before: int, after: int, leak: float) -> nn.Sequential:
    layers: list[nn.Module] = []
    for channels in (before, after):
        layers += [
            nn.Conv2d(channels, after, 3, padding=1, bias=False),
            nn.BatchNorm2d(after),
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
