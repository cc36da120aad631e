"""Clutter in front of the lines or beside them: people, posts, nets, wires, boards, crowds, letters."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from models.training.drawing.colours import random_colour
from models.training.drawing.noise import Plane

FONTS = (cv2.FONT_HERSHEY_SIMPLEX, cv2.FONT_HERSHEY_DUPLEX, cv2.FONT_HERSHEY_COMPLEX)
SHIFT = 4  # cv2 draws in 1/16 px


def draw_clutter(rng: np.random.Generator, picture: Plane, hidden: Plane, scale: float) -> None:
    """Draw over the `picture` (H, W, 3) in place; `hidden` (H, W) grows to 1 where paint is covered.

    `scale`: pixels per metre in the middle of the picture.
    """
    size = picture.shape[0]
    for _ in range(rng.poisson(1.2)):
        _person(rng, picture, hidden, float(np.clip(1.8 * scale * rng.uniform(0.7, 1.2), 4, 1.5 * size)))
    if rng.random() < 0.3:
        for _ in range(rng.integers(1, 4)):
            _post(rng, picture, hidden)
    if rng.random() < 0.1:
        _net(rng, picture, hidden, scale)
    if rng.random() < 0.1:
        _wire(rng, picture, hidden)
    if rng.random() < 0.15:
        _board(rng, picture, hidden)
    if rng.random() < 0.05:
        _letters(rng, picture, hidden)


def backdrop(rng: np.random.Generator, size: int) -> Plane:
    """Draw a random background behind the ground (size, size, 3): crowd, wall, fence, stand, trees, sky."""
    base = np.empty((size, size, 3), np.float32)
    base[...] = random_colour(rng, 0.15)
    kind = rng.choice(["crowd", "wall", "boxes", "trees"])
    if kind in ("crowd", "trees"):
        grain = int(rng.integers(2, 12))
        coarse = rng.random((size // grain + 2, size // grain + 2, 3)).astype(np.float32)
        if kind == "trees":
            coarse = coarse.mean(axis=-1, keepdims=True) * np.float32([0.2, 0.45, 0.25])
        blobs = cv2.resize(coarse, (size, size), interpolation=cv2.INTER_LINEAR)
        base = base * np.float32(0.4) + blobs * np.float32(0.6)
    if kind == "boxes" or rng.random() < 0.4:
        for _ in range(rng.integers(3, 25)):
            x, y = rng.integers(-40, size, 2).tolist()
            w, h = np.exp(rng.uniform(0, np.log(size), 2)).astype(int).tolist()
            cv2.rectangle(base, (x, y), (x + w, y + h), random_colour(rng, 0.35).tolist(), -1)
    if rng.random() < 0.3:
        for _ in range(rng.integers(1, 8)):
            _post(rng, base, np.zeros((size, size), np.float32))
    return base


def _fill(
    picture: Plane, hidden: Plane, drawn: NDArray[np.uint8], colour: NDArray[np.float32], opacity: float = 1.0
) -> None:
    share = drawn.astype(np.float32) / 255 * np.float32(opacity)
    picture += share[..., None] * (colour - picture)
    np.maximum(hidden, share, out=hidden)


def _blank(picture: Plane) -> NDArray[np.uint8]:
    return np.zeros(picture.shape[:2], np.uint8)


def _person(rng: np.random.Generator, picture: Plane, hidden: Plane, tall: float) -> None:
    size = picture.shape[0]
    x, y = rng.uniform(-0.1, 1.1, 2) * size
    lean = rng.normal(0, 8)
    for top, long, wide in ((0.06, 0.07, 0.06), (0.33, 0.2, 0.13), (0.7, 0.27, 0.1)):
        drawn = _blank(picture)
        centre = (int(16 * (x + rng.normal(0, 0.02) * tall)), int(16 * (y + (top - 0.5) * tall)))
        axes = (max(8, int(16 * wide * tall)), max(8, int(16 * long * tall)))
        cv2.ellipse(drawn, centre, axes, lean, 0, 360, 255, -1, cv2.LINE_AA, SHIFT)
        _fill(picture, hidden, drawn, random_colour(rng, 0.25))


def _post(rng: np.random.Generator, picture: Plane, hidden: Plane) -> None:
    """Upright or level and never on the ground: goal posts, poles, rails."""
    size = picture.shape[0]
    drawn = _blank(picture)
    x, y = rng.uniform(0, size, 2)
    upright = rng.random() < 0.7
    reach = rng.uniform(0.1, 1.2) * size
    end = (x + rng.normal(0, 0.02) * reach, y - reach) if upright else (x + reach, y + rng.normal(0, 0.02) * reach)
    points = [tuple(int(16 * v) for v in point) for point in ((x, y), end)]
    cv2.line(drawn, points[0], points[1], 255, int(rng.integers(1, 9)), cv2.LINE_AA, SHIFT)
    _fill(picture, hidden, drawn, random_colour(rng, 0.5))


def _net(rng: np.random.Generator, picture: Plane, hidden: Plane, scale: float) -> None:
    size = picture.shape[0]
    y, high = rng.uniform(0.1, 0.9) * size, float(np.clip(scale * rng.uniform(0.6, 1.2), 6, size))
    slope, every = rng.normal(0, 0.1), max(3, int(scale * rng.uniform(0.05, 0.15)))
    drawn = _blank(picture)
    for x in range(0, size, every):
        top = y + slope * x
        cv2.line(drawn, (x, int(top)), (x, int(top + high)), 255, 1, cv2.LINE_AA)
    for down in np.arange(0, high, every):
        cv2.line(drawn, (0, int(y + down)), (size, int(y + slope * size + down)), 255, 1, cv2.LINE_AA)
    _fill(picture, hidden, drawn, random_colour(rng, 0.3), float(rng.uniform(0.2, 0.8)))
    tape = _blank(picture)
    cv2.line(tape, (0, int(y)), (size, int(y + slope * size)), 255, int(np.clip(0.07 * scale, 1, 20)), cv2.LINE_AA)
    _fill(picture, hidden, tape, random_colour(rng, 0.7))


def _wire(rng: np.random.Generator, picture: Plane, hidden: Plane) -> None:
    size = picture.shape[0]
    x = np.linspace(0, size, 24)
    y = rng.uniform(0, size) + rng.normal(0, 0.6) * x + rng.normal(0, 0.2) * size * ((x / size) ** 2 - x / size)
    drawn = _blank(picture)
    points = np.round(16 * np.stack([x, y], axis=-1)).astype(np.int32)
    cv2.polylines(drawn, [points], False, 255, 1, cv2.LINE_AA, SHIFT)
    _fill(picture, hidden, drawn, random_colour(rng, 0.2), float(rng.uniform(0.3, 1)))


def _board(rng: np.random.Generator, picture: Plane, hidden: Plane) -> None:
    """A board or a stand along one side of the picture, lettered or striped."""
    size = picture.shape[0]
    left, right = rng.uniform(-0.3, 1.3, 2) * size
    high = rng.uniform(0.08, 0.5) * size
    quad = np.array([[0, left], [size, right], [size, right + high], [0, left + high]])
    drawn = _blank(picture)
    cv2.fillConvexPoly(drawn, np.round(16 * quad).astype(np.int32), 255, cv2.LINE_AA, SHIFT)
    _fill(picture, hidden, drawn, random_colour(rng, 0.35))
    text = _blank(picture)
    letters = "".join(chr(c) for c in rng.integers(65, 91, rng.integers(3, 9)))
    place = (int(rng.uniform(-0.1, 0.6) * size), int(min(left, right) + 0.75 * high))
    thick = int(rng.integers(1, 7))
    cv2.putText(text, letters, place, FONTS[rng.integers(3)], high / 40, 255, thick, cv2.LINE_AA)
    _fill(picture, hidden, np.minimum(text, drawn), random_colour(rng, 0.5))


def _letters(rng: np.random.Generator, picture: Plane, hidden: Plane) -> None:
    """A logo of a broadcaster, half transparent, over the picture."""
    size = picture.shape[0]
    drawn = _blank(picture)
    letters = "".join(chr(c) for c in rng.integers(48, 91, rng.integers(3, 12)))
    place = (int(rng.uniform(-0.1, 0.5) * size), int(rng.uniform(0.2, 0.95) * size))
    cv2.putText(drawn, letters, place, FONTS[rng.integers(3)], rng.uniform(0.4, 2), 255, int(rng.integers(1, 5)), 16)
    _fill(picture, hidden, drawn, random_colour(rng, 0.8), float(rng.uniform(0.3, 1)))
