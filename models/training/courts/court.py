"""Crops of courts that exist nowhere: cheap, endlessly varied, none made twice.

    crop = random_court(np.random.default_rng(7), 224)
    frame = render_court(pitch, camera, np.random.default_rng(7))

The counterpart of `pitches/render.py`, which shows one kind of field in detail: here the ground, the paint and the
camera are anything, and nothing is made to be pretty. A crop takes about 70 ms.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from fields.shapes import COLOURS, WHITE
from models.training.courts.capture import Capture, random_capture, random_frame_capture
from models.training.courts.clutter import backdrop, draw_clutter
from models.training.courts.floors import Floor, random_floor
from models.training.courts.layouts import PAINTS, Layout, Stripe, field_layout, random_layout
from models.training.courts.views import FieldView, View, Window
from models.training.drawing.colours import Colour, hsv, random_colour
from models.training.drawing.noise import Noise, Patch, Plane, smooth_step
from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.field import Field

NEAREST_M = 0.3
FINER = 4
"""Paint is drawn at so many times the picture's detail, each way."""
THINNEST_PX = 1.5
"""As wide as a line is at least in the target: far ones are fractions of a pixel."""
STEP_PX = 16
"""A line across the picture bends every so many pixels with the lens, sixteen times at least."""
PAINT_SHARES = (0.6, 0.1, 0.08, 0.08, 0.07, 0.07)
"""How often paint is white, yellow, black, blue, red, or of any colour."""
LEAST_CONTRAST = 0.2
"""In the channel that shows it best, 0..1, between paint and the ground that somebody chose it for."""
FAINTEST = 0.02
"""Contrast, in 0..1, below which nobody is asked to see a line, and none is blamed for seeing it."""


@dataclass(frozen=True)
class Court:
    """A crop and what is true about it.

    `frame` (S, S, 3) uint8, blue green red; `target` (S, S) float32: share of the pixel that paint covers, lines at
    least 1.5 px wide; `asked` (S, S) float32: 0 where paint is too faint to be called either way, else 1.
    """

    frame: NDArray[np.uint8]
    target: Plane
    asked: Plane


def random_court(rng: np.random.Generator, size: int) -> Court:
    """A crop of `size` px of a ground, a camera and a moment that exist nowhere else."""
    layout = random_layout(rng)
    window = _random_window(rng, layout, size)
    return _taken(rng, Subject(window, layout, random_floor, _random_paints, random_capture), size)


def render_court(pitch: Field, camera: Camera, rng: np.random.Generator, floor: Floor = random_floor) -> Court:
    """The whole frame of a camera, as wide as it is high, that looks at a field on a `floor` that it might lie on.

    Lines lie where `Camera.project` puts them. They have their markings' colours; those that are to be white are white
    four times of five, and never what cannot be told from the ground.
    """
    width, height = camera.intrinsics.size
    if width != height:
        raise ValueError(f"courts are rendered as wide as they are high, this frame has {width} x {height} pixels")
    layout, colours = field_layout(pitch)

    def paints(rng: np.random.Generator, ground: Colour) -> list[Colour]:
        return [_paint_of(rng, colour, ground) for colour in colours]

    return _taken(rng, Subject(FieldView(pitch, camera), layout, floor, paints, random_frame_capture), width)


@dataclass(frozen=True)
class Subject:
    """The contents of a picture, and random choices for all that they leave open.

    `paints`: the colours of paint by their numbers, on a ground of some colour.
    """

    view: View
    layout: Layout
    floor: Floor
    paints: Callable[[np.random.Generator, Colour], Sequence[Colour]]
    capture: Callable[[np.random.Generator], Capture]


def _taken(rng: np.random.Generator, subject: Subject, size: int) -> Court:
    """A layout on a ground, with what stands around and in front of it."""
    view = subject.view
    patch = view.patch(size)
    bare = _ground(rng, subject, patch, size)
    colours = subject.paints(rng, np.median(bare[patch.seen], axis=0) if patch.seen.any() else bare.mean(axis=(0, 1)))
    painted, target = _painted(rng, subject, patch, bare, colours, size)
    scene = _lit(rng, patch, np.stack([bare, painted]))
    hidden = np.where(patch.seen, 0, 1).astype(np.float32)
    behind = backdrop(rng, size) if not patch.seen.all() else None
    pixels_per_metre = view.focal / max(float(np.median(patch.depth[patch.seen])) if patch.seen.any() else 50, 1)
    state = rng.bit_generator.state
    for picture in scene:
        if behind is not None:
            picture[~patch.seen] = behind[~patch.seen]
        # The same things in front of both pictures.
        rng.bit_generator.state = state
        draw_clutter(rng, picture, hidden, pixels_per_metre)
    capture = subject.capture(rng)
    without, with_paint = (capture.seen(picture) for picture in scene)
    contrast = cv2.dilate(np.abs(with_paint - without).max(axis=-1), np.ones((3, 3)))
    target = target * (1 - hidden)
    faint = (target > 0.05) & (contrast < max(FAINTEST, 1.5 * capture.noise))
    return Court(capture.delivered(with_paint, rng), np.where(faint, 0, target), 1 - faint.astype(np.float32))


