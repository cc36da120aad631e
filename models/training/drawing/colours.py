"""Colours as displayed: blue, green, red in 0..1."""

from __future__ import annotations

import colorsys

import numpy as np
from numpy.typing import NDArray

Colour = NDArray[np.float32]


def hsv(hue_deg: float, saturation: float, value: float) -> Colour:
    """A colour from hue in degrees, saturation and value."""
    return np.array(colorsys.hsv_to_rgb((hue_deg % 360) / 360, saturation, value)[::-1], dtype=np.float32)


def random_colour(rng: np.random.Generator, white: float = 0.2) -> Colour:
    """Any colour; white with the chance given."""
    if rng.random() < white:
        return hsv(rng.uniform(0, 360), rng.uniform(0, 0.08), rng.uniform(0.8, 1.0))
    return hsv(rng.uniform(0, 360), rng.uniform(0.1, 1.0) ** 0.7, rng.uniform(0.05, 0.9))
