"""Movement of a camera between two poses: degrees, metres, and pixels of the pitch in its picture.

For history, alarms and what is said of a pose that was put, which the service writes itself: `quality.Moved` of the
engine, on fewer points and a flat pitch. OpenCV takes its time to load: import this where a movement is wanted.
"""

import math
from functools import lru_cache
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from fields.shapes import Arc, Line, Shape, Spot
from service.schemas.field import FieldOfPlay
from service.schemas.geometry import Intrinsics, Moved, PictureMotion, PosedCamera
from service.schemas.lens_map import distorted, largest_radius
from service.schemas.names import PANORAMAS

Array = NDArray[np.float64]
# The points on all markings together; rounding adds at most one for each marking.
POINTS = 150
# Ground beside the field that counts to a picture's motion, points along each side of a grid, and how many of them fix
# a homography (four) with some to spare.
BESIDE_M, GRID, LEAST_SEEN = 10.0, 60, 8


def moved(field: FieldOfPlay, before: PosedCamera, after: PosedCamera) -> Moved:
    """Return how far a camera moved between two states; `pixels`: None without markings in view, or if sizes differ."""
    return Moved(
        rotation_deg=turned_deg(before, after),
        position_m=math.dist(before.pose.position, after.pose.position),
        pixels=_shift_px(field, before, after) if before.image_size == after.image_size else None,
    )


