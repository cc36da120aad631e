"""Pictures that people judge a calibration by: the stitched preview, the bird's-eye view, the pitch drawn on a frame.

The stitched ones are made the same way: for each of their pixels the point of the world behind it, for each point the
pixel of each camera (`Camera.project`), and where several cameras see it a blend with a short feather along a seam.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.scene.camera import Array, Camera, Frame, Pose, inside
from worker.calibration.scene.field import Field, Marking, resample

Mask = NDArray[np.bool_]

# Least length of the pitch in the bird's-eye view, in pixels: courts are small.
BIRDSEYE_LENGTH = 800
# What no camera sees: dark grey rather than black, so that it reads as "outside" and not as "broken".
BACKDROP = 38

# The preview stands back where the cameras see the pitch further to the side than this, then until it has this.
TOO_WIDE_DEG, STANDING_BACK_DEG = 80.0, 60.0
# The preview shows this much around the visible pitch, in widths and heights of it in the picture.
AROUND_SIDES, AROUND_ABOVE, AROUND_BELOW = 0.03, 0.8, 0.15
# Least and largest height of the preview in widths.
HEIGHT_TO_WIDTH = 0.15, 1.0
# A row or column at the edge of the preview stays if no more than this part of it is unseen.
UNSEEN_AT_EDGE = 0.03
# "Infinity": far beyond any parallax between cameras, near enough for float64.
FAR_M = 1e6
# The preview's geometry is computed at every n-th pixel and interpolated; the tests hold it below 0.05 px.
GEOMETRY_STEP = 4

# Two feathers along the seam, powers of how well a camera sees: a short one for detail, so that players who stand off
# the ground do not become ghosts, and a long one for the smooth part, so that no step of exposure shows in the sky.
DETAIL_SHARPNESS, SMOOTH_SHARPNESS = 60, 4
SMOOTH_BLOCK, SMOOTH_SIGMA = 16, 2.0
LARGEST_GAIN = 1.3
# Pixels this dark or bright say nothing about exposure.
EXPOSED = (16, 240)

# Orange and blue stay apart for all common kinds of colour blindness, and both from white on grass. BGR.
STORED_COLOUR = (0, 140, 255)
NEW_COLOUR = (255, 60, 0)
# From the edge of the paint to the middle of the stroke that frames it, in strokes.
EDGE_GAP = 1.0


def preview(pitch: Field, cameras: Sequence[Camera], frames: Mapping[str, Frame], width: int = 1920) -> Frame:
    """One wide perspective from between the cameras, BGR (height, width, 3); the height follows from what they see.

    `frames[camera.id]`: BGR (height, width, 3) of the size of the camera's intrinsics.
    """
    return stitched(pitch, viewpoint(pitch, cameras, width), cameras, frames).picture


@dataclass(frozen=True)
class Stitched:
    """A view stitched from all cameras, BGR (H, W, 3); `owner` (H, W): number of the camera that counts most, or -1."""

    picture: Frame
    owner: NDArray[np.int8]


def stitched(pitch: Field, view: Viewpoint, cameras: Sequence[Camera], frames: Mapping[str, Frame]) -> Stitched:
    """What `preview` shows, from a given place: pictures of two sets of poses from one place can be compared."""
    points = _world_behind(pitch, view, _every_nth_pixel(view.size))
    looks = [_look(camera, frames[camera.id], _every_pixel(_project(camera, points), view)) for camera in cameras]
    best = np.argmax([look.quality for look in looks], axis=0)
    seen = np.any([look.valid for look in looks], axis=0)
    return Stitched(_blend(looks), np.where(seen, best, -1).astype(np.int8))


def birdseye(
    pitch: Field,
    cameras: Sequence[Camera],
    frames: Mapping[str, Frame],
    pixels_per_metre: float | None = None,
    margin_m: float = 3,
) -> Frame:
    """The pitch from straight above, BGR: x to the right, y up, the pitch centre in the centre pixel.

    `pixels_per_metre`: unless said 10, and more where the pitch would come out shorter than `BIRDSEYE_LENGTH`.
    `frames[camera.id]`: BGR (height, width, 3) of the size of the camera's intrinsics.
    """
    pixels_per_metre = pixels_per_metre or max(10.0, BIRDSEYE_LENGTH / pitch.length)
    columns = round((pitch.length / 2 + margin_m) * pixels_per_metre)
    rows = round((pitch.width / 2 + margin_m) * pixels_per_metre)
    grid = ground_grid(columns, rows, 1 / pixels_per_metre)
    return _blend([_look(camera, frames[camera.id], _project(camera, pitch.lift(grid))) for camera in cameras])


def overlay(stored: tuple[Field, Camera], new: tuple[Field, Camera], frame: Frame, legend_for: str = "pose") -> Frame:
    """The frame with the markings on it: orange by the stored pose, blue by the new one, BGR like `frame`.

    Each is drawn with the pitch it is for; `legend_for` says what is stored and new.

    The stored pose draws the centre of each line; the new one frames it: the painted line stays visible between two
    blue ones if the pose is right.
    """
    picture = frame.copy()
    width = frame.shape[1]
    pitch, camera = stored
    for marking in pitch.markings():
        draw_line(
            picture, _project(camera, pitch.lift(outline(marking)[0])), STORED_COLOUR, max(1, round(width / 1600))
        )
    thickness = max(1, round(width / 3000))
    pitch, camera = new
    for marking in pitch.markings():
        for line in frame_of(pitch, camera, marking, EDGE_GAP * thickness):
            draw_line(picture, line, NEW_COLOUR, thickness)
    legend(picture, ((f"stored {legend_for}", STORED_COLOUR), (f"new {legend_for}", NEW_COLOUR)))
    return picture


def ground_grid(columns: int, rows: int, step_m: float, centre: tuple[float, float] = (0.0, 0.0)) -> Array:
    """Pitch points (2 rows + 1, 2 columns + 1, 2) every `step_m` around `centre`: x to the right, y up."""
    x = centre[0] + step_m * np.arange(-columns, columns + 1)
    y = centre[1] + step_m * np.arange(rows, -rows - 1, -1)
    return np.stack(np.meshgrid(x, y), axis=-1)


def ground_view(pitch: Field, camera: Camera, image: NDArray[Any], grid_xy: Array) -> tuple[NDArray[Any], Mask]:
    """What a camera shows at points of the pitch: values (H, W[, C]) at (H, W, 2) metres, and where it sees them.

    `image`: uint8 or float32 (height, width[, C]) of the size of the camera's intrinsics. Values are means over about
    the area between the points of the grid where that is coarser than the image.
    """
    seen = _look(camera, image, _project(camera, pitch.lift(grid_xy)))
    return seen.values, seen.valid


@dataclass(frozen=True)
class Viewpoint:
    """The virtual camera of the preview: level, at `pose`; `focal` in pixels; its axis ends in pixel `principal`.

    The picture is Pannini's, the perspective of the painters of wide squares: through the axis of an upright cylinder
    onto its tangent plane. Verticals and lines towards the vanishing point stay straight as in a photograph, but
    two cameras side by side, 140 degrees together, fit into it without tearing the corners of the pitch apart.
    """

    pose: Pose
    focal: float
    principal: tuple[float, float]
    size: tuple[int, int]

    def rays(self, pixels: Array) -> Array:
        """Directions in the world (..., 3) through pixels (..., 2)."""
        x, y = np.moveaxis((pixels - np.array(self.principal)) / self.focal, -1, 0)
        longitude = 2 * np.arctan(x / 2)
        return np.stack([np.sin(longitude), y / (1 + x * x / 4), np.cos(longitude)], axis=-1) @ self.pose.matrix

    def project(self, points: Array) -> Array:
        """World points (..., 3) to pixels (..., 2)."""
        right, down, ahead = np.moveaxis((points - self.pose.position) @ self.pose.matrix.T, -1, 0)
        x = 2 * np.tan(np.arctan2(right, ahead) / 2)
        y = (1 + x * x / 4) * down / np.hypot(right, ahead)
        return self.focal * np.stack([x, y], axis=-1) + np.array(self.principal)


def viewpoint(pitch: Field, cameras: Sequence[Camera], width: int) -> Viewpoint:
    """From where the preview is seen, and what part of the view it shows.

    It stands at the mean of the cameras' positions and looks along the mean of their lines of sight; where these cancel
    (cameras that face each other) it looks across the pitch from the usual side. Where the visible pitch would lie
    beside or behind it (cameras around the pitch) it stands further back and higher, so that the pitch is seen as
    steeply as the cameras see it.
    """
    seen = [_visible_pitch(pitch, camera) for camera in cameras]
    aim = Viewpoint(_stand(cameras, seen), 1.0, (0.0, 0.0), (0, 0))
    left, right, top, bottom = _window(pitch, aim, cameras, np.concatenate(seen))
    # Poses that are far off make slivers; those are the ones somebody has to look at.
    middle, half = (top + bottom) / 2, np.clip((bottom - top) / 2, *(np.array(HEIGHT_TO_WIDTH) * (right - left) / 2))
    top, bottom = middle - half, middle + half
    focal = width / (right - left)
    size = (width, max(1, round(focal * (bottom - top))))
    return Viewpoint(aim.pose, focal, (-focal * left - 0.5, -focal * top - 0.5), size)


def _visible_pitch(pitch: Field, camera: Camera) -> Array:
    """Points (K, 3), one every square metre, of the pitch in a camera's picture; all of them if it sees none."""
    grid = ground_grid(round(pitch.length / 2), round(pitch.width / 2), 1.0).reshape(-1, 2)
    points = pitch.lift(grid)
    seen = inside(camera.project(points), camera.intrinsics.size)
    return points[seen] if seen.any() else points


