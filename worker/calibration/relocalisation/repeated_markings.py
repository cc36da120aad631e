"""Cameras slid along a field whose markings repeat: the same lines, each taken for another one.

Yard lines that lie evenly explain a view from every place that is so many yards farther on, a circle of a rink from
four, and a search that climbs does not leave the one it ends at. What tells those places apart few pixels show.
"""

import numpy as np

from worker.calibration.geometry.camera import Array
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.hypotheses import Hypotheses


def slid_along_field(field: FieldMap, cameras: Hypotheses) -> Hypotheses:
    """Return each camera moved by every distance between two parallel lines, or between two circles of one size."""
    # Longest slide, as a part of the length or width of the field: longer ones leave too few of the lines in common.
    largest_share = 0.75
    slides = np.concatenate(
        [
            _slides(field.lines_along_y, np.array([1.0, 0.0, 0.0]), 2 * largest_share * float(field.half_size[0])),
            _slides(field.lines_along_x, np.array([0.0, 1.0, 0.0]), 2 * largest_share * float(field.half_size[1])),
            np.pad(field.between_circles, ((0, 0), (0, 1))),
        ]
    )
    of_each = len(slides)
    return Hypotheses(
        np.repeat(cameras.rotations, of_each, axis=0),
        (cameras.positions[:, None] + slides).reshape(-1, 3),
        np.repeat(cameras.focal_px, of_each),
        np.repeat(cameras.bends, of_each),
    )


def _slides(places: Array, axis: Array, longest: float) -> Array:
    """Return the distances between any two of the places (n,) of parallel lines as moves (m, 3) along an axis."""
    # Difference below which distances between parallel markings are one.
    alike_m = 0.05
    apart = np.unique(np.round((places[:, None] - places).ravel() / alike_m)) * alike_m
    apart = apart[(np.abs(apart) > alike_m) & (np.abs(apart) <= longest)]
    return np.asarray(apart[:, None] * axis)
