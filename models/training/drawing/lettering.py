"""White lettering and logos on the ground beside the pitch: the hardest thing that is not a marking."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from models.training.drawing.colours import Colour, random_colour
from worker.calibration.geometry.field import Field

TEXEL_M = 0.04
HERSHEY = (
    cv2.FONT_HERSHEY_SIMPLEX,
    cv2.FONT_HERSHEY_DUPLEX,
    cv2.FONT_HERSHEY_TRIPLEX,
    cv2.FONT_HERSHEY_SCRIPT_COMPLEX,
    cv2.FONT_HERSHEY_SCRIPT_SIMPLEX,
    cv2.FONT_HERSHEY_COMPLEX,
)
NAMES = ("RIVERSIDE", "University", "SV Nord", "Athletic", "HOME", "United", "Stadium", "VISITORS", "F.C. Hill", "Park")
ALPHABET = list("ABCDEFGHIJKLMNOPRSTUVWYZabcdefghiklmnoprstuvyz0123456789.!-&")


@dataclass(frozen=True)
class Letters:
    """White lettering or a logo on the ground: a picture of coverage, its corner, its axes and its texel in metres."""

    picture: NDArray[np.float32]
    corner: tuple[float, float]
    along: tuple[float, float]
    texel: float
    colour: Colour


def random_letters(rng: np.random.Generator, pitch: Field, paint: Colour) -> tuple[Letters, ...]:
    """Words and logos outside the boundary lines, none nearer than half a metre to a line."""
    found = []
    for _ in range(int(rng.integers(1, 6))):
        height = float(rng.uniform(1.0, 4.5))
        picture = _word(rng, round(height / TEXEL_M)) if rng.random() < 0.7 else _logo(rng, round(height / TEXEL_M))
        length, tall = picture.shape[1] * TEXEL_M, picture.shape[0] * TEXEL_M
        gap = float(rng.uniform(0.5, 3.0))
        side = rng.choice(["near", "far", "left", "right"], p=[0.4, 0.3, 0.15, 0.15])
        half_length, half_width = pitch.length / 2, pitch.width / 2
        if side in ("near", "far"):
            start = rng.uniform(-half_length, max(half_length - length, -half_length + 1))
            corner = (start, -half_width - gap) if side == "near" else (start, half_width + gap + tall)
            along = (1.0, 0.0)
        else:
            start = rng.uniform(-half_width, max(half_width - length, -half_width + 1))
            corner = (-half_length - gap - tall, start) if side == "left" else (half_length + gap, start)
            along = (0.0, 1.0)
        if rng.random() < 0.3:  # to be read from the other side
            picture = np.ascontiguousarray(picture[::-1, ::-1])
        # Mostly the paint of the lines: colour must not tell them apart.
        colour = paint if rng.random() < 0.75 else random_colour(rng, 0.8)
        found.append(Letters(picture, (float(corner[0]), float(corner[1])), along, TEXEL_M, colour))
    return tuple(found)


@lru_cache(maxsize=32)
def writing(seed: int) -> NDArray[np.float32]:
    """A word as coverage, for boards."""
    return _word(np.random.default_rng(seed), 24)


def _word(rng: np.random.Generator, rows: int) -> NDArray[np.float32]:
    """A word or two as coverage; strokes from thin to fat, round or as of a broad pen."""
    text = str(rng.choice(NAMES))
    if rng.random() < 0.6:
        text = "".join(rng.choice(ALPHABET, size=int(rng.integers(2, 16)))) if rng.random() < 0.8 else text.lower()
    font = int(rng.choice(HERSHEY)) | (cv2.FONT_ITALIC if rng.random() < 0.4 else 0)
    scale = rows / 34
    thick = max(1, round(rng.uniform(0.05, 0.28) * rows * 0.5))
    (width, height), below = cv2.getTextSize(text, font, scale, thick)
    margin = thick + 4
    canvas = np.zeros((height + below + 2 * margin, width + 2 * margin), np.uint8)
    cv2.putText(canvas, text, (margin, margin + height), font, scale, 255, thick, cv2.LINE_AA)
    if rng.random() < 0.5:
        size = max(3, thick)
        pen = np.zeros((2 * size + 1, 2 * size + 1), np.uint8)
        angle = rng.uniform(0, 180)
        cv2.ellipse(pen, (size, size), (size, max(1, size // 5)), angle, 0, 360, 1, -1)
        canvas = cv2.dilate(canvas, pen)
    if rng.random() < 0.3:  # only the outline
        edge = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * max(2, thick // 4) + 1,) * 2)
        canvas = canvas - cv2.erode(canvas, edge)
    return np.clip(canvas.astype(np.float32) / 255, 0, 1)


def _logo(rng: np.random.Generator, rows: int) -> NDArray[np.float32]:
    """Rings, discs, shields, leaves and bars."""
    canvas = np.zeros((rows, rows), np.uint8)
    for _ in range(int(rng.integers(1, 7))):
        centre = tuple(int(v) for v in rng.uniform(0.25, 0.75, 2) * rows)
        radii = tuple(max(1, int(v)) for v in rng.uniform(0.08, 0.3, 2) * rows)
        thick = -1 if rng.random() < 0.4 else max(1, int(rng.uniform(0.02, 0.09) * rows))
        shade = 0 if rng.random() < 0.2 else 255
        kind = rng.integers(4)
        if kind < 2:
            angle, sweep = rng.uniform(0, 360), rng.choice([360, 180, 270])
            cv2.ellipse(canvas, centre, radii, angle, 0, int(sweep), shade, thick, cv2.LINE_AA)
        elif kind == 2:
            corners = (rng.uniform(0.1, 0.9, (int(rng.integers(3, 7)), 2)) * rows).astype(np.int32)
            cv2.polylines(canvas, [corners], True, shade, max(1, abs(thick)), cv2.LINE_AA)
        else:
            opposite = tuple(int(v) for v in rng.uniform(0.1, 0.9, 2) * rows)
            cv2.line(canvas, centre, opposite, shade, max(1, abs(thick)), cv2.LINE_AA)
    return canvas.astype(np.float32) / 255
