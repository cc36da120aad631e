"""Conditions of a rendering: light, weather, state of the pitch, people, lens."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

LIGHTS = ("sun", "cloud", "floodlight")

NAMED: dict[str, dict[str, object]] = {
    "sun": {"light": "sun"},
    "cloud": {"light": "cloud"},
    "floodlight": {"light": "floodlight"},
    "long shadows": {"light": "sun", "long_shadows": 0.8},
    "worn lines": {"light": "cloud", "wear": 0.75},
    "rain": {"light": "cloud", "rain": 0.7},
}
"""What a table of conditions compares, each against fair weather and an ordinary pitch."""


@dataclass(frozen=True)
class Conditions:
    """Light, weather, state of the pitch, people and lens of one rendering.

    `world` seeds everything that stays at its place, `moment` where people stand. Shares are 0..1. `variety`: 0 for a
    well-kept ground and a good camera, 1 for anything that is called a pitch and anything that is called a camera.
    """

    world: int = 0
    moment: int = 0
    variety: float = 0.0
    light: str = "sun"
    turf: str = "natural"
    long_shadows: float = 0.0
    wear: float = 0.15  # of grass and of paint
    swell: float = 1.0  # of the ground, 1 for one to two centimetres
    wobble: float = 1.0  # of the paint, 1 for lines that are half a centimetre beside themselves
    mowing: float = 0.5  # contrast of the stripes
    players: int = 22
    other_lines: bool = False  # of another sport, coloured
    lettering: bool = True
    rain: float = 0.0
    fog: float = 0.0
    snow: float = 0.0
    noise: float = 0.15
    blur: float = 0.2
    sharpening: float = 0.3
    fringe: float = 0.2
    jpeg_quality: int = 92

    @classmethod
    def fair(cls, world: int = 0) -> Conditions:
        """A clean, sunny afternoon on well-kept natural grass."""
        return cls(world=world)

    @classmethod
    def named(cls, name: str, rng: np.random.Generator) -> Conditions:
        """Return one of `NAMED`; conditions that it does not name are random within fair weather."""
        fair = {"long_shadows": 0.0, "rain": 0.0, "fog": 0.0, "snow": 0.0, "wear": 0.15}
        return replace(cls.random(rng), **{**fair, **NAMED[name]})

    @classmethod
    def random(cls, rng: np.random.Generator) -> Conditions:
        """Anything a camera beside a pitch meets in a year, the bad days more often than they come."""

        def sometimes(chance: float) -> float:
            return float(rng.uniform(0.1, 1.0)) if rng.random() < chance else 0.0

        return cls(
            world=int(rng.integers(2**31)),
            moment=int(rng.integers(2**31)),
            variety=1.0,
            light=str(rng.choice(LIGHTS, p=[0.45, 0.4, 0.15])),
            turf=str(rng.choice(["natural", "artificial"])),
            long_shadows=sometimes(0.3),
            wear=float(rng.beta(1.2, 2.5)),
            mowing=float(rng.uniform(0, 1)) if rng.random() < 0.8 else 0.0,
            players=int(rng.integers(0, 36)),
            other_lines=bool(rng.random() < 0.3),
            lettering=bool(rng.random() < 0.7),
            rain=sometimes(0.12),
            fog=sometimes(0.15),
            snow=sometimes(0.06),
            noise=float(rng.beta(1.2, 2.5)),
            blur=float(rng.beta(1.2, 2.5)),
            sharpening=float(rng.uniform(0, 1)) if rng.random() < 0.75 else 0.0,
            fringe=float(rng.beta(1, 2)),
            jpeg_quality=int(rng.integers(45, 98)),
        )
