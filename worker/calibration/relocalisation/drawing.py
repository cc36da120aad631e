"""Random hypotheses at the usual places of cameras beside fields, where too few straight lines are seen."""

import numpy as np

from worker.calibration.geometry.camera import Array
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.hypotheses import Hypotheses, rotations_of

LOWEST_M, HIGHEST_M = 2.0, 35.0
"""Range of the height of a camera, from a tripod to the roof of a stand: the prior is even in its logarithm. No bench
has chosen it."""
BESIDE, AIMED_AT = 1.3, 1.1
"""Range of cameras along a side, and of the places they aim at, in half sizes of the field: even priors, which
no bench has chosen."""


def draw(field: FieldMap, focal_px: Array, roll_sigma: float, count: int, rng: np.random.Generator) -> Hypotheses:
    """Draw cameras that look at the field, two thirds of them beside a long side; focal lengths evenly.

    `roll_sigma`: standard deviation of their roll, rad.
    """
    half_x, half_y = field.half_size.tolist()
    behind_an_end = rng.integers(0, 3, count) == 2
    nearest_m = 0.5
    # A larger field is filmed from as far as it is large.
    beside = half_y + _log_uniform(nearest_m, max(60.0, half_y), count, rng)
    behind = half_x + _log_uniform(nearest_m, max(40.0, half_x), count, rng)
    x = np.where(behind_an_end, -behind, rng.uniform(-BESIDE * half_x, BESIDE * half_x, count))
    y = np.where(behind_an_end, rng.uniform(-BESIDE * half_y, BESIDE * half_y, count), -beside)
    if not field.is_symmetric:
        side = rng.choice([-1.0, 1.0], count)
        x, y = x * side, y * side
    z = _log_uniform(LOWEST_M, HIGHEST_M, count, rng)
    return _aimed(field, np.stack([x, y, z], axis=1), focal_px, roll_sigma, rng)


def draw_at(
    field: FieldMap,
    focal_px: Array,
    roll_sigma: float,
    place: Array,
    radius_m: float,
    count: int,
    rng: np.random.Generator,
) -> Hypotheses:
    """Draw cameras within `radius_m` of a place (3,) m that look at the field."""
    ways = rng.normal(size=(count, 3))
    ways *= (radius_m * np.cbrt(rng.uniform(size=count)) / np.linalg.norm(ways, axis=1))[:, None]
    return _aimed(field, place + ways, focal_px, roll_sigma, rng)


def _aimed(
    field: FieldMap, positions: Array, focal_px: Array, roll_sigma: float, rng: np.random.Generator
) -> Hypotheses:
    """Draw cameras at positions (n, 3) that look at places on the field or a little beside it."""
    count = len(positions)
    half_x, half_y = AIMED_AT * field.half_size
    to_x = rng.uniform(-half_x, half_x, count) - positions[:, 0]
    to_y = rng.uniform(-half_y, half_y, count) - positions[:, 1]
    roll = roll_sigma * rng.normal(size=count)
    tilt = np.arctan2(positions[:, 2], np.hypot(to_x, to_y))
    return Hypotheses.unbent(rotations_of(np.arctan2(to_y, to_x), tilt, roll), positions, rng.choice(focal_px, count))


def _log_uniform(low: float, high: float, count: int, rng: np.random.Generator) -> Array:
    return np.asarray(np.exp(rng.uniform(np.log(low), np.log(high), count)))