def _stand(cameras: Sequence[Camera], seen: Sequence[Array]) -> Pose:
    """Where the virtual camera stands, and its horizontal line of sight."""
    axes = np.array([camera.pose.matrix[2, :2] for camera in cameras])
    axis = (axes / np.maximum(np.linalg.norm(axes, axis=1, keepdims=True), 1e-9)).mean(axis=0)
    ahead = axis / np.linalg.norm(axis) if np.linalg.norm(axis) > 0.3 else np.array([0.0, 1.0])
    position = np.mean([camera.pose.position for camera in cameras], axis=0)

    points = np.concatenate(seen)
    offset = points[:, :2] - position[:2]
    along = offset @ ahead
    # To the side, or down for cameras that hang above the pitch.
    aside = np.maximum(np.abs(offset @ [ahead[1], -ahead[0]]), position[2] - points[:, 2])
    if np.any(aside > np.tan(np.radians(TOO_WIDE_DEG)) * along):
        back = np.max(aside / np.tan(np.radians(STANDING_BACK_DEG)) - along)
        steepness = [
            camera.pose.position[2] / np.median(np.linalg.norm(own[:, :2] - camera.pose.position[:2], axis=1))
            for camera, own in zip(cameras, seen, strict=True)
        ]
        height = max(position[2], np.mean(steepness) * (np.median(along) + back))
        position = np.append(position[:2] - back * ahead, height)
    return Pose.looking_at(position, position + np.append(ahead, 0.0))


