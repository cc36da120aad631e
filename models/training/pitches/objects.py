"""Objects on the ground in front of the camera: players, their shadows, balls, goals with nets, flags, benches.

Everything is drawn as anti-aliased polygons on 8-bit pictures, farthest first. What is opaque covers the labels too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from models.training.drawing.colours import Colour, hsv, random_colour
from models.training.pitches.conditions import Conditions
from models.training.pitches.world import World
from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.field import Field

SHIFT = 4
GOAL_HALF_WIDTH_M, GOAL_HEIGHT_M = 3.66, 2.44
Picture = NDArray[np.uint8]


@dataclass
class Canvas:
    """The pictures of one window: colours (H, W, 3) and labels (H, W), all 8 bit, and the camera that sees them."""

    colour: Picture
    labels: tuple[Picture, ...]
    camera: Camera
    origin: tuple[int, int]
    dim: float

    def project(self, points: Array) -> Array:
        """World points (N, 3) to pixels of the window (N, 2)."""
        return self.camera.project(points) - np.array(self.origin)

    def project_each(self, polygons: list[Array]) -> list[Array]:
        """World polygons (N, 3) to pixels of the window (N, 2), all in one go."""
        return np.split(self.project(np.concatenate(polygons)), np.cumsum([len(one) for one in polygons[:-1]]))

    def near(self, starts: Array, ends: Array, reach: float) -> NDArray[np.bool_]:
        """Return which of N things between world points (N, 3) and (N, 3) may be seen within `reach` metres of them."""
        if len(starts) == 0:
            return np.zeros(0, dtype=bool)
        first, last = self.project(starts), self.project(ends)
        depth = (starts - self.camera.pose.position) @ self.camera.pose.matrix[2]
        margin = (reach * self.camera.intrinsics.matrix[0, 0] / np.maximum(depth, 1.0))[:, None]
        height, width = self.colour.shape[:2]
        low, high = np.minimum(first, last) - margin, np.maximum(first, last) + margin
        return ((high > 0) & (low < [width, height])).all(axis=1)

    def size_at(self, point: Array) -> float:
        """Pixels per metre at a world point; 0 where it is out of view."""
        depth = float(self.camera.pose.matrix[2] @ (point - self.camera.pose.position))
        return float(self.camera.intrinsics.matrix[0, 0]) / depth if depth > 0.5 else 0.0

    def polygon(self, pixels: Array, colour: Colour) -> None:
        """Fill a polygon (N, 2) in window pixels; it hides markings."""
        if not np.isfinite(pixels).all() or np.abs(pixels).max() > 20000:
            return
        corners = [np.round(pixels * 2**SHIFT).astype(np.int32)]
        cv2.fillPoly(self.colour, corners, _ink(colour, self.dim), cv2.LINE_AA, SHIFT)
        for label in self.labels:
            cv2.fillPoly(label, corners, 0, cv2.LINE_AA, SHIFT)

    def disc(self, middle: Array, radius: float, colour: Colour) -> None:
        """A ball of `radius` metres at a world point, darker below."""
        spot = self.project(middle[None])[0]
        size = radius * self.size_at(middle)
        height, width = self.colour.shape[:2]
        if not (-size < spot[0] < width + size and -size < spot[1] < height + size):
            return
        angle = np.linspace(0, 2 * np.pi, 16, endpoint=False)
        ring = size * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        self.polygon(spot + ring, colour * np.float32(0.7))
        self.polygon(spot + 0.8 * ring - [0, 0.2 * size], colour)

    def bar(self, start: Array, end: Array, thick: float, colour: Colour) -> None:
        """A round bar of `thick` metres between two world points; thinner than a pixel it becomes faint."""
        ends = self.project(np.array([start, end]))
        height, width = self.colour.shape[:2]
        if (
            not np.isfinite(ends).all()
            or (ends.max(axis=0) < -40).any()
            or (ends.min(axis=0) > (width + 40, height + 40)).any()
        ):
            return
        steps = max(2, int(np.linalg.norm(end - start) / 2) + 1)
        points = start + np.linspace(0, 1, steps)[:, None] * (end - start)
        pixels = self.project(points)
        if not np.isfinite(pixels).all() or np.abs(pixels).max() > 20000:
            return
        half = np.array([self.size_at(point) for point in points])[:, None] * thick / 2
        along = np.gradient(pixels, axis=0)
        along = along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-6)
        across = np.stack([-along[:, 1], along[:, 0]], axis=1)
        if half.max() > 0.5:
            self.polygon(np.concatenate([pixels + half * across, (pixels - half * across)[::-1]]), colour)
        else:
            self.veil([pixels], colour, float(2 * half.mean()))

    def veil(self, lines: list[Array], colour: Colour, share: float) -> None:
        """One-pixel lines that let the background through: nets, wires. Markings stay visible behind."""
        lines = [line for line in lines if np.isfinite(line).all() and np.abs(line).max() < 20000]
        if not lines:
            return
        every = np.concatenate(lines)
        height, width = self.colour.shape[:2]
        x0, y0 = np.maximum(np.floor(every.min(axis=0)).astype(int) - 2, 0)
        x1, y1 = np.minimum(np.ceil(every.max(axis=0)).astype(int) + 3, (width, height))
        if x0 >= x1 or y0 >= y1:
            return
        part = self.colour[y0:y1, x0:x1]
        ink = np.zeros(part.shape[:2], np.uint8)
        shifted = [np.round((line - (x0, y0)) * 2**SHIFT).astype(np.int32) for line in lines]
        cv2.polylines(ink, shifted, False, 255, 1, cv2.LINE_AA, SHIFT)
        weight = (ink.astype(np.float32) / 255 * min(share, 1.0))[..., None]
        part[:] = part + weight * (np.array(_ink(colour, self.dim)) - part)


def draw_objects(pitch: Field, world: World, conditions: Conditions, canvas: Canvas) -> None:
    """Draw shadows, then everything else from far to near."""
    people = list(_people(pitch, world, conditions))
    feet = np.array([person.foot for person in people]).reshape(-1, 3)
    people = [people[i] for i in np.flatnonzero(canvas.near(feet, feet, 12.0))]
    draw_shadows(world, conditions, canvas, people)
    furniture = list(_furniture(pitch, conditions))
    starts, ends = (np.array([item[i] for item in furniture]) for i in (0, 1))
    furniture = [furniture[i] for i in np.flatnonzero(canvas.near(starts, ends, 2.0))]
    things: list[tuple[Array, Callable[[Canvas], None]]] = [(start, draw) for start, _, draw in furniture]
    things += [(person.foot, person.draw) for person in people]
    things += [(goal.middle, goal.draw) for goal in _goals(pitch, world)]
    centre = canvas.camera.pose.position
    for _, draw in sorted(things, key=lambda thing: -float(np.linalg.norm(thing[0] - centre))):
        draw(canvas)


@dataclass
class Person:
    """A player, referee or steward: where the feet are, how tall, what kit, which stride."""

    foot: Array
    tall: float
    kit: tuple[Colour, ...]  # shirt, shorts, socks, skin, the shirt in its own shadow, hair
    stride: float
    lean: float
    ball: Array | None

    def limbs(self) -> list[tuple[Array, int]]:
        """Polygons (N, 2) of the body, metres to the right of the feet and up, and which part of the kit they show."""
        s, t = self.stride, self.tall
        hip, knee, shoulder = 0.5 * t, 0.27 * t, 0.82 * t
        lean = self.lean

        def limb(a: tuple[float, float], b: tuple[float, float], thick: float) -> Array:
            start, end = np.array(a), np.array(b)
            along = (end - start) / max(np.linalg.norm(end - start), 1e-6)
            side = np.array([-along[1], along[0]]) * thick / 2
            return np.array([start + side, end + 0.8 * side, end - 0.8 * side, start - side])

        angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
        head = np.stack([0.085 * np.cos(angle) + 1.25 * lean, 0.92 * t + 0.12 * np.sin(angle)], axis=1)
        hair = head * [1.05, 1.0] + [-0.05 * 1.25 * lean, 0.03]
        hair[:, 1] = np.maximum(hair[:, 1], 0.93 * t)
        waist, neck = 0.55 * lean, 0.86 * t
        body = np.array(
            [
                (lean - 0.07, neck),
                (lean + 0.07, neck),
                (lean + 0.22, shoulder + 0.02),
                (lean + 0.23, shoulder - 0.1),
                (waist + 0.17, hip + 0.15),
                (waist + 0.19, hip - 0.02),
                (waist - 0.19, hip - 0.02),
                (waist - 0.17, hip + 0.15),
                (lean - 0.23, shoulder - 0.1),
                (lean - 0.22, shoulder + 0.02),
            ]
        )
        shaded = np.concatenate([body[2:6], [(waist + 0.08, hip - 0.02), (lean + 0.1, shoulder - 0.1)]])
        left, right = (-0.35 * s - 0.06, 0.0), (0.4 * s + 0.06, 0.06 * s)
        knee_l, knee_r = (-0.12 * s - 0.07, knee), (0.28 * s + 0.07, knee + 0.05 * s)
        return [
            (limb(knee_l, left, 0.13), 2),
            (limb(knee_r, right, 0.13), 2),
            (limb((left[0] + 0.04, 0.03), (left[0] - 0.14, 0.0), 0.1), 2),
            (limb((0.5 * lean - 0.08, hip), knee_l, 0.2), 3),
            (limb((0.5 * lean + 0.08, hip), knee_r, 0.2), 3),
            (limb((0.6 * lean, hip + 0.1), (0.6 * lean - 0.08 - 0.1 * s, 0.38 * t), 0.26), 1),
            (limb((0.6 * lean, hip + 0.1), (0.6 * lean + 0.1 + 0.1 * s, 0.38 * t), 0.26), 1),
            (limb((lean - 0.2, shoulder - 0.02), (lean - 0.3 - 0.2 * s, 0.55 * t), 0.11), 3),
            (limb((lean + 0.2, shoulder - 0.02), (lean + 0.28 + 0.25 * s, 0.58 * t), 0.11), 3),
            (body, 0),
            (shaded, 4),
            (head, 3),
            (hair, 5),
        ]

    def place(self, camera: Array, polygon: Array) -> Array:
        """A polygon of the body in the world (N, 3), turned to the camera at (3,)."""
        towards = camera[:2] - self.foot[:2]
        right = np.array([-towards[1], towards[0]]) / max(float(np.linalg.norm(towards)), 1e-6)
        ground = self.foot[:2] + polygon[:, :1] * right
        return np.column_stack([ground, self.foot[2] + polygon[:, 1]])

    def draw(self, canvas: Canvas) -> None:
        """Draw the body, and the ball if this is who has it."""
        pixels = canvas.project(np.array([self.foot, self.foot + [0, 0, self.tall]]))
        height, width = canvas.colour.shape[:2]
        reach = 1.5 * np.linalg.norm(pixels[1] - pixels[0])
        if not np.isfinite(pixels).all() or (pixels.max(0) < -reach).any():
            return
        if (pixels.min(axis=0) > np.array([width, height]) + reach).any() or canvas.size_at(self.foot) == 0:
            return
        limbs = self.limbs()
        placed = canvas.project_each([self.place(canvas.camera.pose.position, polygon) for polygon, _ in limbs])
        for polygon, (_, part) in zip(placed, limbs, strict=True):
            canvas.polygon(polygon, self.kit[part])
        if self.ball is not None:
            canvas.disc(self.ball, 0.11, np.float32([0.95, 0.95, 0.95]))


def _people(pitch: Field, world: World, conditions: Conditions) -> Iterator[Person]:
    """Two teams on the pitch, some people beside it."""
    rng = np.random.default_rng([conditions.world, conditions.moment, 41])
    for number in range(conditions.players):
        beside = rng.random() < 0.15
        spread = np.array([pitch.length, pitch.width]) * (0.56 if beside else 0.48)
        xy = rng.uniform(-1, 1, 2) * spread
        if beside:
            side = rng.choice([-1, 1])
            xy = np.array([xy[0], side * (pitch.width / 2 + rng.uniform(0.3, 8))])
        team = 3 * (number % 2)
        kit = (world.strips[team], world.strips[team + 1], world.strips[team + 2])
        skin = hsv(rng.uniform(10, 30), rng.uniform(0.3, 0.6), rng.uniform(0.25, 0.85))
        foot = pitch.lift(xy)
        ball = None
        if rng.random() < 0.12:
            ball = foot + np.array([*rng.uniform(-1.5, 1.5, 2), 0.11])
        yield Person(
            foot,
            float(rng.uniform(1.6, 1.95)),
            (*kit, skin, 0.72 * kit[0], hsv(25, 0.5, rng.uniform(0.03, 0.35))),
            float(rng.uniform(0, 1.1)),
            float(rng.normal(0, 0.1)),
            ball,
        )


def draw_shadows(world: World, conditions: Conditions, canvas: Canvas, people: list[Person]) -> None:
    """Darken the ground beside people: one shadow in the sun, four in floodlight, a spot under clouds."""
    ink = np.zeros(canvas.colour.shape[:2], np.uint8)
    azimuth, elevation = world.sun
    if conditions.light == "sun":
        lamps, strength = [(azimuth, elevation)], 0.6
    elif conditions.light == "floodlight":
        lamps, strength = [(azimuth + k * np.pi / 2, 0.6) for k in range(4)], 0.2
    else:
        lamps, strength = [(azimuth, 1.45)], 0.25
    height, width = ink.shape
    for person in people:
        pixel = canvas.project(person.foot[None])[0]
        reach = 12 * canvas.size_at(person.foot)
        if not np.isfinite(pixel).all() or (pixel < -reach).any() or (pixel > np.array([width, height]) + reach).any():
            continue
        limbs = [polygon for polygon, _ in person.limbs()]
        for turn, up in lamps:
            away = -np.array([np.cos(turn), np.sin(turn)])
            side = np.array([-away[1], away[0]])
            layer = np.zeros_like(ink) if len(lamps) > 1 else ink
            grounds = [person.foot[:2] + limb[:, :1] * side + limb[:, 1:] / np.tan(up) * away for limb in limbs]
            lifted = [np.column_stack([ground, np.full(len(ground), person.foot[2])]) for ground in grounds]
            for spots in canvas.project_each(lifted):
                if np.isfinite(spots).all() and np.abs(spots).max() < 20000:
                    cv2.fillPoly(layer, [np.round(spots * 2**SHIFT).astype(np.int32)], 255, cv2.LINE_AA, SHIFT)
            if layer is not ink:
                ink = cv2.add(ink, layer // 4)
    if ink.any():
        if len(lamps) > 1:
            strength = 0.6
        light = 1 - strength * ink.astype(np.float32)[..., None] / 255
        canvas.colour[:] = (canvas.colour * light).astype(np.uint8)


@dataclass
class Goal:
    """A goal: corners of the mouth, how deep it is, its posts and its net."""

    left: Array
    right: Array
    back: Array  # horizontal vector from the mouth to the foot of the net
    tall: float
    thick: float
    colour: Colour
    net: Colour
    net_share: float

    @property
    def middle(self) -> Array:
        """The middle of the goal line between the posts."""
        return (self.left + self.right) / 2

    def draw(self, canvas: Canvas) -> None:
        """Net, rear frame, then posts and bar."""
        up = np.array([0.0, 0.0, self.tall])
        size = canvas.size_at(self.middle)
        pixels = canvas.project(
            np.array([self.left, self.right, self.left + up, self.right + up, self.middle + self.back])
        )
        height, width = canvas.colour.shape[:2]
        outside = (pixels.max(axis=0) < 0).any() or (pixels.min(axis=0) > (width, height)).any()
        if size == 0 or not np.isfinite(pixels).all() or outside:
            return
        shoulder = 0.35 * self.back
        mesh = 0.12 if size * 0.12 > 3 else 0.3
        columns = np.linspace(0, 1, int(np.linalg.norm(self.right - self.left) / mesh) + 2)
        lines = []
        for share in columns:
            foot = self.left + share * (self.right - self.left)
            lines.append(np.array([foot + up, foot + up + shoulder, foot + self.back]))
        for share in np.linspace(0, 1, int(self.tall / mesh) + 2):
            back = shoulder + share * (self.back - shoulder) + (1 - share) * up
            lines.append(np.array([self.left + back, self.right + back]))
            lines.append(np.array([self.left + (1 - share) * up, self.left + back]))
            lines.append(np.array([self.right + (1 - share) * up, self.right + back]))
        flat = canvas.project(np.concatenate(lines))
        cuts = np.cumsum([len(line) for line in lines])[:-1]
        canvas.veil(np.split(flat, cuts), self.net, self.net_share * min(1.0, max(0.25, size * 0.02)))
        for foot in (self.left, self.right):
            canvas.bar(foot + self.back, foot, self.thick * 0.6, self.colour)
            canvas.bar(foot + self.back, foot + up + shoulder, self.thick * 0.5, self.colour)
            canvas.bar(foot + up + shoulder, foot + up, self.thick * 0.5, self.colour)
        canvas.bar(self.left + self.back, self.right + self.back, self.thick * 0.6, self.colour)
        for foot in (self.left, self.right):
            canvas.bar(foot, foot + up, self.thick, self.colour)
        canvas.bar(self.left + up, self.right + up, self.thick, self.colour)


def _goals(pitch: Field, world: World) -> Iterator[Goal]:
    """The two goals of the game, and some that wait beside the pitch."""
    rng = np.random.default_rng(world.goal_style)
    white = hsv(rng.uniform(0, 360), rng.uniform(0, 0.06), rng.uniform(0.8, 1.0))
    net, share = random_colour(rng, 0.7), float(rng.uniform(0.25, 0.9))
    for side in (-1, 1):
        mouth = np.array([side * pitch.length / 2, 0.0, 0.0])
        half = np.array([0.0, GOAL_HALF_WIDTH_M + 0.06, 0.0])
        back = np.array([side * float(rng.uniform(1.5, 2.5)), 0.0, 0.0])
        yield Goal(mouth - half, mouth + half, back, GOAL_HEIGHT_M + 0.06, 0.12, white, net, share)
    for _ in range(int(rng.integers(0, 7))):
        half_size = float(rng.uniform(0.6, 3.7))
        angle = float(rng.choice([0, np.pi / 2, np.pi, -np.pi / 2]) + rng.normal(0, 0.15))
        out = rng.uniform(2.5, 9)
        if rng.random() < 0.6:
            spot = [rng.choice([-1, 1]) * (pitch.length / 2 + out), rng.uniform(-0.5, 0.5) * pitch.width, 0]
        else:
            spot = [rng.uniform(-0.5, 0.5) * pitch.length, rng.choice([-1, 1]) * (pitch.width / 2 + out + 3), 0]
        mouth = np.array(spot, dtype=float)
        half = half_size * np.array([-np.sin(angle), np.cos(angle), 0])
        back = rng.uniform(0.8, 2) * np.array([np.cos(angle), np.sin(angle), 0])
        yield Goal(
            mouth - half, mouth + half, back, 0.66 * half_size if half_size > 3 else half_size, 0.1, white, net, share
        )


def _furniture(pitch: Field, conditions: Conditions) -> Iterator[tuple[Array, Array, Callable[[Canvas], None]]]:
    """Corner flags, benches, masts and loose balls: where each begins and ends, and how to draw it."""
    rng = np.random.default_rng([conditions.world, 43])

    def bar(start: Array, end: Array, thick: float, colour: Colour) -> tuple[Array, Array, Callable[[Canvas], None]]:
        return start, end, lambda canvas: canvas.bar(start, end, thick, colour)

    def disc(middle: Array, radius: float, colour: Colour) -> tuple[Array, Array, Callable[[Canvas], None]]:
        return middle, middle, lambda canvas: canvas.disc(middle, radius, colour)

    flag = random_colour(rng, 0.3)
    pole = random_colour(rng, 0.6)
    for x in (-1, 1):
        for y in (-1, 1):
            foot = np.array([x * pitch.length / 2, y * pitch.width / 2, 0.0])
            yield bar(foot, foot + [0, 0, 1.5], 0.04, pole)
            yield bar(foot + [0, 0, 1.35], foot + [0.4, 0.1, 1.35], 0.3, flag)
    for _ in range(int(rng.integers(0, 10))):  # benches: a seat of planks along a side
        along, out = rng.uniform(-0.5, 0.5), rng.uniform(2.0, 12)
        long = rng.uniform(1.5, 14)
        if rng.random() < 0.7:
            start = np.array([along * pitch.length, rng.choice([-1, 1]) * (pitch.width / 2 + out), 0.45])
            step = np.array([long, 0, 0])
        else:
            start = np.array([rng.choice([-1, 1]) * (pitch.length / 2 + out), along * pitch.width, 0.45])
            step = np.array([0, long, 0])
        yield bar(start, start + step, rng.uniform(0.1, 0.4), random_colour(rng, 0.7))
    for _ in range(int(rng.integers(0, 4))):  # masts
        spot = np.array(
            [rng.choice([-1, 1]) * (pitch.length / 2 * rng.uniform(0, 1.1)), pitch.width / 2 + rng.uniform(6, 25), 0]
        )
        spot[1] *= rng.choice([-1, 1])
        yield bar(spot, spot + [0, 0, rng.uniform(8, 22)], rng.uniform(0.15, 0.4), random_colour(rng, 0.5))
    for _ in range(int(rng.integers(0, 25))):  # cones, bottles and balls on the ground
        xy = rng.uniform(-0.6, 0.6, 2) * [pitch.length, pitch.width]
        radius = float(rng.uniform(0.08, 0.2))
        yield disc(pitch.lift(xy) + [0, 0, radius], radius, random_colour(rng, 0.6))


def _ink(colour: Colour, dim: float) -> tuple[float, float, float]:
    values = np.clip(np.asarray(colour, dtype=float) * dim, 0, 1) * 255
    return float(values[0]), float(values[1]), float(values[2])
