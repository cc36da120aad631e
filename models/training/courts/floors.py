"""Grounds that sports are played on, as colours (H, W, 3) over a patch of the plane."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from models.training.drawing.colours import Colour, hsv
from models.training.drawing.noise import Noise, Patch, Plane, bands, mix, smooth_step

Floor = Callable[[np.random.Generator, Patch], Plane]


def random_floor(rng: np.random.Generator, patch: Patch) -> Plane:
    """Any ground; grass twice as often as each of the others."""
    return FLOORS[rng.integers(len(FLOORS))](rng, patch)


def _plain(colour: Colour, tone: Plane) -> Plane:
    return colour * (1 + tone)[..., None]


def _speckle(rng: np.random.Generator, patch: Patch, strength: float, grain: float) -> Plane:
    """Fine grain, patches of some metres, and a slow drift."""
    amplitudes = strength * np.exp(rng.normal(0, 0.6, 4))
    grains = (grain, 4 * grain, float(rng.uniform(0.3, 2)), float(rng.uniform(4, 15)))
    return Noise.draw(rng, dict(zip(grains, amplitudes.tolist(), strict=True))).at(patch)


def _axis(rng: np.random.Generator, patch: Patch) -> tuple[Plane, Plane]:
    """Coordinates along and across a direction, most often one of the field's own."""
    angle = rng.choice([0.0, np.pi / 2, rng.uniform(0, np.pi)], p=[0.45, 0.45, 0.1])
    c, s = np.float32(np.cos(angle)), np.float32(np.sin(angle))
    return c * patch.x + s * patch.y, c * patch.y - s * patch.x


def grass(rng: np.random.Generator, patch: Patch) -> Plane:
    """Turf, mown in bands or not, natural or artificial; now and then as yellow as straw or under snow."""
    colour = hsv(rng.normal(95, 18), rng.uniform(0.15, 0.75), rng.uniform(0.12, 0.65))
    tone = _speckle(rng, patch, float(np.exp(rng.uniform(np.log(0.02), np.log(0.25)))), 0.03)
    if rng.random() < 0.6:
        along, _ = _axis(rng, patch)
        period = float(rng.uniform(3, 16))
        tone += float(rng.uniform(0.03, 0.3)) * bands(along, period, period / 2, patch.axes[1])
    ground = _plain(colour, tone)
    if rng.random() < 0.08:
        drift = Noise.draw(rng, {0.3: 0.3, 1.5: 0.6, 6.0: 0.8}).at(patch)
        ground = mix(ground, np.float32([0.95, 0.93, 0.92]), smooth_step(drift, rng.uniform(0, 1.5), 2.0))
    return ground


def clay(rng: np.random.Generator, patch: Patch) -> Plane:
    """Red or grey sand and brick dust, brushed."""
    colour = hsv(rng.uniform(5, 35), rng.uniform(0.2, 0.7), rng.uniform(0.35, 0.8))
    return _plain(colour, _speckle(rng, patch, 0.06, 0.02))


def hard_court(rng: np.random.Generator, patch: Patch) -> Plane:
    """Acrylic, rubber or asphalt in any colour, grey among them, nearly without texture."""
    saturation = 0.0 if rng.random() < 0.3 else rng.uniform(0.05, 0.8)
    colour = hsv(rng.uniform(0, 360), saturation, rng.uniform(0.12, 0.9))
    return _plain(colour, _speckle(rng, patch, float(np.exp(rng.uniform(np.log(0.004), np.log(0.08)))), 0.01))


def concrete(rng: np.random.Generator, patch: Patch) -> Plane:
    """Slabs with joints, and stains."""
    colour = hsv(rng.uniform(0, 360), rng.uniform(0, 0.12), rng.uniform(0.25, 0.8))
    tone = _speckle(rng, patch, 0.05, 0.02)
    along, across = _axis(rng, patch)
    joint, every = float(rng.uniform(0.005, 0.02)), float(rng.uniform(1, 6))
    for position in (along, across):
        tone -= float(rng.uniform(0.1, 0.6)) * bands(position, every, joint, patch.axes[1])
    return _plain(colour, tone)


def wood(rng: np.random.Generator, patch: Patch) -> Plane:
    """Boards of a parquet, each a little lighter or darker, with joints."""
    colour = hsv(rng.uniform(15, 45), rng.uniform(0.15, 0.65), rng.uniform(0.3, 0.95))
    along, across = _axis(rng, patch)
    width, length = float(rng.uniform(0.05, 0.13)), float(rng.uniform(0.4, 2.4))
    row = np.floor(across / width)
    shift = np.mod(row * 0.618, 1.0) * length
    board = np.floor((along + shift) / length)
    table = rng.normal(0, rng.uniform(0.02, 0.2), 256).astype(np.float32)
    fade = np.clip(1.5 - patch.axes[1] / width, 0.3, 1)
    tone = table[np.mod(row * 37 + board * 101, 256).astype(int)] * fade
    joint = float(rng.uniform(0.001, 0.004))
    tone -= float(rng.uniform(0.1, 0.7)) * bands(across, width, joint, patch.axes[1])
    grain = {0.02: 0.03, 0.3: 0.02, 3.0: 0.04}
    return _plain(colour, tone + Noise.draw(rng, grain).at(patch))


def sand(rng: np.random.Generator, patch: Patch) -> Plane:
    """Beach sand with footprints."""
    colour = hsv(rng.uniform(28, 50), rng.uniform(0.1, 0.45), rng.uniform(0.5, 0.95))
    return _plain(colour, _speckle(rng, patch, 0.08, 0.05) + Noise.draw(rng, {0.25: 0.12}).at(patch))


def ice(rng: np.random.Generator, patch: Patch) -> Plane:
    """Ice with scratches and snow dust."""
    colour = hsv(rng.uniform(180, 230), rng.uniform(0, 0.15), rng.uniform(0.7, 1.0))
    return _plain(colour, _speckle(rng, patch, 0.02, 0.05))


FLOORS: tuple[Floor, ...] = (grass, grass, clay, hard_court, hard_court, concrete, wood, wood, sand, ice)
