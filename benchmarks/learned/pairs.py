"""Training pairs: drawn masks, seen by a camera that is believed to stand elsewhere, and templates.

No frame is rendered and no network is asked: the markings are projected by the true pose, laid back onto the ground by
the wrong one and drawn as lines, a pair in a few milliseconds. What the real segmentation adds is drawn as well:
gaps, players, lines of other pitches, stands. Cameras and pitches are random; none is one of the bench's venues.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.learned.window import FINER, QUAD, SIZE, Picture, Window, placed, shown, strokes
from benchmarks.scenes import SIZE as FRAME
from benchmarks.scenes import started
from worker.calibration.geometry.camera import Array, Camera, Pose, inside
from worker.calibration.geometry.field import Field, LinePoints
from worker.calibration.geometry.lens import Intrinsics

LARGEST_START = 1.5
"""Of the paper's Start error, up to which wrong poses go."""
PITCHES = 64
SPACING_M = 1.0
FEWEST_POINTS = 40
"""Points of markings, one a metre, that a window has to show."""


@dataclass(frozen=True)
class Pair:
    """A mask of the window under a wrong pose, the template, and how far the points of `QUAD` have to move (4, 2)."""

    seen: Picture
    template: Picture
    offsets: Array


@dataclass(frozen=True)
class Ground:
    """A pitch, and the lines of another one across it."""

    pitch: Field
    others: LinePoints | None


class Pairs:
    """Random pairs without end; the same of the same seed."""

    def __init__(self, *seed: int) -> None:
        self.rng = np.random.default_rng([20, *seed])
        self.grounds = [random_ground(self.rng) for _ in range(PITCHES)]

    def __iter__(self) -> Iterator[Pair]:
        while True:
            ground = self.grounds[self.rng.integers(PITCHES)]
            true = random_camera(ground.pitch, self.rng)
            wrong = started([true], self.rng, self.rng.uniform(0, LARGEST_START))[0]
            pair = drawn_pair(ground, true, wrong.pose, self.rng)
            if pair is not None:
                yield pair


def random_ground(rng: np.random.Generator) -> Ground:
    """A pitch of any lawful size with a crown; more often than not with the lines of smaller ones across."""
    length, width = rng.uniform(98, 110), rng.uniform(62, 72)
    crown = rng.uniform(0.0, 0.45)
    end = rng.uniform(0.8, 1.2) * (length - width) / 2
    pitch = Field(length, width, 0.12, np.array([[-end, 0.0, crown], [end, 0.0, crown]]))
    return Ground(pitch, _other_lines(pitch, rng) if rng.random() < 0.7 else None)


def _other_lines(pitch: Field, rng: np.random.Generator) -> LinePoints:
    """Most of the markings of a smaller pitch, shifted and turned, on the surface of the pitch."""
    scale = rng.uniform(0.3, 0.9)
    points = Field(pitch.length * scale, pitch.width * rng.uniform(0.4, 1.0), 0.1).line_points(SPACING_M)
    turn = rng.choice([0, 0, np.pi / 2, np.pi / 2, rng.uniform(0, np.pi)])
    shift = rng.uniform(-0.25, 0.25, 2) * [pitch.length, pitch.width]
    turned = points.position[:, :2] @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]) + shift
    kept = np.isin(points.marking, np.flatnonzero(rng.random(points.marking.max() + 1) < 0.8))
    kept[0] = True
    return replace(points[kept], position=pitch.lift(turned[kept]))


def random_camera(pitch: Field, rng: np.random.Generator) -> Camera:
    """A camera beside the pitch that looks at a point of it, most of them along a touchline; usual lenses and wider."""
    half = np.array([pitch.length, pitch.width]) / 2
    target = np.full(2, np.inf)
    while np.any(np.abs(target) > half):
        height, outside = rng.uniform(6, 20), rng.uniform(4, 28)
        if rng.random() < 0.8:
            foot = np.array([rng.uniform(-1, 1) * half[0], -half[1] - outside])
            heading = np.radians(rng.normal(0, 40))
        else:
            foot = np.array([-half[0] - outside, rng.uniform(-1, 1) * half[1]])
            heading = np.radians(90 + rng.normal(0, 30))
        target = foot + height * rng.uniform(2.2, 5.0) * np.array([np.sin(heading), np.cos(heading)])
    side = rng.choice([-1, 1])
    focal = rng.uniform(1700, 2550)
    k1 = rng.uniform(-0.36, -0.2)
    centre = (np.array(FRAME) - 1) / 2 + rng.normal(0, 15, 2)
    matrix = np.array([[focal, 0, centre[0]], [0, focal, centre[1]], [0, 0, 1]])
    pose = Pose.looking_at([*side * foot, height], [*side * target, 0], roll_deg=float(rng.normal(0, 1.5)))
    return Camera("random", Intrinsics(matrix, np.array([k1, 0.92 * k1 * k1, 0, 0, 0]), FRAME), pose)