def turned_deg(before: PosedCamera, after: PosedCamera) -> float:
    """Return the angle by which a camera was turned from one state to another."""
    turn = _rotation(after) @ _rotation(before).T
    # From the sine as well: the cosine of a small angle says nothing about it.
    twice_sine = np.linalg.norm([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    return math.degrees(math.atan2(twice_sine, np.trace(turn) - 1))


def _rotation(camera: PosedCamera) -> Array:
    """Return the rotation (3, 3) from world to camera."""
    return np.asarray(cv2.Rodrigues(np.array(camera.pose.rotation, dtype=float))[0], dtype=float)


def picture_motion(field: FieldOfPlay, then: tuple[int, PosedCamera], now: tuple[int, PosedCamera]) -> PictureMotion:
    """Return how the picture of a camera moved from one revision (its number, the camera) to another."""
    (since, before), (revision, after) = then, now
    half = np.array([field.length_m, field.width_m]) / 2 + BESIDE_M
    steps = [np.linspace(-side, side, GRID) for side in half]
    ground = np.stack(np.meshgrid(*steps), axis=-1).reshape(-1, 2)
    on_ground, ground_residual_px = _homography(before, pixels(before, ground), after, pixels(after, ground))
    (fx, _, _), (_, fy, _), _ = before.intrinsics.matrix
    width, height = before.image_size
    sides = np.meshgrid(np.linspace(-1, 1, GRID) * width / fx, np.linspace(-1, 1, GRID) * height / fy)
    rays = np.stack([*sides, np.ones_like(sides[0])], axis=-1).reshape(-1, 3)
    turn = _rotation(after) @ _rotation(before).T
    far, far_residual_px = _homography(before, _seen(before, rays), after, _seen(after, rays @ turn.T))
    return PictureMotion(
        since=since,
        revision=revision,
        image_size=after.image_size,
        ground=on_ground,
        ground_residual_px=ground_residual_px,
        far=far,
        far_residual_px=far_residual_px,
    )


def _homography(
    before: PosedCamera, was: Array, after: PosedCamera, now: Array
) -> tuple[list[list[float]] | None, float | None]:
    """Return the homography between pixels (N, 2), and the largest distance from it; None if both see too few."""
    seen = _inside(before, was) & _inside(after, now)
    found = cv2.findHomography(was[seen], now[seen])[0] if seen.sum() >= LEAST_SEEN else None
    if found is None:
        return None, None
    residuals = cv2.perspectiveTransform(was[seen][None], found)[0] - now[seen]
    return found.tolist(), float(np.linalg.norm(residuals, axis=1).max())


def visible_m(field: FieldOfPlay, camera: PosedCamera) -> float:
    """Return the length of markings in a camera's picture, m, to within some metres, on flat ground."""
    points = points_on_markings(field)
    length = sum(shape.length for shape in field.markings if not isinstance(shape, Spot))
    return float(_inside(camera, pixels(camera, points)).mean() * length)


def _shift_px(field: FieldOfPlay, before: PosedCamera, after: PosedCamera) -> float | None:
    """Return the mean shift over the markings that were in view, px, or None where none was."""
    points = points_on_markings(field)
    was, now = pixels(before, points), pixels(after, points)
    in_view = _inside(before, was) & np.isfinite(now).all(axis=1)
    return float(np.linalg.norm(now - was, axis=1)[in_view].mean()) if in_view.any() else None


def _inside(camera: PosedCamera, places: Array) -> NDArray[np.bool_]:
    """Return a mask (N) of the pixels (N, 2) that lie in a camera's picture."""
    return np.asarray(((places >= 0) & (places <= np.array(camera.image_size) - 1)).all(axis=1))


def points_on_markings(field: FieldOfPlay) -> Array:
    """Return points (N, 2) on the markings of a field, evenly along them."""
    return _points_on(field.markings)


@lru_cache(maxsize=256)
def _points_on(shapes: tuple[Shape, ...]) -> Array:
    spacing = sum(shape.length for shape in shapes if not isinstance(shape, Spot)) / POINTS
    points = np.concatenate([_along(shape, spacing) for shape in shapes])
    points.setflags(write=False)
    return points


def _along(shape: Shape, spacing: float) -> Array:
    match shape:
        case Line():
            pieces = [np.array(piece) for piece in pairwise(shape.points)]
            return np.concatenate([a + _shares(math.dist(a, b), spacing) * (b - a) for a, b in pieces])
        case Arc():
            angle = shape.start + _shares(shape.length, spacing) * (shape.end - shape.start)
            return shape.centre + shape.radius * np.hstack([np.cos(angle), np.sin(angle)])
        case Spot():
            return np.array([shape.centre])


def _shares(length: float, spacing: float) -> Array:
    """Return the middles (N, 1) of equal pieces of 0..1."""
    pieces = max(1, round(length / spacing)) if spacing else 1
    return ((np.arange(pieces) + 0.5) / pieces)[:, None]


def pixels(camera: PosedCamera, points: Array) -> Array:
    """Project points of the ground (N, 2) into the picture (N, 2); NaN behind the camera and beyond the lens model."""
    on_ground = np.column_stack([points, np.zeros(len(points))])
    return _seen(camera, on_ground @ _rotation(camera).T + camera.pose.translation)


def _seen(camera: PosedCamera, seen_from_camera: Array) -> Array:
    """Project points (N, 3) in the camera's frame (N, 2); NaN behind the camera and beyond the lens model."""
    if camera.intrinsics.model in PANORAMAS:
        return _onto_panorama(camera.intrinsics, seen_from_camera)
    across, depth = np.hypot(*seen_from_camera.T[:2]), seen_from_camera[:, 2]
    lens, matrix = camera.intrinsics, np.array(camera.intrinsics.matrix)
    in_model = (depth > 0) & (across <= largest_radius(lens.model, tuple(lens.distortion)) * depth)
    x, y = (seen_from_camera[:, :2] / np.where(in_model, depth, np.nan)[:, None]).T
    return np.asarray(np.column_stack(distorted(lens.model, lens.distortion, x, y)) @ matrix[:2, :2].T + matrix[:2, 2])


def _onto_panorama(lens: Intrinsics, seen_from_camera: Array) -> Array:
    """Project points (N, 3) in the camera's frame to a panorama (N, 2); NaN on its axis."""
    right, down, ahead = seen_from_camera.T
    away = np.hypot(right, ahead)
    slope = down / np.where(away > 0, away, np.nan)
    height = slope if lens.model == "cylindrical" else np.arctan(slope)
    matrix = np.array(lens.matrix)
    return np.asarray(np.column_stack([np.arctan2(right, ahead), height]) @ matrix[:2, :2].T + matrix[:2, 2])