def _window(pitch: Field, aim: Viewpoint, cameras: Sequence[Camera], seen: Array) -> tuple[float, float, float, float]:
    """Left, right, top, bottom of the preview in the picture plane of `aim`: the pitch, and around it what is seen."""
    on_plane = aim.project(seen)
    (left, top), (right, bottom) = on_plane.min(axis=0), on_plane.max(axis=0)
    width, height = right - left, bottom - top
    left, right = left - AROUND_SIDES * width, right + AROUND_SIDES * width
    top, bottom = top - AROUND_ABOVE * height, bottom + AROUND_BELOW * height

    step = (right - left) / 240
    columns, rows = np.arange(left, right, step), np.arange(top, bottom, step)
    points = _world_behind(pitch, aim, np.stack(np.meshgrid(columns, rows), axis=-1))
    unseen = ~np.any([inside(_project(camera, points), camera.intrinsics.size) for camera in cameras], axis=0)
    # Peel off the emptiest side until none is too empty.
    x0, x1, y0, y1 = 0, len(columns) - 1, 0, len(rows) - 1
    while x1 - x0 > 1 and y1 - y0 > 1:
        sides = np.array(
            [
                unseen[y0 : y1 + 1, x0].mean(),
                unseen[y0 : y1 + 1, x1].mean(),
                unseen[y0, x0 : x1 + 1].mean(),
                unseen[y1, x0 : x1 + 1].mean(),
            ]
        )
        worst = int(sides.argmax())
        if sides[worst] <= UNSEEN_AT_EDGE:
            break
        x0, x1, y0, y1 = np.array([x0, x1, y0, y1]) + np.eye(4, dtype=int)[worst] * [1, -1, 1, -1]
    return columns[x0], columns[x1], rows[y0], rows[y1]


