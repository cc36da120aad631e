"""Noise that is fixed to places in the world, faded where a pixel is larger than its grains.

Everything the renderer paints on a surface is a function of metres on that surface, so that two cameras see the same
grass. A `Patch` says where each pixel of a window looks on one surface and how large the pixel is there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

Plane = NDArray[np.float32]
Mask = NDArray[np.bool_]

TEXTURE_SIZE = 256


@dataclass(frozen=True)
class Patch:
    """The places on one surface that the pixels of a window show.

    `x`, `y` (H, W): metres along the surface's two axes; `depth` (H, W): metres from the camera; `seen` (H, W): whether
    the pixel meets the surface at all. Unseen pixels hold finite numbers without meaning.
    """

    x: Plane
    y: Plane
    depth: Plane
    seen: Mask

    @cached_property
    def jacobian(self) -> tuple[Plane, Plane, Plane, Plane]:
        """dx/du, dx/dv, dy/du, dy/dv, metres per pixel."""
        dxdv, dxdu = np.gradient(self.x)
        dydv, dydu = np.gradient(self.y)
        return dxdu, dxdv, dydu, dydv

    @cached_property
    def axes(self) -> tuple[Plane, Plane]:
        """Short and long axis of a pixel on the surface, metres: the singular values of the Jacobian."""
        a, b, c, d = self.jacobian
        total = a * a + b * b + c * c + d * d
        determinant = np.abs(a * d - b * c)
        root = np.sqrt(np.maximum(total * total - 4 * determinant * determinant, 0))
        long = np.sqrt((total + root) / 2) + 1e-6
        return determinant / long + 1e-6, long

    def across(self, nx: Plane | float, ny: Plane | float) -> Plane:
        """Size of a pixel in the direction (nx, ny) on the surface: metres per pixel."""
        a, b, c, d = self.jacobian
        return np.hypot(a * nx + c * ny, b * nx + d * ny) + np.float32(1e-6)

    def part(self, rows: slice, columns: slice) -> Patch:
        """Return the patch of a rectangle of the window."""
        return Patch(self.x[rows, columns], self.y[rows, columns], self.depth[rows, columns], self.seen[rows, columns])


@dataclass(frozen=True)
class Noise:
    """A sum of octaves: grain sizes in metres and amplitudes, shifted and turned by the world's seed."""

    scales: tuple[float, ...]
    amplitudes: tuple[float, ...]
    offsets: NDArray[np.float32]
    angle: float

    @classmethod
    def draw(cls, rng: np.random.Generator, octaves: dict[float, float]) -> Noise:
        """Octaves {grain size in metres: amplitude} at a random place."""
        offsets = rng.uniform(0, TEXTURE_SIZE, (len(octaves), 2)).astype(np.float32)
        return cls(tuple(octaves), tuple(octaves.values()), offsets, float(rng.uniform(0, np.pi)))

    def at(self, patch: Patch) -> Plane:
        """Value (H, W), mean 0, on a patch.

        A pixel that covers n grains shows their mean: an octave fades with the root of n.
        """
        short, long = patch.axes
        cosine, sine = np.float32(np.cos(self.angle)), np.float32(np.sin(self.angle))
        x = cosine * patch.x - sine * patch.y
        y = sine * patch.x + cosine * patch.y
        value = np.zeros_like(patch.x)
        largest = float(long.min())
        for scale, amplitude, offset in zip(self.scales, self.amplitudes, self.offsets, strict=True):
            if largest > 15 * scale:
                continue
            fade = amplitude / np.sqrt(np.maximum(short / scale, 1) * np.maximum(long / scale, 1))
            value += fade * _grains(x / scale + offset[0], y / scale + offset[1])
        return value


def _grains(column: Plane, row: Plane) -> Plane:
    return cv2.remap(_texture(), column, row, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)


@lru_cache(maxsize=1)
def _texture() -> Plane:
    """Smooth grains of about one texel, tileable, mean 0, variance 1."""
    white = np.random.default_rng(1).standard_normal((TEXTURE_SIZE, TEXTURE_SIZE)).astype(np.float32)
    wrapped = cv2.copyMakeBorder(white, 8, 8, 8, 8, cv2.BORDER_WRAP)
    smooth = cv2.GaussianBlur(wrapped, (0, 0), 0.6)[8:-8, 8:-8]
    return ((smooth - smooth.mean()) / smooth.std()).astype(np.float32)


def step(signed: Plane, footprint: Plane) -> Plane:
    """Share of a pixel for which `signed` (metres) is positive: a straight edge under a box filter."""
    return np.clip(signed / footprint + np.float32(0.5), 0, 1)


def band(offset: Plane, width: Plane | float, footprint: Plane) -> Plane:
    """Share of a pixel covered by a band of `width` metres around offset 0; also of bands thinner than a pixel."""
    return step(width / 2 - offset, footprint) - step(-width / 2 - offset, footprint)


def bands(position: Plane, period: float, width: float, footprint: Plane) -> Plane:
    """Share of a pixel covered by bands of `width` every `period` metres; their mean where they blur together."""
    offset = np.mod(position + period / 2, period) - period / 2
    fade = np.clip(2 - 2 * footprint / period, 0, 1)
    return fade * band(offset, width, footprint) + (1 - fade) * (width / period)


def smooth_step(value: Plane, low: float, high: float) -> Plane:
    """0 below `low`, 1 above `high`, smooth between."""
    t = np.clip((value - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def mix(base: Plane, other: Plane | NDArray[np.float32], share: Plane) -> Plane:
    """Blend colours (H, W, 3) with a colour (3,) or colours (H, W, 3) by `share` (H, W)."""
    return base + share[..., None] * (other - base)
