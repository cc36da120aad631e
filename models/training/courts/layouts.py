"""Random layouts of paint on made-up grounds: fields of all sports, one over another, or lines of no sport."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fields.shapes import Arc, Line, Spot
from fields.template import NAMES, load
from worker.calibration.geometry.camera import Array
from worker.calibration.geometry.field import Field

PAINTS = 4
"""Colours of paint that a layout tells apart at most."""


@dataclass(frozen=True)
class Stripe:
    """Paint of constant width along a polyline: `points` (n, 2) metres, `paint` the number of its colour."""

    points: Array
    width: float
    paint: int


@dataclass(frozen=True)
class Layout:
    """The paint on a ground, metres; `half`: half the length and width of the largest field."""

    stripes: tuple[Stripe, ...]
    half: NDArray[np.float64]


def random_layout(rng: np.random.Generator) -> Layout:
    """A field of a sport, several over each other, or lines, arcs, circles and ticks at random."""
    kind = rng.choice(["one", "several", "random"], p=[0.5, 0.25, 0.25])
    if kind == "random":
        return _random(rng)
    stripes: list[Stripe] = []
    half = np.ones(2)
    for paint in range(1 if kind == "one" else int(rng.integers(2, 5))):
        template = load(str(rng.choice(NAMES)))
        size = {name: extent.default for name, extent in template.size.items()}
        size["line"] *= float(np.exp(rng.normal(0, 0.25)))
        turn = np.radians(rng.choice([0.0, 90.0])) if paint else 0.0
        matrix = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) * np.exp(rng.normal(0, 0.1))
        offset = rng.normal(0, 2, 2) if paint else np.zeros(2)
        stripes += [
            Stripe(_centre(shape) @ matrix.T + offset, shape_width(shape), paint % PAINTS)
            for shape in template.markings(size)
        ]
        if paint == 0:
            half = np.abs(np.concatenate([stripe.points for stripe in stripes])).max(axis=0)
    return Layout(tuple(stripes), half)


def field_layout(pitch: Field) -> tuple[Layout, list[str]]:
    """The markings of one field, and the colours that their paints' numbers stand for."""
    markings = pitch.markings()
    colours = list(dict.fromkeys(marking.colour for marking in markings))
    stripes = tuple(Stripe(marking.centre, marking.width, colours.index(marking.colour)) for marking in markings)
    half = np.abs(np.concatenate([stripe.points for stripe in stripes])).max(axis=0)
    return Layout(stripes, half), colours


def shape_width(shape: Line | Arc | Spot) -> float:
    """Return the width of a shape's paint, or the diameter of a spot, m."""
    return shape.diameter if isinstance(shape, Spot) else shape.width


def _centre(shape: Line | Arc | Spot) -> Array:
    match shape:
        case Line():
            return np.array(shape.points)
        case Arc():
            angle = np.linspace(shape.start, shape.end, max(8, int((shape.end - shape.start) * 16)))
            return np.array(shape.centre) + shape.radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        case Spot():
            reach = shape.diameter / 8
            return np.array([shape.centre, shape.centre]) + [[-reach, 0.0], [reach, 0.0]]


def _random(rng: np.random.Generator) -> Layout:
    half = np.exp(rng.uniform(np.log(3), np.log(50), 2))
    usual = float(np.exp(rng.uniform(np.log(0.03), np.log(0.15))))
    paints = int(rng.integers(1, PAINTS + 1))
    stripes: list[Stripe] = []

    def add(points: Array) -> None:
        width = usual * float(np.exp(rng.normal(0, 0.2)))
        stripes.append(Stripe(points, width, int(rng.integers(paints))))

    for axis in (0, 1):
        for at in rng.uniform(-1, 1, rng.integers(1, 6)) * half[axis]:
            ends = np.sort(rng.uniform(-1, 1, 2)) if rng.random() < 0.6 else np.array([-1.0, 1.0])
            line = np.empty((2, 2))
            line[:, axis], line[:, 1 - axis] = at, ends * half[1 - axis]
            if rng.random() < 0.2:
                _dashed(rng, line, add)
            else:
                add(line)
            if rng.random() < 0.2:
                _ticks(rng, line, add)
    for _ in range(rng.integers(0, 4)):
        add(rng.uniform(-1, 1, (2, 2)) * half)
    for _ in range(rng.integers(0, 5)):
        start, reach = rng.uniform(0, 2 * np.pi), 2 * np.pi if rng.random() < 0.4 else rng.uniform(0.5, 4.0)
        angle = np.linspace(start, start + reach, 64)
        radius = float(np.exp(rng.uniform(np.log(0.3), np.log(12))))
        add(rng.uniform(-1, 1, 2) * half + radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1))
    return Layout(tuple(stripes), half)


def _dashed(rng: np.random.Generator, line: Array, add: Callable[[Array], None]) -> None:
    paint, gap = np.exp(rng.uniform(np.log(0.1), np.log(3), 2))
    length = float(np.linalg.norm(line[1] - line[0]))
    unit = (line[1] - line[0]) / max(length, 1e-6)
    for begin in np.arange(0, length - paint, paint + gap)[:60]:
        add(line[0] + np.array([[begin], [begin + paint]]) * unit)


def _ticks(rng: np.random.Generator, line: Array, add: Callable[[Array], None]) -> None:
    length = float(np.linalg.norm(line[1] - line[0]))
    unit = (line[1] - line[0]) / max(length, 1e-6)
    across, every = np.array([-unit[1], unit[0]]), float(rng.uniform(0.5, 5))
    reach = float(rng.uniform(0.1, 0.6)) * np.array([[0.0], [1.0]])
    for at in np.arange(0, length, every)[:60]:
        add(line[0] + at * unit + reach * across)
