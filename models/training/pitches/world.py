"""The fixed surroundings of one pitch: turf, paint, belts, walls, lettering, sun.

A world hangs on its seed alone: the same seed gives the same wear, lettering, trees and players at the same places,
whoever looks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.training.drawing.colours import Colour, hsv, random_colour
from models.training.drawing.lettering import Letters, random_letters
from models.training.drawing.noise import Noise
from models.training.pitches.conditions import Conditions
from worker.calibration.geometry.field import Field

SIDES = ("near", "far", "left", "right")


@dataclass(frozen=True)
class Zone:
    """A belt of ground outside the pitch, from `start` metres outside the boundary outwards."""

    start: float
    kind: str  # plain, grass, track, terrace
    colour: Colour
    stripe: Colour
    period: float
    width: float


@dataclass(frozen=True)
class Wall:
    """A plane standing (or leaning back by `lean` metres per metre of height) beside one side of the pitch."""

    side: str
    kind: str  # trees, fence, hoarding, stand, building, board
    distance: float
    height: float
    lean: float
    extent: tuple[float, float]
    colour: Colour
    accent: Colour
    period: float
    seed: int
    noise: Noise


@dataclass(frozen=True)
class World:
    """The fixed surroundings of one pitch."""

    grass: tuple[Colour, Colour]
    soil: Colour
    stripe_period: float
    stripe_angle: float
    stripe_kind: str
    turf_noise: Noise
    tint_noise: Noise
    tint: Colour
    wear_noise: Noise
    paint: Colour
    paint_noise: Noise
    paint_opacity: float
    edge_noise: Noise
    bumps: Noise
    cloud_noise: Noise
    snow_noise: Noise
    zones: tuple[Zone, ...]
    walls: tuple[Wall, ...]
    letters: tuple[Letters, ...]
    sun: tuple[float, float]  # azimuth, elevation, rad
    shadow_side: str
    shadow_reach: float
    masts: tuple[tuple[float, float], ...]
    goal_style: int
    strips: tuple[Colour, ...]


def build_world(pitch: Field, conditions: Conditions) -> World:
    """The world of a seed around a pitch."""
    rng = np.random.default_rng([conditions.world, 17])
    grass, other = _grass(rng, conditions)
    zones = _zones(rng, grass)
    paint = _paint(rng)
    return World(
        grass=(grass, other),
        soil=hsv(rng.uniform(20, 55), rng.uniform(0.15, 0.5), rng.uniform(0.3, 0.65)),
        stripe_period=float(rng.uniform(3.5, 18)),
        stripe_angle=float(rng.choice([0, 0, np.pi / 2, np.pi / 2, rng.uniform(0, np.pi)])),
        stripe_kind=str(rng.choice(["stripes", "stripes", "checks", "rings"])),
        turf_noise=_turf(rng, conditions),
        tint_noise=Noise.draw(rng, {0.1: 0.15, 0.5: 0.25, 2.5: 0.4, 11.0: 0.6}),
        tint=((0.2 + 0.8 * conditions.variety) * rng.normal(0, 0.05, 3)).astype(np.float32),
        wear_noise=Noise.draw(rng, {0.05: 0.25, 0.2: 0.35, 0.8: 0.5, 3.0: 0.5, 9.0: 0.3}),
        paint=paint,
        paint_noise=Noise.draw(rng, {0.01: 0.35, 0.03: 0.3, 0.1: 0.3, 0.4: 0.3, 1.5: 0.4, 6.0: 0.4}),
        paint_opacity=float(1 - (0.4 + 0.6 * conditions.variety) * rng.uniform(0, 0.45)),
        edge_noise=Noise.draw(rng, {0.015: 0.5, 0.05: 0.5, 0.3: 0.4, 3.0: 0.5}),
        bumps=Noise.draw(rng, {7.0: 0.012 * conditions.swell, 20.0: 0.02 * conditions.swell}),
        cloud_noise=Noise.draw(rng, {25.0: 0.7, 60.0: 1.0}),
        snow_noise=Noise.draw(rng, {0.3: 0.3, 1.5: 0.6, 6.0: 0.8}),
        zones=zones,
        walls=_walls(rng),
        letters=random_letters(rng, pitch, paint) if conditions.lettering else (),
        sun=(
            float(rng.uniform(0, 2 * np.pi)),
            float(np.radians(rng.uniform(8, 22) if conditions.long_shadows else rng.uniform(25, 65))),
        ),
        shadow_side=str(rng.choice(SIDES)),
        shadow_reach=float(rng.uniform(-8, 60)),
        masts=tuple((float(a), float(b)) for a, b in rng.uniform(-0.7, 0.7, (rng.integers(0, 7), 2))),
        goal_style=int(rng.integers(1 << 30)),
        strips=tuple(random_colour(rng, 0.4) for _ in range(6)),
    )


def _turf(rng: np.random.Generator, conditions: Conditions) -> Noise:
    """Light and dark of the turf: blades and filling first on artificial turf, tufts and patches too on natural."""
    blades, tufts, patches = np.exp(rng.uniform(np.log([0.12, 0.03, 0.02]), np.log([0.6, 0.3, 0.12])))
    if conditions.turf == "artificial":
        blades, tufts, patches = 1.3 * blades, 0.35 * tufts, 0.6 * patches
    calm = 0.4 + 0.6 * conditions.variety
    blades, tufts, patches = (0.35 + 0.65 * conditions.variety) * blades, calm * tufts, calm * patches
    weights = rng.uniform(0.4, 1.2, 8)
    grains = (0.008, 0.02, 0.05, 0.13, 0.4, 1.3, 5.0, 18.0)
    sizes = (blades, blades, 0.7 * tufts + 0.2 * blades, tufts, 0.6 * tufts, 0.4 * tufts, patches, patches)
    return Noise.draw(rng, {g: float(s * w) for g, s, w in zip(grains, sizes, weights, strict=True)})


def _grass(rng: np.random.Generator, conditions: Conditions) -> tuple[Colour, Colour]:
    """Two colours of the mowing pattern."""
    ordinary, anything = np.array([95, 0.55, 0.5]), rng.uniform([65, 0.18, 0.26], [150, 0.7, 0.62])
    hue, saturation, value = ordinary + (0.25 + 0.75 * conditions.variety) * (anything - ordinary)
    contrast = conditions.mowing
    light = hsv(hue, saturation, value * (1 + 0.18 * contrast))
    dark = hsv(
        hue + contrast * rng.normal(0, 14),
        saturation * (1 + contrast * rng.normal(0, 0.15)),
        value * (1 - 0.1 * contrast),
    )
    return light, np.clip(dark, 0, 1)


def _paint(rng: np.random.Generator) -> Colour:
    """White as cameras show it: from cream over grey to a strong blue or violet cast."""
    hue = rng.choice([rng.uniform(40, 60), rng.uniform(200, 280), rng.uniform(0, 360)], p=[0.25, 0.55, 0.2])
    return hsv(hue, rng.uniform(0, 0.22), rng.uniform(0.72, 1.0))


def _zones(rng: np.random.Generator, grass: Colour) -> tuple[Zone, ...]:
    """Belts around the pitch: run-off, track, asphalt, terraces with benches, a meadow."""
    zones = []
    start = float(rng.uniform(1.0, 12.0))
    for _ in range(int(rng.integers(1, 4))):
        kind = str(rng.choice(["plain", "grass", "track", "terrace"], p=[0.3, 0.2, 0.25, 0.25]))
        if kind == "track":
            colour = hsv(
                rng.choice([8, 15, 210, 0]) + rng.normal(0, 6), rng.uniform(0.25, 0.7), rng.uniform(0.35, 0.75)
            )
            period, width = 1.22, 0.05
        elif kind == "terrace":
            colour = hsv(rng.uniform(0, 360), rng.uniform(0, 0.15), rng.uniform(0.35, 0.75))
            period, width = rng.uniform(0.7, 2.5), rng.uniform(0.12, 0.5)
        elif kind == "grass":
            colour, period, width = grass * np.float32(rng.uniform(0.7, 1.2)), 1.0, 0.0
        else:
            colour = hsv(rng.uniform(0, 360), rng.uniform(0, 0.5), rng.uniform(0.2, 0.85))
            period, width = rng.uniform(0.5, 4.0), (rng.uniform(0.01, 0.08) if rng.random() < 0.5 else 0.0)
        stripe = random_colour(rng, 0.75)
        if kind == "plain":
            stripe = colour * np.float32(rng.uniform(0.5, 1.3))
        zones.append(Zone(start, kind, colour, np.clip(stripe, 0, 1), float(period), float(width)))
        start += float(rng.uniform(0.3, 12.0))
    meadow = grass * np.float32(rng.uniform(0.5, 1.2)) if rng.random() < 0.85 else random_colour(rng, 0.1)
    zones.append(Zone(start + float(rng.uniform(2, 15)), "grass", np.clip(meadow, 0, 1), meadow, 1.0, 0.0))
    return tuple(zones)


def _walls(rng: np.random.Generator) -> tuple[Wall, ...]:
    """Draw random walls around the pitch, on every side from far to near."""
    heights = {
        "building": (4, 15, 0.0),
        "trees": (4, 16, 0.0),
        "stand": (1.2, 14, 1.7),
        "fence": (1.0, 8, 0.0),
        "board": (1.5, 4, 0.0),
        "hoarding": (0.6, 1.1, 0.0),
    }
    chances = {"building": 0.3, "trees": 0.7, "stand": 0.45, "fence": 0.55, "board": 0.3, "hoarding": 0.35}
    walls = []
    for side in SIDES:
        if rng.random() < 0.7:  # woods in the distance
            colour = hsv(rng.uniform(60, 130), rng.uniform(0.2, 0.6), rng.uniform(0.2, 0.4))
            leaves = Noise.draw(rng, {0.4: 0.5, 1.2: 0.8, 3.5: 0.9, 10.0: 0.5})
            far, tall, seed = float(rng.uniform(90, 300)), float(rng.uniform(8, 22)), int(rng.integers(1 << 30))
            walls.append(Wall(side, "trees", far, tall, 0.0, (-500.0, 500.0), colour, colour, 9.0, seed, leaves))
        distance = float(rng.uniform(25, 60))
        for kind, (low, high, lean) in heights.items():
            distance = max(2.5, distance * float(rng.uniform(0.5, 0.9)))
            if rng.random() > chances[kind]:
                continue
            reach = 90.0
            extent = (-reach, reach)
            if kind in ("building", "board", "stand") or rng.random() < 0.4:
                centre, half = rng.uniform(-50, 50), rng.uniform(3, 8) if kind == "board" else rng.uniform(8, 45)
                extent = (float(centre - half), float(centre + half))
            colour, accent = random_colour(rng, 0.25), random_colour(rng, 0.6)
            if kind == "trees":
                colour = hsv(rng.uniform(50, 140), rng.uniform(0.25, 0.8), rng.uniform(0.2, 0.5))
            if kind == "fence":
                accent = hsv(rng.choice([0, 140, 200]), rng.uniform(0, 0.5), rng.uniform(0.2, 1.0))
            walls.append(
                Wall(
                    side,
                    kind,
                    distance,
                    float(rng.uniform(low, high)),
                    lean * float(rng.uniform(0.7, 1.3)),
                    extent,
                    colour,
                    accent,
                    float(rng.uniform(0.7, 1.1) if kind == "stand" else rng.uniform(1.5, 8)),
                    int(rng.integers(1 << 30)),
                    Noise.draw(rng, {0.04: 0.3, 0.12: 0.6, 0.4: 0.8, 1.2: 0.9, 3.5: 0.9, 10.0: 0.5}),
                )
            )
    return tuple(walls)
