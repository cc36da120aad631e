"""What there is to see: the conditions of a rendering, the world around a pitch, and random venues and cameras.

A world hangs on its seed alone: the same seed gives the same wear, lettering, trees and players at the same places,
whoever looks.
"""

from __future__ import annotations

import colorsys
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from models.training.noise import Noise
from worker.calibration.camera import Camera, Intrinsics, Pose
from worker.calibration.field import Field

Colour = NDArray[np.float32]  # blue, green, red in 0..1 as displayed

LIGHTS = ("sun", "cloud", "floodlight")
SIDES = ("near", "far", "left", "right")
SIZES = ((1280, 720), (1920, 1080), (1920, 1080), (2560, 1440), (2688, 1520), (3072, 1728), (3840, 2160), (3840, 2160))


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
class Letters:
    """White lettering or a logo on the ground: a picture of coverage, its corner, its axes and its texel in metres."""

    picture: NDArray[np.float32]
    corner: tuple[float, float]
    along: tuple[float, float]
    texel: float
    colour: Colour


@dataclass(frozen=True)
class World:
    """Everything that stays at its place around one pitch."""

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
    strips: tuple[Colour, ...] = field(default=())


def hsv(hue_deg: float, saturation: float, value: float) -> Colour:
    """A colour from hue in degrees, saturation and value."""
    return np.array(colorsys.hsv_to_rgb((hue_deg % 360) / 360, saturation, value)[::-1], dtype=np.float32)


def random_colour(rng: np.random.Generator, white: float = 0.2) -> Colour:
    """Any colour; white with the chance given."""
    if rng.random() < white:
        return hsv(rng.uniform(0, 360), rng.uniform(0, 0.08), rng.uniform(0.8, 1.0))
    return hsv(rng.uniform(0, 360), rng.uniform(0.1, 1.0) ** 0.7, rng.uniform(0.05, 0.9))


def build_world(pitch: Field, conditions: Conditions) -> World:
    """The world of a seed around a pitch."""
    from models.training.lettering import random_letters

    rng = np.random.default_rng([conditions.world, 17])
    grass, other = _grass(rng, conditions)
    zones = _zones(rng, grass)
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
        paint=_paint(rng),
        paint_noise=Noise.draw(rng, {0.01: 0.35, 0.03: 0.3, 0.1: 0.3, 0.4: 0.3, 1.5: 0.4, 6.0: 0.4}),
        paint_opacity=float(rng.uniform(0.55, 1.0)),
        edge_noise=Noise.draw(rng, {0.015: 0.5, 0.05: 0.5, 0.3: 0.4, 3.0: 0.5}),
        bumps=Noise.draw(rng, {7.0: 0.012, 20.0: 0.02}),
        cloud_noise=Noise.draw(rng, {25.0: 0.7, 60.0: 1.0}),
        snow_noise=Noise.draw(rng, {0.3: 0.3, 1.5: 0.6, 6.0: 0.8}),
        zones=zones,
        walls=_walls(rng),
        letters=random_letters(rng, pitch) if conditions.lettering else (),
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
    return hsv(hue, rng.uniform(0, 0.16), rng.uniform(0.72, 1.0))


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
    """What stands around the pitch, on every side from far to near."""
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


def random_field(rng: np.random.Generator) -> Field:
    """A pitch within Law 1, from flat to a crown of 0.6 m."""
    length, width = float(rng.uniform(90, 120)), float(rng.uniform(45, 90))
    if rng.random() < 0.6:
        length, width = 105.0, 68.0
    crown, half_ridge = float(rng.uniform(0, 0.6)), float(rng.uniform(0, 0.45 * length))
    ridge = np.array([[-half_ridge, 0.0, crown], [half_ridge, 0.0, crown]])
    return Field(length, width, float(rng.uniform(0.09, 0.125)), ridge if rng.random() < 0.8 else None)


def random_intrinsics(rng: np.random.Generator) -> Intrinsics:
    """A lens of 60 to 120 degrees across (now and then a longer one), with the distortion such lenses have."""
    width, height = SIZES[rng.integers(len(SIZES))]
    across = np.radians(rng.uniform(60, 120) if rng.random() < 0.8 else rng.uniform(25, 60))
    k1 = float(rng.uniform(-0.38, -0.2) if rng.random() < 0.6 else rng.uniform(-0.2, 0.03))
    # Above 0.45 k1² the radius grows everywhere, so that every pixel has a ray.
    k2 = k1 * k1 * float(rng.uniform(0.6, 1.1))
    edge = np.tan(across / 2)
    focal = (width / 2) / (edge * (1 + k1 * edge**2 + k2 * edge**4))
    centre = np.array([width, height]) / 2 + rng.normal(0, 0.02, 2) * width
    matrix = np.array([[focal, 0, centre[0]], [0, focal * rng.uniform(0.998, 1.002), centre[1]], [0, 0, 1]])
    tangential = rng.normal(0, 0.0005, 2)
    return Intrinsics(matrix, np.array([k1, k2, *tangential, 0.0]), (width, height))


def random_camera(rng: np.random.Generator, pitch: Field) -> Camera:
    """A camera 5 to 40 m high on any side of the pitch, that looks at a place on it."""
    height = float(np.exp(rng.uniform(np.log(5), np.log(40 if rng.random() < 0.5 else 15))))
    behind = float(rng.uniform(1, 12) if rng.random() < 0.5 else rng.uniform(5, 45))
    along = float(np.clip(rng.normal(0, 0.25), -0.6, 0.6))
    side = rng.choice(SIDES, p=[0.35, 0.25, 0.2, 0.2])
    sign = -1.0 if side in ("near", "left") else 1.0
    if side in ("near", "far"):
        position = np.array([along * pitch.length, sign * (pitch.width / 2 + behind), height])
    else:
        position = np.array([sign * (pitch.length / 2 + behind), along * pitch.width, height])
    target = np.array([rng.uniform(-0.5, 0.5) * pitch.length, rng.uniform(-0.5, 0.5) * pitch.width, 0.0])
    pose = Pose.looking_at(position, target, roll_deg=float(rng.normal(0, 3)))
    return Camera("camera", random_intrinsics(rng), pose)


def calmer(conditions: Conditions, **changes: object) -> Conditions:
    """The same with some fields replaced."""
    return replace(conditions, **changes)  # type: ignore[arg-type]
