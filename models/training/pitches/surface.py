"""The ground: where rays meet it, the grass, the markings on it, and what lies beside the pitch."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from models.training.drawing.colours import hsv
from models.training.drawing.lettering import Letters
from models.training.drawing.noise import Noise, Patch, Plane, band, bands, mix, smooth_step, step
from models.training.pitches.conditions import Conditions
from models.training.pitches.world import World
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field, Marking

FARTHEST_M = 2500.0
LEARNT_WIDTH_PX = 1.5
FAINTEST_WIDTH_PX = (0.06, 0.16)
GRID_STEP = 8


@dataclass
class Ground:
    """The shaded ground of a window.

    `colour` (H, W, 3) blue, green, red in 0..1; `coverage` (H, W): share of it in a marking; `target` (H, W):
    the same with every marking at least `LEARNT_WIDTH_PX` wide, so that lines thinner than a pixel can be learnt, and
    without those that nobody could see.
    """

    patch: Patch
    colour: Plane
    coverage: Plane
    target: Plane


def shade_ground(pitch: Field, world: World, conditions: Conditions, centre: Plane, rays: Plane) -> Ground:
    """The ground as seen from `centre` (3,) along `rays` (H, W, 3)."""
    patch = ground_patch(pitch, world, centre, rays)
    outside = _outside(pitch, patch)
    colour = _grass(pitch, world, conditions, patch, outside)
    colour = _beside(pitch, world, patch, outside, colour)
    if conditions.other_lines:
        colour = _other_lines(pitch, world, conditions, patch, colour)
    light = _light(pitch, world, conditions, patch)
    coverage, target = marking_shares(pitch, patch)
    painted, lasting = coverage, np.float32(1)
    if coverage.any():
        rough = np.float32(0.012 * (0.3 + conditions.wear) * conditions.wobble) * world.edge_noise.at(patch)
        painted, _ = marking_shares(pitch, patch, rough)
    lettering = [(letters.colour, _letter_coverage(letters, patch)) for letters in world.letters]
    lettering = [(ink, share) for ink, share in lettering if share is not None]
    if lettering or coverage.any():
        opacity, lasting = _paint(world, conditions, patch)
        shade = (1 + 0.12 * world.paint_noise.at(patch))[..., None]
        bare = colour
        colour = mix(bare, world.paint * shade, painted * opacity)
        target = target * _visible(conditions, patch, np.abs(colour - bare).max(axis=-1) * light)
        for ink, share in lettering:
            colour = mix(colour, ink * shade, share * np.maximum(opacity, 0.3))
    if conditions.rain:  # wet ground mirrors the sky, more so far away
        gloss = np.float32(0.45 * conditions.rain) * smooth_step(world.cloud_noise.at(patch) + patch.depth / 40, 0, 3)
        colour = mix(colour, np.float32([0.75, 0.72, 0.7]), gloss)
    snow = _snow(world, conditions, patch)
    if snow is not None:
        colour = mix(colour, np.float32([0.97, 0.94, 0.92]), snow)
        lasting = lasting * (1 - smooth_step(snow, 0.3, 0.7))
    colour = colour * light[..., None]
    seen = patch.seen
    return Ground(patch, colour, np.where(seen, coverage * lasting, 0), np.where(seen, target * lasting, 0))


def window_rays(camera: Camera, window: tuple[int, int, int, int]) -> Plane:
    """Directions in the world (H, W, 3) through the pixels of a window (x, y, width, height) of the raw frame.

    The lens is inverted every `GRID_STEP` pixels and interpolated between: less than 0.01 px off.
    """
    x, y, width, height = window
    columns = np.arange(x, x + width + GRID_STEP, GRID_STEP)
    rows = np.arange(y, y + height + GRID_STEP, GRID_STEP)
    grid = camera.rays(np.stack(np.meshgrid(columns, rows), axis=-1).astype(float))
    if np.isnan(grid).any():
        grid = np.where(np.isnan(grid), [0.0, 0.0, 1.0], grid)
    across, down = _weights(width, len(columns)), _weights(height, len(rows))
    return np.stack([down @ grid[..., axis] @ across.T for axis in range(3)], axis=-1).astype(np.float32)


def _weights(count: int, nodes: int) -> Plane:
    at = np.arange(count) / GRID_STEP
    return np.maximum(0, 1 - np.abs(at[:, None] - np.arange(nodes)))


def ground_patch(pitch: Field, world: World | None, centre: Plane, rays: Plane) -> Patch:
    """Return the places where rays (H, W, 3) from `centre` (3,) meet the roof, or the plane z = 0 around it."""
    dx, dy, dz = (rays[..., i].astype(np.float64) for i in range(3))
    cx, cy, cz = (float(v) for v in centre)
    down = dz < -cz / FARTHEST_M
    depth = np.where(down, -cz / np.where(down, dz, -1.0), FARTHEST_M)
    if pitch.ridge is not None:
        enter, leave = np.zeros_like(depth), np.full_like(depth, np.inf)
        # The body under the roof is convex: a ray is inside it from the last plane entered to the first one left.
        for a, b, c in _roof_planes(pitch):
            slope = dz - a * dx - b * dy
            height = cz - (a * cx + b * cy + c)
            at = -height / np.where(np.abs(slope) < 1e-12, 1e-12, slope)
            entering = slope < 0
            enter = np.where(entering, np.maximum(enter, at), enter)
            leave = np.where(entering, leave, np.minimum(leave, at))
        depth = np.where((enter < leave) & (enter < depth) & down, enter, depth)
    x, y = cx + depth * dx, cy + depth * dy
    if world is not None:
        flat = Patch(x.astype(np.float32), y.astype(np.float32), depth.astype(np.float32), down)
        lift = world.bumps.at(flat)
        nearer = depth * (1 - lift / np.maximum(cz, 1.0))
        x, y = cx + nearer * dx, cy + nearer * dy
    return Patch(x.astype(np.float32), y.astype(np.float32), depth.astype(np.float32), down)


def _roof_planes(pitch: Field) -> list[tuple[float, float, float]]:
    """z = a x + b y + c of the planes of the roof (`Field.height`)."""
    planes = [(u, v, a, pitch.ridge_height / b) for u, v, a, b in pitch.roof_planes]
    return [(u * slope, v * slope, slope * a) for u, v, a, slope in planes]


def marking_shares(pitch: Field, patch: Patch, rough: Plane | float = 0.0) -> tuple[Plane, Plane]:
    """Share (H, W) of each pixel covered by markings, as they are and as the network learns them.

    `rough` (H, W), metres, shifts the edges of the first.
    """
    coverage, target = np.zeros_like(patch.x), np.zeros_like(patch.x)
    for marking in pitch.markings():
        place = _near(marking, patch)
        if place is None:
            continue
        part = patch.part(*place)
        offset, beyond, across, along = _offsets(marking, part)
        inside = step(-beyond, along) * part.seen
        width = np.float32(marking.width)
        shifted = offset + (rough[place] if isinstance(rough, np.ndarray) else rough)
        wide = np.maximum(width, LEARNT_WIDTH_PX * across)
        learnt = band(offset, wide, across) * smooth_step(width / across, *FAINTEST_WIDTH_PX)
        for total, share in ((coverage, band(shifted, width, across)), (target, learnt)):
            total[place] = np.maximum(total[place], share * inside)
    return coverage, target


def marking_distance(pitch: Field, patch: Patch) -> Plane:
    """Metres (H, W) on the ground to the nearest edge of a marking."""
    nearest = np.full_like(patch.x, np.inf)
    for marking in pitch.markings():
        offset, beyond, _, _ = _offsets(marking, patch)
        aside = np.maximum(np.abs(offset) - np.float32(marking.width / 2), 0)
        nearest = np.minimum(nearest, np.hypot(aside, np.maximum(beyond, 0)))
    return nearest


def _near(marking: Marking, patch: Patch) -> tuple[slice, slice] | None:
    """Rows and columns of the window that a marking may touch; None if it touches none."""
    low, high = marking.centre.min(axis=0) - 1.0, marking.centre.max(axis=0) + 1.0
    near = patch.seen & (patch.x > low[0]) & (patch.x < high[0]) & (patch.y > low[1]) & (patch.y < high[1])
    rows, columns = np.flatnonzero(near.any(axis=1)), np.flatnonzero(near.any(axis=0))
    if len(rows) == 0:
        return None
    # The Jacobian needs two pixels each way.
    return (
        slice(max(rows[0] - 2, 0), max(rows[-1] + 3, 2)),
        slice(max(columns[0] - 2, 0), max(columns[-1] + 3, 2)),
    )


def _offsets(marking: Marking, patch: Patch) -> tuple[Plane, Plane, Plane, Plane]:
    """Distance across the line, distance beyond its ends, and the size of a pixel in both directions, metres."""
    start, end = marking.centre[0], marking.centre[-1]
    x, y = patch.x, patch.y
    if len(marking.centre) > 2:
        middle, radius = _circle(marking)
        dx, dy = x - np.float32(middle[0]), y - np.float32(middle[1])
        distance = np.hypot(dx, dy) + np.float32(1e-6)
        across = patch.across(dx / distance, dy / distance)
        along = patch.across(-dy / distance, dx / distance)
        if marking.closed:
            return distance - np.float32(radius), np.full_like(x, -1e3), across, along
        halfway = marking.centre[len(marking.centre) // 2] - middle
        facing = np.arctan2(halfway[1], halfway[0])
        span = np.arccos(np.clip((start - middle) @ halfway / radius**2, -1, 1))
        turned = np.abs(np.mod(np.arctan2(dy, dx) - facing + np.pi, 2 * np.pi) - np.pi)
        return distance - np.float32(radius), np.float32(radius) * (turned - np.float32(span)), across, along
    centre, length = (start + end) / 2, float(np.linalg.norm(end - start))
    tx, ty = ((end - start) / length).astype(np.float32)
    dx, dy = x - np.float32(centre[0]), y - np.float32(centre[1])
    if length < marking.width:  # a spot: a disc
        distance = np.hypot(dx, dy) + np.float32(1e-6)
        across = patch.across(dx / distance, dy / distance)
        return distance, np.full_like(x, -1e3), across, across
    ahead = np.abs(tx * dx + ty * dy) - np.float32((length + marking.width) / 2)
    return tx * dy - ty * dx, ahead, patch.across(-ty, tx), patch.across(tx, ty)


def _circle(marking: Marking) -> tuple[Plane, float]:
    """Centre and radius of a marking that is an arc, from three of its points."""
    count = len(marking.centre)
    a, b, c = marking.centre[0], marking.centre[count // 3], marking.centre[2 * count // 3]
    system = 2 * np.array([b - a, c - a])
    centre = np.linalg.solve(system, [b @ b - a @ a, c @ c - a @ a])
    return centre, float(np.linalg.norm(a - centre))


def _outside(pitch: Field, patch: Patch) -> Plane:
    """Metres outside the boundary lines, negative inside, round at the corners."""
    ex = np.abs(patch.x) - np.float32(pitch.length / 2)
    ey = np.abs(patch.y) - np.float32(pitch.width / 2)
    return np.hypot(np.maximum(ex, 0), np.maximum(ey, 0)) + np.minimum(np.maximum(ex, ey), 0)


def _grass(pitch: Field, world: World, conditions: Conditions, patch: Patch, outside: Plane) -> Plane:
    light, dark = world.grass
    _, long = patch.axes
    colour = mix(np.broadcast_to(light, (*patch.x.shape, 3)), dark, _mowing(world, patch, long))
    worn = _worn_places(pitch, patch) + 0.35 * world.wear_noise.at(patch)
    wear = np.float32(conditions.wear) * smooth_step(worn - (0.8 - conditions.wear), 0, 0.5)
    soil = world.soil
    if conditions.turf == "artificial":
        soil = light * np.float32(0.75)
    colour = mix(colour, soil, np.where(outside < 3, wear, 0))
    colour = colour * np.maximum(1 + world.turf_noise.at(patch), 0.15)[..., None]
    return colour * (1 + world.tint * world.tint_noise.at(patch)[..., None])


def _mowing(world: World, patch: Patch, long: Plane) -> Plane:
    """0..1 between the two colours of the mowing pattern."""
    cosine, sine = np.float32(np.cos(world.stripe_angle)), np.float32(np.sin(world.stripe_angle))
    period = world.stripe_period
    soft = long + np.float32(0.15)
    if world.stripe_kind == "rings":
        return bands(np.hypot(patch.x, patch.y), period, period / 2, soft)
    along = bands(cosine * patch.x + sine * patch.y, period, period / 2, soft)
    if world.stripe_kind == "stripes":
        return along
    other = bands(cosine * patch.y - sine * patch.x, period, period / 2, soft)
    return along + other - 2 * along * other if world.soil[0] > 0.3 else (along + other) / 2


def _worn_places(pitch: Field, patch: Patch) -> Plane:
    """High where feet go: goal mouths, the penalty marks, the middle, along the touchlines."""
    x, y = np.abs(patch.x), patch.y
    goal = np.exp(-(((x - pitch.length / 2 + 3) / 4.0) ** 2) - (y / 4.5) ** 2)
    mark = 0.6 * np.exp(-(((x - pitch.length / 2 + 11) / 2.5) ** 2) - (y / 2.5) ** 2)
    middle = 0.6 * np.exp(-((x / 4) ** 2) - (y / 4) ** 2)
    touch = 0.5 * np.exp(-(((np.abs(y) - pitch.width / 2) / 0.8) ** 2))
    return goal + mark + middle + touch


def _beside(pitch: Field, world: World, patch: Patch, outside: Plane, colour: Plane) -> Plane:
    """The belts around the pitch."""
    if outside.max() < world.zones[0].start:
        return colour
    ex, ey = np.abs(patch.x) - np.float32(pitch.length / 2), np.abs(patch.y) - np.float32(pitch.width / 2)
    size = np.where(ex > ey, patch.across(1, 0), patch.across(0, 1))
    lying = np.where(ex > ey, patch.y, patch.x)
    grain = world.wear_noise.at(patch)
    for zone in world.zones:
        belt = np.broadcast_to(zone.colour, colour.shape)
        belt = belt * (1 + (0.45 if zone.kind == "grass" else 0.12) * grain)[..., None]
        if zone.width:
            stripes = bands(outside - np.float32(zone.start + 0.4), zone.period, zone.width, size)
            if zone.kind == "terrace":
                # Benches come in pieces, with aisles between.
                piece = np.mod(lying + np.float32(zone.period * 3), 23.0) < 14
                stripes = stripes * piece * (1 - 0.8 * bands(lying, 3.1, 0.12, patch.axes[1]))
            belt = mix(belt, zone.stripe * np.float32(0.95), stripes)
        colour = mix(colour, belt, step(outside - np.float32(zone.start), size))
    return colour


def _other_lines(pitch: Field, world: World, conditions: Conditions, patch: Patch, colour: Plane) -> Plane:
    """Lines of another sport: any colour but white, anywhere on the pitch."""
    rng = np.random.default_rng([conditions.world, 23])
    hue = rng.choice([55, 48, 25, 5, 205, 225, 185, 300, 75])
    paint = hsv(float(hue + rng.normal(0, 5)), float(rng.uniform(0.5, 1.0)), float(rng.uniform(0.5, 0.95)))
    share = np.zeros_like(patch.x)
    width = float(rng.uniform(0.05, 0.12))
    turn = float(rng.choice([0, 0, np.pi / 2, rng.uniform(0, np.pi)]))
    scale = float(rng.uniform(0.3, 0.9))
    small = Field(pitch.length * scale, pitch.width * float(rng.uniform(0.4, 1.0)), width)
    shift = rng.uniform(-0.25, 0.25, 2) * [pitch.length, pitch.width]
    cosine, sine = np.float32(np.cos(turn)), np.float32(np.sin(turn))
    x, y = patch.x - np.float32(shift[0]), patch.y - np.float32(shift[1])
    turned = Patch(cosine * x + sine * y, cosine * y - sine * x, patch.depth, patch.seen)
    for marking in small.markings():
        place = _near(marking, turned)
        if place is not None and rng.random() < 0.8:
            offset, beyond, across, along = _offsets(marking, turned.part(*place))
            share[place] = np.maximum(share[place], band(offset, width, across) * step(-beyond, along))
    opacity, _ = _paint(world, conditions, patch)
    return mix(colour, paint, share * opacity * np.float32(rng.uniform(0.5, 1)))


def _paint(world: World, conditions: Conditions, patch: Patch) -> tuple[Plane, Plane]:
    """Opacity (H, W) of paint, and 1 where enough of it is left to be called a line, 0 where it is gone."""
    level = np.float32(world.paint_opacity * (1 - 0.45 * conditions.wear))
    holes = np.float32(0.12 + 0.5 * conditions.wear) * world.paint_noise.at(patch)
    opacity = np.clip(level + holes, 0.06, 1)
    coarse = Noise(
        world.paint_noise.scales[3:],
        world.paint_noise.amplitudes[3:],
        world.paint_noise.offsets[3:],
        world.paint_noise.angle,
    )
    lasting = smooth_step(level + np.float32(0.12 + 0.5 * conditions.wear) * coarse.at(patch), 0.08, 0.25)
    return opacity, lasting


def _visible(conditions: Conditions, patch: Patch, contrast: Plane) -> Plane:
    """1 where paint stands out from the grass by `contrast` (H, W) enough to be seen through air and noise, else 0.

    To ask for what cannot be seen would teach the network to guess.
    """
    through_air = contrast * np.exp(-patch.depth * np.float32(0.0008 + 0.012 * conditions.fog))
    around = cv2.blur(cv2.dilate(through_air, np.ones((5, 5), np.uint8)), (9, 9))
    return smooth_step(around, 0.02 + 0.025 * conditions.noise, 0.045 + 0.05 * conditions.noise)


def _letter_coverage(letters: Letters, patch: Patch) -> Plane | None:
    """Share of each pixel under the lettering; None if it is not in the window."""
    ax, ay = (np.float32(v) for v in letters.along)
    dx, dy = patch.x - np.float32(letters.corner[0]), patch.y - np.float32(letters.corner[1])
    column = (ax * dx + ay * dy) / np.float32(letters.texel)
    row = (ay * dx - ax * dy) / np.float32(letters.texel)
    rows, columns = letters.picture.shape
    inside = patch.seen & (column > -4) & (column < columns + 4) & (row > -4) & (row < rows + 4)
    if not inside.any():
        return None
    size = float(np.median(patch.axes[1][inside])) / letters.texel
    picture = cv2.GaussianBlur(letters.picture, (0, 0), size / 3) if size > 1.5 else letters.picture
    return cv2.remap(picture, np.where(inside, column, -9), np.where(inside, row, -9), cv2.INTER_LINEAR, borderValue=0)


def _snow(world: World, conditions: Conditions, patch: Patch) -> Plane | None:
    if not conditions.snow:
        return None
    return smooth_step(world.snow_noise.at(patch), 1.6 - 1.6 * conditions.snow, 2.0 - 1.6 * conditions.snow)


def _light(pitch: Field, world: World, conditions: Conditions, patch: Patch) -> Plane:
    """Factor (H, W) of the light that falls on the ground: shadows of stands, trees, masts, clouds; floodlight."""
    if conditions.light == "floodlight":
        return (1 + 0.12 * world.cloud_noise.at(patch)).astype(np.float32)
    if conditions.light == "cloud":
        return (1 + 0.05 * world.cloud_noise.at(patch)).astype(np.float32)
    lit = 1 - 0.25 * smooth_step(world.cloud_noise.at(patch), 1.0, 2.2)
    if conditions.long_shadows:
        shade = _long_shadow(pitch, world, patch)
        lit = lit * (1 - (0.25 + 0.45 * np.float32(conditions.long_shadows)) * shade)
    return lit.astype(np.float32)


def _long_shadow(pitch: Field, world: World, patch: Patch) -> Plane:
    """Share of each pixel in the shadow of a stand or of trees on one side, and of masts."""
    inward = {
        "near": patch.y + pitch.width / 2,
        "far": pitch.width / 2 - patch.y,
        "left": patch.x + pitch.length / 2,
        "right": pitch.length / 2 - patch.x,
    }[world.shadow_side].astype(np.float32)
    _, long = patch.axes
    jagged = world.shadow_reach % 2 < 1
    edge = np.float32(world.shadow_reach) - inward
    if jagged:
        edge = edge + 6 * world.cloud_noise.at(patch) + 2.5 * world.wear_noise.at(patch)
    else:
        edge = edge + 3 * np.sign(np.sin(patch.x / 9))
    shade = step(edge, long + np.float32(0.25))
    azimuth = world.sun[0]
    nx, ny = np.float32(-np.sin(azimuth)), np.float32(np.cos(azimuth))
    for at_x, at_y in world.masts:
        offset = (patch.x - at_x * pitch.length) * nx + (patch.y - at_y * pitch.width) * ny
        shade = np.maximum(shade, band(offset, np.float32(0.35), patch.across(nx, ny) + np.float32(0.15)))
    return shade
