"""Crops of courts that exist nowhere: cheap, endlessly varied, never shown twice.

    crop = random_court(np.random.default_rng(7), 224)

The counterpart of `render.py`, which shows one kind of field in detail: here the ground, the paint and the camera are
anything, and nothing is made to be pretty. A crop takes about 25 ms.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from models.training.capture import random_capture
from models.training.clutter import backdrop, draw_clutter
from models.training.colours import Colour, hsv, random_colour
from models.training.floors import random_floor
from models.training.layouts import PAINTS, Layout, Stripe, random_layout
from models.training.noise import Noise, Patch, Plane, smooth_step
from worker.calibration.scene.camera import Array

NEAREST_M = 0.3
FINER = 4
"""Paint is drawn at so many times the picture's detail, each way."""
THINNEST_PX = 1.5
"""As wide as a line is at least in the target: far ones are fractions of a pixel."""
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


@dataclass(frozen=True)
class Window:
    """A pinhole camera of its own for one crop: pixel = K R (X - centre), bent by `bend` about `pivot`."""

    centre: Array
    rotation: Array
    focal: float
    principal: Array
    bend: float
    pivot: Array

    def project(self, xy: Array) -> tuple[Array, Array]:
        """Pixels (n, 2) and depths (n,) of points (n, 2) on the ground."""
        seen = (np.column_stack([xy, np.zeros(len(xy))]) - self.centre) @ self.rotation.T
        depth = seen[:, 2]
        pixel = self.focal * seen[:, :2] / np.maximum(depth, 1e-3)[:, None] + self.principal
        away = pixel - self.pivot
        return self.pivot + away * (1 + self.bend * (away**2).sum(axis=1, keepdims=True)), depth

    def patch(self, size: int) -> Patch:
        """Where pixels look on the ground, the bend left out."""
        row, column = np.mgrid[0:size, 0:size].astype(np.float32)
        rays = np.stack([(column - self.principal[0]), (row - self.principal[1]), np.full_like(row, self.focal)], -1)
        rays = rays @ self.rotation
        down = rays[..., 2] < -1e-3 * self.focal
        reach = np.where(down, -self.centre[2] / np.minimum(rays[..., 2], -1e-3 * self.focal), 0)
        x, y = (np.float32(self.centre[i] + reach * rays[..., i]) for i in (0, 1))
        return Patch(x, y, np.float32(reach * np.linalg.norm(rays, axis=-1)), down)


def random_court(rng: np.random.Generator, size: int) -> Court:
    """A crop of `size` px of a ground, a camera and a moment that exist nowhere else."""
    layout = random_layout(rng)
    window = _random_window(rng, layout, size)
    patch = window.patch(size)
    bare = _ground(rng, window, patch, layout, size)
    painted, target = _painted(rng, window, patch, layout.stripes, bare, size)
    scene = _lit(rng, patch, np.stack([bare, painted]))
    hidden = np.where(patch.seen, 0, 1).astype(np.float32)
    behind = backdrop(rng, size) if not patch.seen.all() else None
    pixels_per_metre = window.focal / max(float(np.median(patch.depth[patch.seen])) if patch.seen.any() else 50, 1)
    state = rng.bit_generator.state
    for picture in scene:
        if behind is not None:
            picture[~patch.seen] = behind[~patch.seen]
        # The same things in front of both pictures.
        rng.bit_generator.state = state
        draw_clutter(rng, picture, hidden, pixels_per_metre)
    capture = random_capture(rng)
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


def _ground(rng: np.random.Generator, window: Window, patch: Patch, layout: Layout, size: int) -> Plane:
    """The court's floor, another one beyond some line of the field, and areas of other colours, edge on line."""
    ground = random_floor(rng, patch)
    if rng.random() < 0.6:
        beyond = layout.half + (0 if rng.random() < 0.5 else rng.uniform(0, 5, 2))
        inner = _covered(window, [_rectangle(-beyond, beyond)], size)
        outer = random_floor(rng, patch) if rng.random() < 0.7 else ground * random_colour(rng, 0.3) * np.float32(1.3)
        ground = outer + inner[..., None] * (ground - outer)
    corners = np.concatenate([stripe.points for stripe in layout.stripes])
    for _ in range(rng.integers(0, 4) if rng.random() < 0.4 else 0):
        ends = corners[rng.integers(len(corners), size=2)]
        area = _covered(window, [_rectangle(ends.min(axis=0), ends.max(axis=0))], size) * np.float32(
            rng.uniform(0.4, 1)
        )
        colour = random_colour(rng, 0.1)
        ground = ground + area[..., None] * (
            ground.mean() * 1.5 * colour - ground if rng.random() < 0.5 else colour - ground
        )
    return np.clip(ground, 0, 1).astype(np.float32)


