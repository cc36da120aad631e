"""Training data: windows of random frames of random venues, drawn where there is something to learn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from models.training.pitches.render import Conditions, Rendering, render_window
from models.training.pitches.venues import random_camera, random_field
from worker.calibration.geometry.camera import Array, Camera, inside
from worker.calibration.geometry.field import Field

CROP_SIZE = 288
# How often the middle of a crop is what.
KINDS = {"marking": 0.22, "near marking": 0.26, "steep marking": 0.16, "pitch": 0.1, "outside": 0.2, "frame": 0.06}


@dataclass(frozen=True)
class View:
    """A window (x, y, width, height) of what a camera sees of a pitch."""

    field: Field
    camera: Camera
    window: tuple[int, int, int, int]

    def rendered(self, conditions: Conditions, rng: np.random.Generator) -> Rendering:
        """The window under some conditions; `rng` is the sensor's."""
        return render_window(self.field, self.camera, conditions, self.window, rng)


def random_crop(rng: np.random.Generator, size: int = CROP_SIZE) -> Rendering:
    """A square window of `size` pixels of a frame that exists nowhere else."""
    return random_view(rng, size).rendered(Conditions.random(rng), rng)


def random_view(rng: np.random.Generator, size: int = CROP_SIZE) -> View:
    """A square window of `size` pixels of a random camera at a random pitch, where there is something to learn."""
    while True:
        field = random_field(rng)
        camera = random_camera(rng, field)
        middle = _interesting(rng, field, camera)
        if middle is not None:
            break
    corner = np.round(middle + rng.uniform(-0.45, 0.45, 2) * size - size / 2).astype(int)
    corner = np.clip(corner, 0, np.array(camera.intrinsics.size) - size)
    return View(field, camera, (int(corner[0]), int(corner[1]), size, size))


def _interesting(rng: np.random.Generator, field: Field, camera: Camera) -> NDArray[np.float64] | None:
    """A pixel (2,): on a marking, on the grass, just outside the pitch, or anywhere; None if the camera sees none."""
    kind = str(rng.choice(list(KINDS), p=list(KINDS.values())))
    if kind == "frame":
        return rng.uniform(0, 1, 2) * camera.intrinsics.size
    half = np.array([field.length, field.width]) / 2
    if kind in ("marking", "near marking", "steep marking"):
        lines = field.line_points(0.5)
        points = lines.position
    elif kind == "pitch":
        points = field.lift(rng.uniform(-1, 1, (50, 2)) * half)
    else:
        xy = rng.uniform(-1, 1, (400, 2)) * (half + 15)
        points = field.lift(xy[(np.abs(xy) > half).any(axis=1)])
    pixels = camera.project(points)
    seen = np.flatnonzero(inside(pixels, camera.intrinsics.size))
    if len(seen) == 0:
        return None
    # Weighted by size in the picture, or else nearly all of a line is far away.
    weight = _nearness(camera, points[seen]) if kind == "near marking" else np.ones(len(seen))
    if kind == "steep marking":
        # Lines seen lengthwise run up the picture as posts do, and must not be taken for them.
        ahead = camera.project(points[seen] + 0.1 * lines.tangent[seen]) - pixels[seen]
        weight = _nearness(camera, points[seen]) * (np.abs(ahead[:, 1]) > 1.5 * np.abs(ahead[:, 0]))
        if not weight.any():
            return None
    return pixels[rng.choice(seen, p=weight / weight.sum())]


def _nearness(camera: Camera, points: Array) -> Array:
    return 1 / np.linalg.norm(points - camera.pose.position, axis=1) ** 2
