"""The background of the pitch: sky and clouds, buildings, trees, stands, fences, boards and hoardings.

A wall is a plane with a texture in metres along it and in metres of height; it hides what is farther away.
"""

from __future__ import annotations

import cv2
import numpy as np

from models.training.drawing.colours import hsv
from models.training.drawing.lettering import writing
from models.training.drawing.noise import Noise, Patch, Plane, band, bands, mix, smooth_step, step
from models.training.pitches.conditions import Conditions
from models.training.pitches.world import Wall, World
from worker.calibration.geometry.field import Field

OUTWARD = {"near": (0.0, -1.0), "far": (0.0, 1.0), "left": (-1.0, 0.0), "right": (1.0, 0.0)}


def shade_sky(conditions: Conditions, rays: Plane) -> Plane:
    """Sky colours (H, W, 3) along rays (H, W, 3): a gradient, and clouds on a plane overhead."""
    rng = np.random.default_rng([conditions.world, 31])
    length = np.linalg.norm(rays, axis=-1)
    up = rays[..., 2] / length
    if conditions.light == "floodlight":
        top, low = hsv(230, 0.5, 0.05), hsv(230, 0.3, 0.15)
    elif conditions.light == "cloud":
        top, low = (
            hsv(220, rng.uniform(0, 0.2), rng.uniform(0.5, 0.8)),
            hsv(220, rng.uniform(0, 0.15), rng.uniform(0.75, 1)),
        )
    else:
        top, low = hsv(215, rng.uniform(0.4, 0.8), rng.uniform(0.5, 0.9)), hsv(210, 0.2, 0.95)
    colour = mix(np.broadcast_to(low, rays.shape), top, np.clip(up * 2.5, 0, 1))
    clouds = Noise.draw(rng, {0.3: 0.4, 0.8: 0.6, 2.0: 0.8, 5.0: 1.0})
    flat = np.maximum(up, 0.03)
    sky = Patch(
        (rays[..., 0] / length / flat).astype(np.float32),
        (rays[..., 1] / length / flat).astype(np.float32),
        length.astype(np.float32),
        up > 0,
    )
    cover = smooth_step(clouds.at(sky) + np.float32(rng.uniform(-1.5, 1.5)), -0.5, 1.8)
    white = np.float32(0.15 if conditions.light == "floodlight" else rng.uniform(0.85, 1.1))
    return mix(colour, np.float32([1.0, 0.98, 0.97]) * white, cover * np.clip(up * 12, 0, 1))


def add_walls(
    pitch: Field, world: World, conditions: Conditions, centre: Plane, rays: Plane, colour: Plane, depth: Plane
) -> tuple[Plane, Plane, Plane]:
    """Put the walls in front of `colour` (H, W, 3).

    Returns the colours, the depths (H, W) after it, and how much of each pixel (H, W) the walls hide.
    """
    colour, depth, hidden = colour.copy(), depth.copy(), np.zeros_like(depth)
    dim = np.float32(0.35 if conditions.light == "floodlight" else 1.0)
    for wall in sorted(world.walls, key=lambda wall: -wall.distance):
        found = _wall_patch(pitch, wall, centre, rays)
        if found is None:
            continue
        place, patch = found
        shade, opacity = _PAINTERS[wall.kind](wall, patch)
        opacity = opacity * patch.seen * step(patch.y, patch.across(0, 1)) * (patch.depth < depth[place] * 1.02)
        lower, upper = wall.extent
        opacity = opacity * step(patch.x - lower, patch.across(1, 0)) * step(upper - patch.x, patch.across(1, 0))
        colour[place] = mix(colour[place], shade * dim, opacity)
        depth[place] = np.where(opacity > 0.5, patch.depth, depth[place])
        hidden[place] = np.maximum(hidden[place], opacity)
    return colour, depth, hidden


