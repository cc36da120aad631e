"""Augmentation of crops: turned, mirrored, cut, sheared and scaled.

Everything is computed for the whole batch where the batch lies: on a GPU it costs nothing beside the training. Colours,
light and noise stay as they were rendered, because what can be seen of a line depends on them, and the target says so.
"""

from __future__ import annotations

import torch
from torch import Tensor

MIRRORED, UPSIDE_DOWN, ON_ITS_SIDE, WARPED = 0.5, 0.08, 0.12, 0.35
"""How often."""
TURN, SCALE, SHEAR = 0.15, 0.15, 0.1
"""Standard deviations of a warp: radians, of the logarithm, of the tangent."""


def altered(planes: Tensor, size: int, random: torch.Generator) -> Tensor:
    """Windows (N, C, size, size) of crops (N, C, S, S)."""
    made = planes.shape[-1]
    maps = _maps(len(planes), made - size, random)
    maps[..., :2] *= size / made
    maps[..., 2] *= 2 / made
    grid = torch.nn.functional.affine_grid(maps, [*planes.shape[:2], size, size], align_corners=False)
    return torch.nn.functional.grid_sample(planes, grid, padding_mode="reflection", align_corners=False)


def _maps(count: int, spare: int, random: torch.Generator) -> Tensor:
    """Affine maps (N, 2, 3) from a window to its crop, `spare` px wider, in pixels from the middle of each."""
    mirrors = torch.stack([_chosen(count, MIRRORED, random), _chosen(count, UPSIDE_DOWN, random)], dim=-1)
    flips = torch.diag_embed(1 - 2 * mirrors)
    side = _chosen(count, ON_ITS_SIDE, random).bool()
    flips[side] = flips[side].flip(-1)
    warped = _chosen(count, WARPED, random)
    angle, stretch, shear = (
        warped * spread * torch.randn(count, generator=random, device=random.device) for spread in (TURN, SCALE, SHEAR)
    )
    c, s, one, zero = torch.cos(angle), torch.sin(angle), torch.ones_like(angle), torch.zeros_like(angle)
    turn = torch.stack([torch.stack([c, -s], -1), torch.stack([s, c], -1)], -2)
    slant = torch.stack([torch.stack([one, shear], -1), torch.stack([zero, one], -1)], -2)
    linear = torch.exp(-stretch)[:, None, None] * flips @ turn @ slant
    move = torch.randint(-(spare // 2), spare // 2 + 1, (count, 2), generator=random, device=random.device).float()
    return torch.cat([linear, move[..., None]], dim=-1)


def _chosen(count: int, share: float, random: torch.Generator) -> Tensor:
    """1 for so many of all, else 0."""
    return (torch.rand(count, generator=random, device=random.device) < share).float()
