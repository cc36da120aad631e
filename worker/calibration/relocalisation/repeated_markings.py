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
    slides = np.concatenate(
        [
            slides_along(field, 0)[:, None] * np.array([1.0, 0.0, 0.0]),
            slides_along(field, 1)[:, None] * np.array([0.0, 1.0, 0.0]),
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


def slides_along(field: FieldMap, axis: int) -> Array:
    """Return the distances (m,), of both signs, between any two parallel lines along the length (0) or width (1)."""
    places = (field.lines_along_y, field.lines_along_x)[axis]
    # Longest slide, as a part of the length or width of the field: longer ones leave too few of the lines in common.
    longest = 0.75 * 2 * float(field.half_size[axis])
    # Difference below which distances between parallel markings are one.
    alike_m = 0.05
    apart = np.unique(np.round((places[:, None] - places).ravel() / alike_m)) * alike_m
    return np.asarray(apart[(np.abs(apart) > alike_m) & (np.abs(apart) <= longest)])
