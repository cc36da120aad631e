"""Fisheye lenses that are fitted to radial models without a counterpart in OpenCV.

A model is the angle off the axis, rad, of the ray that ends at a distance from the centre, for a focal length of 1. The
fisheye of OpenCV (Kannala-Brandt) has the distance as an odd polynomial of that angle, which every smooth lens is
nearly.
"""

import math
from collections.abc import Callable
from itertools import product

import numpy as np
from numpy.typing import NDArray

from service.formats.nodes import Node
from service.formats.records import camera_matrix, lens_of
from service.schemas.geometry import Intrinsics
from service.schemas.lens_map import WIDEST_FISHEYE

Distances = NDArray[np.float64]
AngleOf = Callable[[Distances], Distances]
# Lines are measured to some hundredths of a pixel.
LARGEST_ERROR_PX = 0.05
SAMPLES = 1000


def division(k: float) -> AngleOf:
    """Return Fitzgibbon's division model: the undistorted radius is d / (1 + k d²)."""
    return lambda d: np.arctan2(d, 1 + k * d * d)


def field_of_view(omega: float) -> AngleOf:
    """Return the FOV model of Devernay and Faugeras, by its angle, rad."""
    return lambda d: np.arctan2(np.sin(omega * d), np.cos(omega * d) * 2 * math.tan(omega / 2))


def enhanced_unified(alpha: float, beta: float) -> AngleOf:
    """Return the enhanced unified camera model (EUCM) of Khomutenko, Garcia and Martinet."""

    def angle(d: Distances) -> Distances:
        r2 = beta * d * d
        return np.arctan2(d, (1 - alpha * alpha * r2) / (alpha * np.sqrt(1 - (2 * alpha - 1) * r2) + 1 - alpha))

    return angle


def fit_fisheye(
    node: Node, angle_of: AngleOf, focal: tuple[float, float], principal: tuple[float, float], size: tuple[int, int]
) -> Intrinsics:
    """Return the fisheye that shows rays where a model does in a picture of `size`, to `LARGEST_ERROR_PX`.

    Refuses the model at `node` where it folds, sees as far aside as no fisheye is used, or has no such fisheye.
    """
    sides = ((-0.5, side - 0.5) for side in size)
    corners = [math.hypot(*(np.subtract(corner, principal) / focal)) for corner in product(*sides)]
    distances = np.linspace(0, max(corners), SAMPLES)
    with np.errstate(invalid="ignore"):
        angles = angle_of(distances)
        grows = bool((np.diff(angles) > 0).all())
    if not grows:
        node.refuse("a lens whose rays go farther aside up to the corners of its picture", "one that folds")
    widest = math.atan(WIDEST_FISHEYE)
    if angles[-1] >= widest:
        seen, most = (f"{math.degrees(angle):.0f} degrees" for angle in (angles[-1], widest))
        node.refuse(f"a lens that sees less than {most} off its axis in the corners of its picture", seen)
    terms = angles[:, None] ** [1, 3, 5, 7, 9]
    (scale, *others), *_ = np.linalg.lstsq(terms, distances, rcond=None)
    error_px = max(focal) * float(np.abs(terms @ [scale, *others] - distances).max())
    if error_px > LARGEST_ERROR_PX:
        node.refuse(f"a lens that a fisheye follows to {LARGEST_ERROR_PX:g} px", f"one to {error_px:.2g} px")
    fx, fy = (float(scale * length) for length in focal)
    matrix = camera_matrix(fx, fy, *principal)
    return lens_of(node, matrix, [float(term / scale) for term in others], "fisheye")
