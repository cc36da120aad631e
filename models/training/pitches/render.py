"""Pictures of a pitch as a fixed camera delivers them, and exact masks of the markings in them.

    rendering = render_frame(field, camera, Conditions.fair(), np.random.default_rng(0))

No picture is stored anywhere: every pixel is computed from where its ray meets the world.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from models.training.pitches.backdrop import add_walls, shade_sky
from models.training.pitches.conditions import Conditions
from models.training.pitches.objects import Canvas, draw_objects
from models.training.pitches.sensor import add_air, expose
from models.training.pitches.surface import shade_ground, window_rays
from models.training.pitches.world import World, build_world
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field

__all__ = ["Conditions", "Rendering", "render_frame", "render_window"]

MARGIN = 8
BAND_ROWS = 256


@dataclass(frozen=True)
class Rendering:
    """A raw (distorted) picture and what is true about it.

    `frame` (H, W, 3) uint8, blue green red; `mask` (H, W) float32: share of the pixel covered by visible markings;
    `target` (H, W) float32: the same with lines at least 1.5 px wide, which is what the network learns to say.
    """

    frame: NDArray[np.uint8]
    mask: NDArray[np.float32]
    target: NDArray[np.float32]


def render_frame(field: Field, camera: Camera, conditions: Conditions, rng: np.random.Generator) -> Rendering:
    """The whole frame of `camera`. `conditions.world` seeds the world, `rng` only the sensor's noise."""
    world = build_world(field, conditions)
    width, height = camera.intrinsics.size
    # In bands of rows, so that a 4K frame needs no gigabytes.
    parts = [
        _paint(field, world, camera, conditions, (0, top, width, min(BAND_ROWS, height - top)))
        for top in range(0, height, BAND_ROWS)
    ]
    picture, mask, target = (np.concatenate(planes) for planes in zip(*parts, strict=True))
    frame = expose(conditions, picture, (0, 0), (width, height), rng)
    return Rendering(frame, mask.astype(np.float32) / 255, target.astype(np.float32) / 255)


def render_window(
    field: Field, camera: Camera, conditions: Conditions, window: tuple[int, int, int, int], rng: np.random.Generator
) -> Rendering:
    """A window (x, y, width, height) of the frame of `camera`, without rendering the rest."""
    world = build_world(field, conditions)
    x, y, width, height = window
    around = (x - MARGIN, y - MARGIN, width + 2 * MARGIN, height + 2 * MARGIN)
    picture, mask, target = _paint(field, world, camera, conditions, around)
    frame = expose(conditions, picture, (around[0], around[1]), camera.intrinsics.size, rng)
    inner = (slice(MARGIN, -MARGIN), slice(MARGIN, -MARGIN))
    return Rendering(
        np.ascontiguousarray(frame[inner]), mask[inner].astype(np.float32) / 255, target[inner].astype(np.float32) / 255
    )


def _paint(
    field: Field, world: World, camera: Camera, conditions: Conditions, window: tuple[int, int, int, int]
) -> tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.uint8]]:
    """Light (H, W, 3), mask and target (H, W) of a window before it meets the lens, 8 bit."""
    centre = camera.pose.position
    rays = window_rays(camera, window)
    ground = shade_ground(field, world, conditions, centre, rays)
    dim = 0.9 if conditions.light == "floodlight" else 1.0
    lit = ground.patch.seen
    colour = np.where(lit[..., None], ground.colour * np.float32(dim), shade_sky(conditions, rays))
    depth = np.where(lit, ground.patch.depth, np.float32(1e6))
    colour, depth, hidden = add_walls(field, world, conditions, centre, rays, colour, depth)
    away = np.where(depth < 1e6, depth, np.float32(600 if conditions.fog else 0))
    colour = add_air(conditions, colour, away)
    picture = (np.clip(colour, 0, 1) * 255).astype(np.uint8)
    seen = 1 - hidden
    labels = tuple(
        (np.clip(label * seen, 0, 1) * 255 + 0.5).astype(np.uint8) for label in (ground.coverage, ground.target)
    )
    canvas = Canvas(picture, labels, camera, (window[0], window[1]), dim)
    draw_objects(field, world, conditions, canvas)
    return picture, labels[0], labels[1]