def _wall_patch(pitch: Field, wall: Wall, centre: Plane, rays: Plane) -> tuple[tuple[slice, slice], Patch] | None:
    """The part of a window that sees a wall's front: its place, and metres along the wall and of height there."""
    ox, oy = OUTWARD[wall.side]
    base = (pitch.length if ox else pitch.width) / 2 + wall.distance
    ahead = base + wall.lean * centre[2] - (centre[0] * ox + centre[1] * oy)
    if ahead <= 0.5:
        return None
    closing = rays[..., 0] * ox + rays[..., 1] * oy - wall.lean * rays[..., 2]
    depth = ahead / np.where(closing > 1e-4, closing, 1e9)
    height = centre[2] + depth * rays[..., 2]
    seen = (closing > 1e-3) & (height > -0.1) & (height < 1.3 * wall.height) & (depth < 700)
    rows, columns = np.flatnonzero(seen.any(axis=1)), np.flatnonzero(seen.any(axis=0))
    if len(rows) < 3 or len(columns) < 3:
        return None
    place = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
    along = centre[0] + depth * rays[..., 0] if oy else centre[1] + depth * rays[..., 1]
    patch = Patch(
        np.clip(along, -1e4, 1e4).astype(np.float32),
        np.clip(height, -1e3, 1e3).astype(np.float32),
        np.minimum(depth, 1e6).astype(np.float32),
        seen,
    )
    return place, patch.part(*place)


def _trees(wall: Wall, patch: Patch) -> tuple[Plane, Plane]:
    """Crowns with bright leaves over dark gaps; trunks below."""
    leaves = wall.noise.at(patch)
    crown = patch.y / np.float32(wall.height)
    # Which tree this is decides its height and shade.
    tree = np.sin(patch.x / wall.period * 2.1 + wall.seed % 7) + np.sin(patch.x / wall.period * 0.83)
    top = np.float32(0.75) + 0.12 * tree + 0.05 * leaves
    opacity = smooth_step(top - crown, 0.0, 0.03)
    bright = np.maximum(0.55 + 0.3 * leaves + 0.5 * crown, 0.04)
    colour = wall.colour * bright[..., None]
    below = smooth_step(0.28 + 0.08 * leaves - crown, 0, 0.02)
    trunks = bands(patch.x + 0.1 * leaves, wall.period * 0.9, 0.35, patch.across(1, 0))
    bark = wall.accent * np.float32(0.6) * (1 + 0.2 * leaves)[..., None]
    colour = mix(colour, wall.colour * np.float32(0.25), below)
    colour = mix(colour, bark, below * trunks)
    if wall.seed % 2:  # one sees through between the trunks
        opacity = opacity * (1 - below * (1 - trunks))
    return colour, opacity


def _fence(wall: Wall, patch: Patch) -> tuple[Plane, Plane]:
    """Posts, rails and mesh."""
    rng = np.random.default_rng(wall.seed)
    across, up = patch.across(1, 0), patch.across(0, 1)
    posts = bands(patch.x, wall.period, float(rng.uniform(0.04, 0.15)), across)
    rails = band(patch.y - np.float32(wall.height), np.float32(0.06), up)
    if rng.random() < 0.6:
        rails = np.maximum(rails, band(patch.y - np.float32(wall.height / 2), np.float32(0.05), up))
    mesh_size, wire = float(rng.uniform(0.05, 0.2)), float(rng.uniform(0.003, 0.01))
    mesh = np.maximum(bands(patch.x, mesh_size, wire, across), bands(patch.y, mesh_size, wire, up))
    share = np.maximum(np.maximum(posts, rails), 0.8 * mesh)
    below = step(np.float32(wall.height) - patch.y, up)
    return np.broadcast_to(wall.accent, (*share.shape, 3)), share * below


