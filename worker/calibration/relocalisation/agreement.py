"""Agreement of hypotheses with a view, both ways: expected lines that are seen, and seen lines that are expected."""

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.hypotheses import Hypotheses
from worker.calibration.relocalisation.line_view import WIDTH_PX, LineView

HALF_WIDTH_PX = WIDTH_PX / 2
LOWEST_M = 1.2
"""Least height of a sought camera: from the ground everything can be explained by a few lines."""


def agreement(field: FieldMap, view: LineView, cameras: Hypotheses, tolerance_px: float) -> Array:
    """Return the agreement (P,), 0..1, of each hypothesis with the lines of a view, less the cost of its roll.

    Dice's coefficient in view pixels: line that is expected and painted, and paint that is expected, out of both; a
    distance of `tolerance_px` counts for 1/e.
    """
    at_once = 1024
    parts = [
        _agreement(field, view, cameras[start : start + at_once], tolerance_px)
        for start in range(0, len(cameras), at_once)
    ]
    return np.concatenate(parts) if parts else np.zeros(0)


def _agreement(field: FieldMap, view: LineView, cameras: Hypotheses, tolerance: float) -> Array:
    expected, found, points = _expected_and_found(field, view, cameras, tolerance)
    explained = _explained(field, view, cameras, tolerance) * view.painted_px
    # Length of line that is taken for missing from every view, so that little in view is not all in view.
    # Fewest points of markings in view for an agreement to count in full.
    fewest = 30 / field.every
    dice = (found + explained) / (expected + view.painted_px + 40.0) * np.minimum(1.0, points / fewest)
    # Agreement that a roll of one standard deviation costs.
    rolled = 0.01 * (cameras.rotations[:, 0, 2] / np.sin(view.roll_sigma)) ** 2
    return np.where(cameras.positions[:, 2] > LOWEST_M, dice - rolled, 0.0)


def _expected_and_found(
    field: FieldMap, view: LineView, cameras: Hypotheses, tolerance: float
) -> tuple[Array, Array, Array]:
    """Return, per hypothesis, length of line in view, painted length (view pixels), number of points."""
    rotations = cameras.rotations.astype(np.float32)
    focal = cameras.focal_px.astype(np.float32)[:, None]
    moved = rotations @ field.points.T - (rotations @ cameras.positions[..., None].astype(np.float32))
    (x, y), ahead = view.surface.project((moved[:, 0], moved[:, 1], moved[:, 2]), focal)
    if cameras.bends.any():
        bent = cameras.bends.astype(np.float32)[:, None] * (x * x + y * y) / HALF_WIDTH_PX**2
        # Nothing is seen where a lens would bend the picture back.
        ahead &= 3 * bent > -1
        x, y = x * (1 + bent), y * (1 + bent)
    height, width = view.distance.shape
    # A plain number leaves the coordinates in single precision.
    left, top = view.corner.tolist()
    column = np.clip(np.rint(x - left), -1, width).astype(np.int32)
    row = np.clip(np.rint(y - top), -1, height).astype(np.int32)
    seen = ahead & (column >= 0) & (row >= 0) & (column < width) & (row < height)
    # `take` from a flat array is many times as fast as two indices.
    cell = np.where(seen, row * width + column, 0)
    counted = seen & view.covered.ravel().take(cell) & field.joined
    step = np.diff(x, axis=1, append=x[:, -1:]) ** 2 + np.diff(y, axis=1, append=y[:, -1:]) ** 2
    # Longest counted distance between two points of a marking in the view, view pixels.
    lengths = np.minimum(np.sqrt(step), 25.0 * field.every) * counted
    near = np.exp(-((view.distance.ravel().take(cell) / tolerance) ** 2))
    return lengths.sum(axis=1), (lengths * near).sum(axis=1), counted.sum(axis=1)


def _explained(field: FieldMap, view: LineView, cameras: Hypotheses, tolerance: float) -> Array:
    """Return, for each hypothesis, the share of the places on paint that lie on a marking, 0..1."""
    rotations = cameras.rotations.astype(np.float32)[..., None]
    positions = cameras.positions.astype(np.float32)[..., None]
    focal = cameras.focal_px.astype(np.float32)[:, None]
    places = straightened(view.places, cameras.bends)
    seen = x, y, z = view.surface.rays((places[..., 0], places[..., 1]), focal)
    # Axis by axis: arrays (P, M) that lie side by side in memory are several times as fast as one (P, M, 3).
    ray = [rotations[:, 0, axis] * x + rotations[:, 1, axis] * y + rotations[:, 2, axis] * z for axis in range(3)]
    down = ray[2] < -1e-3
    depth = np.where(down, -positions[:, 2] / np.where(down, ray[2], -1), 0)
    beside, on_map = field.to_paint(positions[:, 0] + depth * ray[0], positions[:, 1] + depth * ray[1])
    # From metres on the ground to pixels: the derivative of the projection along the way to the nearest paint.
    moved = tuple(rotations[:, axis, 0] * beside[0] + rotations[:, axis, 1] * beside[1] for axis in range(3))
    scale = focal / np.maximum(depth, 0.1)
    across, along = view.surface.moves(seen, moved)
    off = (scale / tolerance) ** 2 * (across * across + along * along)
    return np.asarray(np.where(down & on_map, np.exp(-off), 0).mean(axis=1))


def straightened(places: NDArray[np.float32], bends: Array) -> NDArray[np.float32]:
    """Return places (M, 2) of the view with each of the bends (P,) undone, (P, M, 2), by a Newton step."""
    if not bends.any():
        return places[None]
    # A place that was `scale` times as far from the centre has scale (1 + bent scale²) = 1.
    bent = bends.astype(np.float32)[:, None] * (places * places).sum(axis=1)[None] / np.float32(HALF_WIDTH_PX**2)
    scale = 1 / (1 + bent)
    square = scale * scale
    scale = (1 + 2 * bent * square * scale) / (1 + 3 * bent * square)
    return np.asarray(places[None] * scale[..., None])
