"""From where the preview is seen: a virtual camera between the cameras, and what of the world is behind its pixels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from worker.calibration.scene.camera import Array, Camera, Pose, inside
from worker.calibration.scene.field import Field
from worker.calibration.scene.look import ground_grid

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
    points = world_behind(pitch, aim, np.stack(np.meshgrid(columns, rows), axis=-1))
    unseen = ~np.any([inside(camera.project(points), camera.intrinsics.size) for camera in cameras], axis=0)
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


def world_behind(pitch: Field, view: Viewpoint, pixels: Array) -> Array:
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
