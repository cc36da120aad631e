"""Homographies of four displaced points, and pictures seen through them, with gradients."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional

from benchmarks.learned.window import QUAD, SIZE

LARGEST_PX = 60.0
"""Displacements are held within this: no line of the window goes over the horizon, and no net asks for more."""

_MIDDLE = torch.tensor([(length - 1) / 2 for length in SIZE])
_SCALE = torch.tensor([length / 2 for length in SIZE])


def homographies(offsets: Tensor) -> Tensor:
    """The homographies (B, 3, 3) that displace the points of `QUAD` by (B, 4, 2) pixels; for `scaled` points."""
    begin = scaled(torch.tensor(QUAD, dtype=offsets.dtype, device=offsets.device))
    end = begin + offsets.clamp(-LARGEST_PX, LARGEST_PX) / _SCALE.to(offsets)
    x, y = begin.expand_as(end).unbind(-1)
    one, zero = torch.ones_like(x), torch.zeros_like(x)
    u, v = end.unbind(-1)
    columns = torch.stack([x, y, one, zero, zero, zero, -u * x, -u * y], dim=-1)
    rows = torch.stack([zero, zero, zero, x, y, one, -v * x, -v * y], dim=-1)
    found = torch.linalg.solve(torch.cat([columns, rows], dim=1), torch.cat([u, v], dim=1))
    return torch.cat([found, torch.ones_like(found[:, :1])], dim=1).reshape(-1, 3, 3)


def moved(points: Tensor, through: Tensor) -> Tensor:
    """Map points (N, 2) in pixels by homographies (B, 3, 3): (B, N, 2) in pixels."""
    at = scaled(points)
    homogeneous = torch.cat([at, torch.ones_like(at[:, :1])], dim=1) @ through.transpose(1, 2)
    # What would come from beyond the horizon is far outside and not at infinity.
    depth = homogeneous[..., 2:].clamp(min=0.05)
    return (homogeneous[..., :2] / depth) * _SCALE.to(at) + _MIDDLE.to(at)


def warped(pictures: Tensor, through: Tensor) -> Tensor:
    """Pictures (B, 1, height, width): at each pixel what is where the homography moves that pixel, 0 outside."""
    at = moved(pixels(1).to(pictures), through)
    grid = (2 * at / torch.tensor([length - 1 for length in SIZE]).to(at) - 1).reshape(-1, SIZE[1], SIZE[0], 2)
    return functional.grid_sample(pictures, grid, align_corners=True)


def pixels(step: int) -> Tensor:
    """The middles (N, 2) of blocks of step x step pixels of the window, row by row."""
    x, y = (torch.arange(0, length, step) + (step - 1) / 2 for length in SIZE)
    return torch.cartesian_prod(y, x).flip(-1)


def scaled(points: Tensor) -> Tensor:
    """Points (..., 2) in pixels, to about -1..1: what equations are solved in."""
    return (points - _MIDDLE.to(points)) / _SCALE.to(points)