def _random_window(rng: np.random.Generator, layout: Layout, size: int) -> Window:
    """A camera that looks at paint, mostly, from any height and distance, with lines 0.7 to 50 px wide."""
    stripe = layout.stripes[rng.integers(len(layout.stripes))]
    piece = rng.integers(len(stripe.points) - 1)
    focus = stripe.points[piece] + rng.random() * (stripe.points[piece + 1] - stripe.points[piece])
    if rng.random() < 0.15:
        focus = rng.uniform(-1.15, 1.15, 2) * layout.half
    lowest, highest = ((4, 20), (15, 50), (45, 88))[rng.choice(3, p=[0.5, 0.35, 0.15])]
    elevation, heading = np.radians(rng.uniform(lowest, highest)), rng.uniform(0, 2 * np.pi)
    distance = float(np.exp(rng.uniform(np.log(4), np.log(120))))
    wide = float(np.exp(rng.uniform(np.log(0.7), np.log(12) if rng.random() < 0.85 else np.log(50))))
    focal = float(np.clip(wide * distance / min(stripe.width, 0.2), 250, 20000))
    back = np.array([np.cos(elevation) * np.cos(heading), np.cos(elevation) * np.sin(heading), np.sin(elevation)])
    forward = -back
    right = np.array([np.sin(heading), -np.cos(heading), 0.0]) * -1
    down = np.cross(forward, right)
    roll = rng.normal(0, np.radians(5))
    c, s = np.cos(roll), np.sin(roll)
    rotation = np.stack([c * right + s * down, -s * right + c * down, forward])
    reach = rng.uniform(800, 2500)
    bend = rng.uniform(-0.25, 0.05) / reach**2 if rng.random() < 0.6 else 0.0
    principal = rng.uniform(0.05, 0.95, 2) * size
    return Window(
        np.array([*focus, 0.0]) + distance * back, rotation, focal, principal, bend,
        principal + rng.uniform(-0.7, 0.7, 2) * reach,
    )  # fmt: skip


def _ground(rng: np.random.Generator, subject: Subject, patch: Patch, size: int) -> Plane:
    """The court's floor, another one beyond some line of the field, and areas of other colours, edge on line."""
    view, layout = subject.view, subject.layout
    ground = subject.floor(rng, patch)
    if rng.random() < 0.6:
        beyond = layout.half + (0 if rng.random() < 0.5 else rng.uniform(0, 5, 2))
        inner = _covered(view, [_rectangle(-beyond, beyond)], size)
        outer = random_floor(rng, patch) if rng.random() < 0.7 else ground * random_colour(rng, 0.3) * np.float32(1.3)
        ground = outer + inner[..., None] * (ground - outer)
    corners = np.concatenate([stripe.points for stripe in layout.stripes])
    for _ in range(rng.integers(0, 4) if rng.random() < 0.4 else 0):
        ends = corners[rng.integers(len(corners), size=2)]
        area = _covered(view, [_rectangle(ends.min(axis=0), ends.max(axis=0))], size) * np.float32(rng.uniform(0.4, 1))
        colour = random_colour(rng, 0.1)
        ground = ground + area[..., None] * (
            ground.mean() * 1.5 * colour - ground if rng.random() < 0.5 else colour - ground
        )
    return np.clip(ground, 0, 1).astype(np.float32)


def _rectangle(low: Array, high: Array) -> Array:
    return np.array([low, [high[0], low[1]], high, [low[0], high[1]]])


def _painted(
    rng: np.random.Generator, subject: Subject, patch: Patch, bare: Plane, colours: Sequence[Colour], size: int
) -> tuple[Plane, Plane]:
    """The ground with its paint, and the target (S, S)."""
    painted, outlines = bare, []
    strips = [strip for stripe in subject.layout.stripes for strip in _strips(subject.view, stripe, size)]
    for number, colour in enumerate(colours):
        chosen = [strip for strip in strips if strip.paint == number]
        if not chosen:
            continue
        share = _covered_px([strip.outline(0.0) for strip in chosen], size)
        wear = Noise.draw(rng, {0.02: 0.3, 0.1: 0.4, 0.5: 0.4, 3.0: 0.4}).at(patch)
        opacity = 1 - float(rng.beta(1, 3)) * smooth_step(wear, -0.5, 2.0)
        opacity = opacity * np.float32(rng.uniform(0.55, 1))
        painted = painted + (share * opacity)[..., None] * (colour - painted)
        outlines += [strip.outline(THINNEST_PX) for strip in chosen]
    return painted.astype(np.float32), _covered_px(outlines, size)