def _hoarding(wall: Wall, patch: Patch) -> tuple[Plane, Plane]:
    """Panels of different colours with blocks that read as writing."""
    rng = np.random.default_rng(wall.seed)
    palette = np.stack(
        [hsv(*v) for v in np.column_stack([rng.uniform(0, 360, 9), rng.random(9), rng.uniform(0.1, 1, 9)])]
    )
    if rng.random() < 0.5:
        palette = np.where(rng.random((9, 1)) < 0.6, np.float32([0.95, 0.95, 0.95]), palette).astype(np.float32)
    panel = np.floor(patch.x / wall.period).astype(int)
    colour = palette[(panel * 7 + panel // 3) % 9]
    ink = palette[(panel * 5 + 4) % 9]
    letter = np.sin(patch.x * 23 + 3 * np.sin(patch.x * 5.3)) * np.sin(patch.y * 11 / wall.height) > 0.15
    body = np.abs(patch.y / np.float32(wall.height) - 0.5) < 0.28
    fade = np.clip(1.5 - patch.axes[1] / 0.1, 0, 1)
    colour = mix(colour, ink, letter * body * fade)
    seam = bands(patch.x, wall.period, 0.04, patch.across(1, 0))
    colour = colour * (1 - 0.5 * seam)[..., None]
    return colour, step(np.float32(wall.height) - patch.y, patch.across(0, 1))


def _stand(wall: Wall, patch: Patch) -> tuple[Plane, Plane]:
    """Rows of seats or benches on steps, aisles, people here and there."""
    rng = np.random.default_rng(wall.seed)
    up, across = patch.across(0, 1), patch.across(1, 0)
    rise = wall.period * 0.5
    grain = wall.noise.at(patch)
    concrete = hsv(rng.uniform(0, 360), rng.uniform(0, 0.15), rng.uniform(0.35, 0.8))
    colour = concrete * (1 + 0.1 * grain)[..., None]
    rows = bands(patch.y, rise, rise * float(rng.uniform(0.2, 0.65)), up)
    seats = bands(patch.x, 0.55, float(rng.uniform(0.38, 0.55)), across) if rng.random() < 0.6 else 1.0
    block = np.mod(np.floor(patch.x / 9.0), 3) == 1
    tone = np.where(block[..., None], wall.accent, wall.colour).astype(np.float32)
    colour = mix(colour, tone, rows * seats)
    edge = bands(patch.y + rise * 0.3, rise, 0.03, up)
    colour = colour * (1 - 0.4 * edge)[..., None]
    aisle = bands(patch.x, 14.0, 1.3, across)
    colour = mix(colour, concrete * np.float32(0.9), aisle)
    if rng.random() < 0.6:
        crowd = Noise.draw(rng, {0.25: 1.0, 0.6: 0.5})
        share = smooth_step(crowd.at(patch), float(rng.uniform(-0.5, 1.8)), 2.2)
        shirts = np.stack([hsv(h, s, v) for h, s, v in rng.uniform([0, 0, 0.1], [360, 0.8, 1.0], (8, 3))])
        who = (np.floor(patch.x / 0.5) * 3 + np.floor(patch.y / rise) * 5).astype(int) % 8
        colour = mix(colour, shirts[who], share)
    return colour, step(np.float32(wall.height) - patch.y, up)


def _building(wall: Wall, patch: Patch) -> tuple[Plane, Plane]:
    """A facade with windows."""
    colour = wall.colour * (1 + 0.05 * wall.noise.at(patch))[..., None]
    windows = bands(patch.x, wall.period, wall.period * 0.45, patch.across(1, 0))
    windows = windows * bands(patch.y - 1.5, 3.2, 1.5, patch.across(0, 1))
    colour = mix(colour, wall.accent * np.float32(0.4), windows)
    return colour, step(np.float32(wall.height) - patch.y, patch.across(0, 1))


def _board(wall: Wall, patch: Patch) -> tuple[Plane, Plane]:
    """A scoreboard or a practice wall: dark, with a white frame and grid."""
    up, across = patch.across(0, 1), patch.across(1, 0)
    colour = np.broadcast_to(wall.colour * np.float32(0.5), (*patch.x.shape, 3))
    low = np.float32(0.3)
    frame = np.maximum(
        bands(patch.x - wall.extent[0], (wall.extent[1] - wall.extent[0]) / (1 + wall.seed % 5), 0.1, across),
        bands(patch.y - low, (wall.height - low) / (1 + wall.seed % 3), 0.1, up),
    )
    if wall.seed % 3 == 0:
        picture = writing(wall.seed)
        texel = (wall.height - 0.3) * 0.6 / picture.shape[0]
        column = (patch.x - np.float32(wall.extent[0] + 0.4)) / np.float32(texel)
        row = (np.float32(wall.height * 0.9) - patch.y) / np.float32(texel)
        ink = cv2.remap(picture, column, row, cv2.INTER_LINEAR, borderValue=0)
        frame = np.maximum(frame, ink * np.clip(texel * 3 / up, 0, 1))
    colour = mix(colour, wall.accent, frame)
    return colour, step(np.float32(wall.height) - patch.y, up) * step(patch.y - low, up)


_PAINTERS = {
    "trees": _trees,
    "fence": _fence,
    "hoarding": _hoarding,
    "stand": _stand,
    "building": _building,
    "board": _board,
}