def _world_behind(pitch: Field, view: Viewpoint, pixels: Array) -> Array:
    """World points (H, W, 3) behind pixels (H, W, 2) of the virtual camera: on the pitch, the ground, or far away."""
    directions = view.rays(pixels)
    start = view.pose.position
    # Reciprocal distances pass through the horizon without a jump. The roof is so flat that a few steps from the
    # height last found reach it.
    height = np.zeros(directions.shape[:2])
    for _ in range(4):
        reciprocal = np.maximum(-directions[..., 2] / (start[2] - height), 1 / FAR_M)
        points = start + directions / reciprocal[..., None]
        height = pitch.height(points[..., :2])
    return points


def _project(camera: Camera, points: Array) -> Array:
    """`Camera.project` for points (..., 3) on a grid."""
    return camera.project(points.reshape(-1, 3)).reshape(*points.shape[:-1], 2)


def _every_nth_pixel(size: tuple[int, int]) -> Array:
    """Positions (h, w, 2) of the centres of blocks of `GEOMETRY_STEP` pixels, one block more on each side."""
    x, y = (GEOMETRY_STEP * (np.arange(-1, -(-extent // GEOMETRY_STEP) + 1) + 0.5) - 0.5 for extent in size)
    return np.stack(np.meshgrid(x, y), axis=-1)


def _every_pixel(values: Array, view: Viewpoint) -> Array:
    """Values (h, w, 2) at `_every_nth_pixel`, linearly interpolated to every pixel of a view (height, width, 2)."""
    width, height = view.size
    dense: Array = np.asarray(
        cv2.resize(values, None, fx=GEOMETRY_STEP, fy=GEOMETRY_STEP, interpolation=cv2.INTER_LINEAR), float
    )
    return dense[GEOMETRY_STEP : GEOMETRY_STEP + height, GEOMETRY_STEP : GEOMETRY_STEP + width]


@dataclass(frozen=True)
class _Look:
    """One camera's part of a picture: values (H, W[, C]), where they are valid, and how well the camera sees there."""

    values: NDArray[Any]
    valid: Mask
    quality: NDArray[np.float32]


def _look(camera: Camera, image: NDArray[Any], pixels: Array) -> _Look:
    """Sample a camera's image at pixels (H, W, 2), each at the level of detail that its surroundings call for."""
    valid = inside(pixels, camera.intrinsics.size)
    x, y = (np.ascontiguousarray(pixels[..., axis], np.float32) for axis in (0, 1))
    area = _footprint(x, y)
    level = np.clip(np.floor(0.5 * np.log2(np.maximum(area, 1.0))), 0, 5).astype(np.uint8)
    values = np.zeros((*valid.shape, *image.shape[2:]), image.dtype)
    x[~valid] = y[~valid] = 0
    for number in np.unique(level[valid]):
        small = _shrink(image, 1 << int(number))
        scale = small.shape[1] / image.shape[1], small.shape[0] / image.shape[0]
        place = (x + 0.5) * scale[0] - 0.5, (y + 0.5) * scale[1] - 0.5
        sampled = cv2.remap(small, *place, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        chosen = valid & (level == number)
        values[chosen] = sampled[chosen]
    # 1 in the middle of the camera's picture, next to 0 at its border; the better, the finer it resolves the point.
    width, height = camera.intrinsics.size
    middle = (1 - np.abs(2 * x / (width - 1) - 1)) * (1 - np.abs(2 * y / (height - 1) - 1))
    quality = np.where(valid, np.maximum(middle, 1e-6) * np.sqrt(np.maximum(area, 1e-6)), 0)
    return _Look(values, valid, quality)


def _footprint(x: NDArray[np.float32], y: NDArray[np.float32]) -> NDArray[np.float32]:
    """Area (H, W) in source pixels of each pixel of the picture, from source positions x, y (H, W); 0 where NaN."""
    (x_down, x_right), (y_down, y_right) = np.gradient(x), np.gradient(y)
    return np.nan_to_num(np.abs(x_right * y_down - y_right * x_down), nan=0.0, posinf=0.0)


def _shrink(image: NDArray[Any], factor: int) -> NDArray[Any]:
    if factor == 1:
        return image
    return cv2.resize(image, (image.shape[1] // factor, image.shape[0] // factor), interpolation=cv2.INTER_AREA)


def seam_weights(qualities: NDArray[np.float32], sharpness: int) -> NDArray[np.float32]:
    """Weights (cameras, H, W) that sum to 1 where any camera sees, from how well each does: the best one, feathered."""
    relative = (qualities / np.maximum(qualities.max(axis=0), 1e-9)) ** sharpness
    return relative / np.maximum(relative.sum(axis=0), 1e-9)


def _blend(looks: Sequence[_Look]) -> Frame:
    qualities = np.stack([look.quality for look in looks])
    detail, smooth = seam_weights(qualities, DETAIL_SHARPNESS), seam_weights(qualities, SMOOTH_SHARPNESS)
    picture = np.zeros(looks[0].values.shape, np.float32)
    for look, short, long, gain in zip(looks, detail, smooth, exposure_gains(looks), strict=True):
        picture += gain * (short[..., None] * look.values + (long - short)[..., None] * _smooth_part(look))
    picture[~np.any([look.valid for look in looks], axis=0)] = BACKDROP
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8)


def _smooth_part(look: _Look) -> NDArray[np.float32]:
    """What remains of a camera's part (H, W, 3) without its detail, from the pixels it sees only."""
    rows, columns = look.valid.shape
    small = (-(-columns // SMOOTH_BLOCK), -(-rows // SMOOTH_BLOCK))
    seen = look.valid.astype(np.float32)
    weight, total = (
        cv2.GaussianBlur(cv2.resize(part, small, interpolation=cv2.INTER_AREA), (0, 0), SMOOTH_SIGMA)
        for part in (seen, look.values * seen[..., None])
    )
    mean = total / np.maximum(weight, 1e-6)[..., None]
    return cv2.resize(mean, (columns, rows), interpolation=cv2.INTER_LINEAR).astype(np.float32, copy=False)


def exposure_gains(looks: Sequence[_Look]) -> NDArray[np.float32]:
    """A gain per camera and colour (cameras, 3) that makes them agree where they overlap, at most `LARGEST_GAIN`.

    From the median ratio of each pair, which players and other parallax do not move.
    """
    count = len(looks)
    # Least squares of the log gains, held near 1 so that only their differences follow the pictures.
    normal, right = 1e-3 * np.eye(count), np.zeros((count, 3))
    for i, j in combinations(range(count), 2):
        a, b = looks[i].values[::4, ::4].astype(np.float32), looks[j].values[::4, ::4].astype(np.float32)
        both = looks[i].valid[::4, ::4] & looks[j].valid[::4, ::4]
        both &= (np.minimum(a, b).min(axis=-1) > EXPOSED[0]) & (np.maximum(a, b).max(axis=-1) < EXPOSED[1])
        if both.sum() < 100:
            continue
        ratio = np.median(np.log(b[both] / a[both]), axis=0)
        normal[[i, j], [i, j]] += 1
        normal[[i, j], [j, i]] -= 1
        right[i] += ratio
        right[j] -= ratio
    gains = np.exp(np.linalg.solve(normal, right))
    return np.clip(gains, 1 / LARGEST_GAIN, LARGEST_GAIN).astype(np.float32)


def outline(marking: Marking) -> list[Array]:
    """A marking's centre line and its edges, (n, 2) each, densely enough for distortion and roof."""
    between, _ = resample(marking.centre, 0.25)
    centre = np.concatenate([marking.centre[:1], between, marking.centre[-1:]])
    if marking.spot:
        # Its edge is a circle.
        angle = np.linspace(0, 2 * np.pi, 33)
        centre = np.broadcast_to(between[:1], (len(angle), 2))
        return [centre, centre + marking.width / 2 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)]
    along = np.gradient(centre, axis=0)
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    across = marking.width / 2 * np.stack([-along[:, 1], along[:, 0]], axis=-1)
    return [centre, centre + across, centre - across]


def frame_of(pitch: Field, camera: Camera, marking: Marking, gap: float) -> list[Array]:
    """Both edges of a marking in a camera's pixels, (n, 2) each, moved `gap` outwards.

    Half a stroke and a little more, and the paint stays visible between two strokes.
    """
    centre, *edges = (_project(camera, pitch.lift(line)) for line in outline(marking))
    moved = []
    for edge in edges:
        outwards = edge - centre
        moved.append(edge + gap * outwards / np.linalg.norm(outwards, axis=-1, keepdims=True))
    return moved


def draw_line(picture: Frame, line: Array, colour: tuple[int, ...], thickness: int) -> None:
    """Draw a polyline (n, 2) of sub-pixel positions, interrupted where it is NaN or far outside."""
    near = inside(line, (picture.shape[1], picture.shape[0]), margin=-1000.0)
    breaks = np.flatnonzero(~near)
    pieces = [piece for piece in np.split(line, np.unique([*breaks, *(breaks + 1)])) if len(piece) > 1]
    fixed_point = [np.rint(piece * 16).astype(np.int32) for piece in pieces]
    cv2.polylines(picture, fixed_point, False, colour, thickness, cv2.LINE_AA, shift=4)


def legend(picture: Frame, entries: Sequence[tuple[str, tuple[int, int, int]]]) -> None:
    """Name the colours in the lower left corner."""
    unit = max(12, picture.shape[1] // 100)
    scale, thick = unit / 20, max(1, unit // 14)
    longest = max(cv2.getTextSize(name, cv2.FONT_HERSHEY_SIMPLEX, scale, thick)[0][0] for name, _ in entries)
    width, height = 5 * unit + longest, (2 * len(entries) + 1) * unit
    left, top = unit, picture.shape[0] - unit - height
    box = picture[max(top, 0) : top + height, left : left + width]
    box[:] = box // 4
    for row, (name, colour) in enumerate(entries):
        y = top + (2 * row + 1) * unit + unit // 2
        cv2.line(picture, (left + unit, y), (left + 3 * unit, y), colour, max(2, unit // 6), cv2.LINE_AA)
        place = (left + 4 * unit, y + unit // 2)
        cv2.putText(picture, name, place, cv2.FONT_HERSHEY_SIMPLEX, scale, (255, 255, 255), thick, cv2.LINE_AA)