def _random_paints(rng: np.random.Generator, _ground: Colour) -> list[Colour]:
    return [random_paint(rng) for _ in range(PAINTS)]


def _paint_of(rng: np.random.Generator, named: str, ground: Colour) -> Colour:
    """Paint as it is called, as far as it can be told from a `ground` that it would be chosen for."""
    colour = paint(rng, named if named != WHITE or rng.random() < 0.8 else str(rng.choice(COLOURS)))
    while np.abs(colour - ground).max() < LEAST_CONTRAST:
        colour = paint(rng, str(rng.choice(COLOURS)))
    return colour


def random_paint(rng: np.random.Generator) -> Colour:
    """White with a cast more often than not; yellow, black, blue, red, or anything."""
    return paint(rng, str(rng.choice(["white", "yellow", "black", "blue", "red", "any"], p=PAINT_SHARES)))


def paint(rng: np.random.Generator, named: str) -> Colour:
    """Paint of a colour of `fields.shapes.COLOURS`, of `#rrggbb`, or of any, as it is called."""
    match named:
        case "white":
            return hsv(rng.uniform(0, 360), rng.uniform(0, 0.2), rng.uniform(0.75, 1.0))
        case "yellow":
            return hsv(rng.uniform(45, 65), rng.uniform(0.5, 1.0), rng.uniform(0.7, 1.0))
        case "black":
            return hsv(rng.uniform(0, 360), rng.uniform(0, 0.3), rng.uniform(0.0, 0.2))
        case "blue":
            return hsv(rng.uniform(205, 245), rng.uniform(0.4, 1.0), rng.uniform(0.3, 0.9))
        case "red":
            return hsv(rng.uniform(-12, 12), rng.uniform(0.5, 1.0), rng.uniform(0.4, 0.9))
        case "green":
            return hsv(rng.uniform(95, 150), rng.uniform(0.5, 1.0), rng.uniform(0.3, 0.8))
        case "orange":
            return hsv(rng.uniform(20, 38), rng.uniform(0.7, 1.0), rng.uniform(0.7, 1.0))
        case str() if named.startswith("#"):
            return np.array([int(named[at : at + 2], 16) for at in (5, 3, 1)], np.float32) / 255
        case _:
            return random_colour(rng)


@dataclass(frozen=True)
class Strip:
    """A stretch of paint in the picture: `middle` (n, 2) px, `side` (n, 2) px from there to its edge on one side.

    `thick` (n,): its width in px, across itself.
    """

    middle: Array
    side: Array
    thick: Array
    paint: int

    def outline(self, thinnest_px: float) -> Array:
        """The polygon (2 n, 2) of the paint, at least so many px wide."""
        side = self.side * np.maximum(1, thinnest_px / np.maximum(self.thick, 1e-3))[:, None]
        return np.concatenate([self.middle + side, (self.middle - side)[::-1]])


def _strips(view: View, stripe: Stripe, size: int) -> list[Strip]:
    """The paint of a stripe that comes into the picture."""
    strips = []
    for along in _pieces(stripe.points, view, size):
        tangent = np.gradient(along, axis=0)
        tangent /= np.linalg.norm(tangent, axis=1, keepdims=True) + 1e-12
        half = stripe.width / 2 * np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
        middle, depth = view.project(along)
        edge, _ = view.project(along + half)
        direction = np.gradient(middle, axis=0)
        direction /= np.linalg.norm(direction, axis=1, keepdims=True) + 1e-12
        side = edge - middle
        thick = 2 * np.abs(side[:, 0] * direction[:, 1] - side[:, 1] * direction[:, 0])
        if depth.min() > NEAREST_M and np.abs(side).max() < 4 * size:
            strips.append(Strip(middle, side, thick, stripe.paint))
    return strips