def _rectangle(low: Array, high: Array) -> Array:
    return np.array([low, [high[0], low[1]], high, [low[0], high[1]]])


def _painted(
    rng: np.random.Generator, window: Window, patch: Patch, stripes: tuple[Stripe, ...], bare: Plane, size: int
) -> tuple[Plane, Plane]:
    """The ground with its paint, and the target (S, S)."""
    painted, outlines = bare, []
    strips = [strip for stripe in stripes for strip in _strips(window, stripe, size)]
    for number in range(PAINTS):
        chosen = [strip for strip in strips if strip.paint == number]
        if not chosen:
            continue
        share = _covered_px([strip.outline(0.0) for strip in chosen], size)
        wear = Noise.draw(rng, {0.02: 0.3, 0.1: 0.4, 0.5: 0.4, 3.0: 0.4}).at(patch)
        opacity = 1 - float(rng.beta(1, 3)) * smooth_step(wear, -0.5, 2.0)
        opacity = opacity * np.float32(rng.uniform(0.55, 1))
        colour = random_paint(rng)
        painted = painted + (share * opacity)[..., None] * (colour - painted)
        outlines += [strip.outline(THINNEST_PX) for strip in chosen]
    return painted.astype(np.float32), _covered_px(outlines, size)


def random_paint(rng: np.random.Generator) -> Colour:
    """White with a cast more often than not; yellow, black, blue, red, or anything."""
    kind = rng.choice(["white", "yellow", "black", "blue", "red", "any"], p=[0.6, 0.1, 0.08, 0.08, 0.07, 0.07])
    match kind:
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


def _strips(window: Window, stripe: Stripe, size: int) -> list[Strip]:
    """The paint of a stripe that comes into the picture."""
    strips = []
    for along in _pieces(stripe.points, window, size):
        tangent = np.gradient(along, axis=0)
        tangent /= np.linalg.norm(tangent, axis=1, keepdims=True) + 1e-12
        half = stripe.width / 2 * np.stack([-tangent[:, 1], tangent[:, 0]], axis=1)
        middle, depth = window.project(along)
        edge, _ = window.project(along + half)
        direction = np.gradient(middle, axis=0)
        direction /= np.linalg.norm(direction, axis=1, keepdims=True) + 1e-12
        side = edge - middle
        thick = 2 * np.abs(side[:, 0] * direction[:, 1] - side[:, 1] * direction[:, 0])
        if depth.min() > NEAREST_M and np.abs(side).max() < 4 * size:
            strips.append(Strip(middle, side, thick, stripe.paint))
    return strips


def _pieces(points: Array, window: Window, size: int) -> list[Array]:
    """The stretches (n, 2) of a polyline that come into the picture, in steps short enough to bend."""
    if len(points) > 8:
        share = np.linspace(0, len(points) - 1, 2 * len(points))
        whole = np.stack([np.interp(share, np.arange(len(points)), points[:, i]) for i in (0, 1)], axis=1)
        runs = np.flatnonzero(_in_picture(whole, window, size))
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
            kept = np.flatnonzero(_in_picture(a + share[:, None] * (b - a), window, size))
            if len(kept) == 0:
                break
            low, high = share[max(kept[0] - 1, 0)], share[min(kept[-1] + 1, 39)]
        else:
            pieces.append(a + np.linspace(low, high, 16)[:, None] * (b - a))
    return pieces


def _in_picture(xy: Array, window: Window, size: int) -> NDArray[np.bool_]:
    pixel, depth = window.project(xy)
    return (depth > NEAREST_M) & (np.abs(pixel - size / 2) < 0.75 * size).all(axis=1)


def _covered(window: Window, polygons: list[Array], size: int) -> Plane:
    """Share (S, S) of pixels inside polygons on the ground; their edges may be cut by the camera's plane."""
    strips = []
    for polygon in polygons:
        closed = np.concatenate([polygon, polygon[:1]])
        share = np.linspace(0, 1, 100)[:, None]
        dense = np.concatenate([a + share * (b - a) for a, b in pairwise(closed)])
        seen = (np.column_stack([dense, np.zeros(len(dense))]) - window.centre) @ window.rotation.T
        if (seen[:, 2] > 0.2).any():
            pixel, depth = window.project(dense)
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