def drawn_pair(ground: Ground, true: Camera, wrong: Pose, rng: np.random.Generator) -> Pair | None:
    """Lay what `true` sees onto the ground by the pose `wrong`; None where too little of the pitch is in sight."""
    window = Window.of(wrong)
    corrected = placed(ground.pitch.lift(window.ground(QUAD)), true.pose, wrong, ground.pitch)
    if not np.isfinite(corrected).all():
        return None
    canvas = _lines(ground.pitch.line_points(SPACING_M), ground.pitch, true, wrong, window, rng)
    if canvas is None:
        return None
    if ground.others is not None:
        others = _lines(ground.others, ground.pitch, true, wrong, window, rng)
        if others is not None:
            canvas = np.maximum(canvas, others * np.float32(rng.uniform(0, 1)))
    _cover(canvas, rng)
    seen = shown(np.clip(canvas, 0, 1) * np.float32(rng.uniform(0.5, 1.0)))
    return Pair(seen, window.template(ground.pitch), window.pixels(corrected) - QUAD)


def _lines(
    points: LinePoints, pitch: Field, true: Camera, wrong: Pose, window: Window, rng: np.random.Generator
) -> NDArray[np.float32] | None:
    """The finer picture of line points; None where too few are in the window."""
    in_sight = inside(true.project(points.position), FRAME)
    at = window.pixels(placed(points.position, wrong, true.pose, pitch))
    within = in_sight & np.all((at > 0) & (at < SIZE), axis=1)
    if within.sum() < FEWEST_POINTS:
        return None
    # What is a pixel of the frame high is as much of the ground farther away: d² / (h f); the network adds its own.
    distance = np.linalg.norm(points.position - true.pose.position, axis=1)
    spread = rng.uniform(0.5, 3.0) * distance**2 / (true.pose.position[2] * true.intrinsics.focal_length_px)
    along_view = (
        np.abs(np.sum(points.tangent[:, :2] * (points.position - true.pose.position)[:, :2], axis=1)) / distance
    )
    width = (points.width + spread * (1 - 0.8 * along_view)) / window.pixel_m
    joined = in_sight[:-1] & in_sight[1:] & (points.marking[:-1] == points.marking[1:])
    return strokes(np.nan_to_num(at, nan=-1e4), joined & _kept(points, rng)[:-1], width)


def _kept(points: LinePoints, rng: np.random.Generator) -> NDArray[np.bool_]:
    """Return the mask (N,) of points that are not worn away: whole markings and stretches of others are."""
    whole = rng.random(points.marking.max() + 1) >= rng.choice([0.0, 0.05, 0.25])
    kept = whole[points.marking]
    for _ in range(rng.integers(0, 8)):
        begin = rng.integers(len(kept))
        kept[begin : begin + rng.integers(2, 50)] = False
    return kept


def _cover(canvas: NDArray[np.float32], rng: np.random.Generator) -> None:
    """People before the lines, and what is taken for lines and is none: shirts, shadows, seats, advertisements."""
    height, width = canvas.shape
    for _ in range(rng.integers(0, 16)):
        centre = (int(rng.integers(width)), int(rng.integers(height)))
        axes = (int(rng.uniform(1, 3) * FINER), int(rng.uniform(2, 12) * FINER))
        shade = 0.0 if rng.random() < 0.6 else float(rng.uniform(0.1, 0.7))
        cv2.ellipse(canvas, centre, axes, float(rng.uniform(-40, 40)), 0, 360, shade, -1)
    for _ in range(rng.choice([0, 0, 1, 2, 5, 10])):
        begin = rng.uniform([0, 0], [width, height])
        turn, length = rng.uniform(0, np.pi), rng.exponential(15) * FINER
        end = begin + length * np.array([np.cos(turn), np.sin(turn)])
        shade, thickness = float(rng.uniform(0.1, 0.8)), int(rng.integers(1, 2 * FINER))
        cv2.line(canvas, np.rint(begin).astype(int).tolist(), np.rint(end).astype(int).tolist(), shade, thickness)
    if rng.random() < 0.4:
        noise = cv2.resize(rng.random((12, 15), dtype=np.float32), (width, height))
        canvas += np.float32(rng.uniform(0.05, 0.3)) * np.clip(noise - 0.6, 0, None)