def _pieces(points: Array, view: View, size: int) -> list[Array]:
    """The stretches (n, 2) of a polyline that come into the picture, in steps short enough to bend."""
    if len(points) > 8:
        share = np.linspace(0, len(points) - 1, 2 * len(points))
        whole = np.stack([np.interp(share, np.arange(len(points)), points[:, i]) for i in (0, 1)], axis=1)
        runs = np.flatnonzero(_in_picture(whole, view, size))
        if len(runs) == 0:
            return []
        return [
            whole[max(run[0] - 1, 0) : run[-1] + 2] for run in np.split(runs, np.flatnonzero(np.diff(runs) > 1) + 1)
        ]
    pieces = []
    for a, b in pairwise(points):
        low, high = 0.0, 1.0
        # Twice, for a picture that shows a hundredth of a line.
        for _ in range(2):
            share = np.linspace(low, high, 40)
            kept = np.flatnonzero(_in_picture(a + share[:, None] * (b - a), view, size))
            if len(kept) == 0:
                break
            low, high = share[max(kept[0] - 1, 0)], share[min(kept[-1] + 1, 39)]
        else:
            pieces.append(a + np.linspace(low, high, max(16, size // STEP_PX))[:, None] * (b - a))
    return pieces


def _in_picture(xy: Array, view: View, size: int) -> NDArray[np.bool_]:
    pixel, depth = view.project(xy)
    return (depth > NEAREST_M) & (np.abs(pixel - size / 2) < 0.75 * size).all(axis=1)


def _covered(view: View, polygons: list[Array], size: int) -> Plane:
    """Share (S, S) of pixels inside polygons on the ground; their edges may be cut by the camera's plane."""
    strips = []
    for polygon in polygons:
        closed = np.concatenate([polygon, polygon[:1]])
        share = np.linspace(0, 1, 100)[:, None]
        dense = np.concatenate([a + share * (b - a) for a, b in pairwise(closed)])
        pixel, depth = view.project(dense)
        strips.append(pixel[depth > 0.2])
    return _covered_px([strip for strip in strips if len(strip) > 2], size)


def _covered_px(outlines: list[Array], size: int) -> Plane:
    """Share (S, S) of pixels inside any outline."""
    fine = np.zeros((size * FINER, size * FINER), np.uint8)
    for outline in outlines:
        if not np.isfinite(outline).all():
            continue
        corners = np.round((np.clip(outline, -20 * size, 20 * size) * FINER + (FINER - 1) / 2) * 16).astype(np.int32)
        cv2.fillPoly(fine, [corners], 255, cv2.LINE_8, 4)
    share = cv2.resize(fine, (size, size), interpolation=cv2.INTER_AREA)
    return share.astype(np.float32) / 255


def _lit(rng: np.random.Generator, patch: Patch, pictures: Plane) -> Plane:
    """Shadows with straight edges, a drift of light, mirror images of lamps and windows on glossy ground."""
    if rng.random() < 0.35:
        angle, at = rng.uniform(0, 2 * np.pi), rng.normal(0, 5, 2)
        offset = np.cos(angle) * (patch.x - at[0]) + np.sin(angle) * (patch.y - at[1])
        shadow = smooth_step(offset / np.maximum(patch.axes[1], 0.02), -rng.uniform(0.5, 6), rng.uniform(0.5, 6))
        if rng.random() < 0.4:
            width = float(np.exp(rng.uniform(np.log(0.1), np.log(6))))
            shadow *= 1 - smooth_step((offset - width) / np.maximum(patch.axes[1], 0.02), -2.0, 2.0)
        pictures = pictures * (1 - np.float32(rng.uniform(0.2, 0.75)) * shadow)[..., None]
    if rng.random() < 0.35:
        pictures = pictures * (1 - _cast_shadows(rng, pictures.shape[1:3]))[..., None]
    if rng.random() < 0.2:
        size = pictures.shape[1]
        gloss = np.zeros((size, size), np.float32)
        for _ in range(rng.integers(1, 4)):
            x, y = rng.uniform(0, size, 2).astype(int).tolist()
            axes = (int(rng.uniform(4, 60)), int(rng.uniform(15, 150)))
            cv2.ellipse(gloss, (x, y), axes, 0, 0, 360, float(rng.uniform(0.2, 0.9)), -1)
        gloss = cv2.GaussianBlur(gloss, (0, 0), float(rng.uniform(2, 25)))
        pictures = pictures + gloss[..., None] * (1 - pictures) * np.float32(0.8)
    return np.ascontiguousarray(pictures, dtype=np.float32)


def _cast_shadows(rng: np.random.Generator, size: tuple[int, int]) -> Plane:
    """Draw shadows of people, as the share 0..1 of the light that they take (H, W): short dark streaks, all one way."""
    streaks = np.zeros(size, np.float32)
    way, strength = rng.uniform(0, 180), float(rng.uniform(0.25, 0.7))
    for _ in range(rng.integers(1, 7)):
        x, y = (rng.uniform(0, 1, 2) * size[::-1]).astype(int).tolist()
        long = float(np.exp(rng.uniform(np.log(4), np.log(60))))
        axes = (int(long), max(1, int(long * rng.uniform(0.05, 0.25))))
        cv2.ellipse(streaks, (x, y), axes, way + rng.normal(0, 3), 0, 360, strength, -1, cv2.LINE_AA)
    return cv2.GaussianBlur(streaks, (0, 0), float(rng.uniform(0.5, 2)))
