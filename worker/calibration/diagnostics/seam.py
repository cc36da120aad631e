"""Seam of two cameras: the distance between their places of the same paint, all along what both see.

It is measured across lines, where both cameras have measured the same piece of one. Along a line nothing tells: each
place says in which direction it holds.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from worker.calibration.detection.line_measurement import Measurements
from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.field import Field, LinePoints
from worker.calibration.refinement.uncertainty import RefinedPose


@dataclass(frozen=True)
class SeamPlace:
    """Piece of line that two cameras have measured around a point `at` (2,) of the field.

    The second puts its paint `error_m` ± `sigma_m` beside where the first does, `across` (2,) the line.
    """

    at: Array
    across: Array
    error_m: float
    sigma_m: float


@dataclass(frozen=True)
class Seam:
    """Places along what two cameras see, in the order of the longer way through them."""

    places: Sequence[SeamPlace]

    @property
    def worst(self) -> SeamPlace | None:
        """Place of the largest error, without places that are measured clearly less well than most."""
        usual = float(np.median([place.sigma_m for place in self.places])) if self.places else 0.0
        known = [place for place in self.places if place.sigma_m <= 2.0 * usual]
        return max(known, key=lambda place: place.error_m, default=None)


def measure_seam(pitch: Field, first: RefinedPose, second: RefinedPose) -> Seam:
    """Measure the seam of two cameras as they stand; without places where they have measured nothing in common."""
    if first.measured is None or second.measured is None:
        return Seam([])
    lines = pitch.measured_points
    index, a, b = np.intersect1d(first.measured.index, second.measured.index, return_indices=True)
    put_first, sigma_first = paint_offsets(lines, first.camera, first.measured[a])
    put_second, sigma_second = paint_offsets(lines, second.camera, second.measured[b])
    apart, sigma = put_second - put_first, np.hypot(sigma_first, sigma_second)
    # Largest sigma of a line that is compared.
    known = np.isfinite(apart) & (sigma < 0.2)
    index, apart, sigma = index[known], apart[known], sigma[known]
    most_places = 24
    # Line points (25 cm apart) that make a place of the curve: the fewest with which it has not too many.
    for points in (20, 40, 80, 160):
        piece = np.stack([lines.marking[index], index // points], axis=1)
        pieces, which, count = np.unique(piece, axis=0, return_inverse=True, return_counts=True)
        if len(pieces) <= most_places:
            break
    which = which.ravel()
    places = []
    for number in np.flatnonzero(count >= 4):
        its = which == number
        normal = lines.normal[index[its], :2].mean(axis=0)
        error = float(np.median(apart[its]))
        across = np.sign(error or 1.0) * normal / np.linalg.norm(normal)
        at = lines.position[index[its], :2].mean(axis=0)
        places.append(SeamPlace(at, across, abs(error), float(np.median(sigma[its]))))
    return Seam(_in_order(places[:most_places]))


def paint_offsets(lines: LinePoints, camera: Camera, measured: Measurements) -> tuple[Array, Array]:
    """Return the offsets (M,) m, along the lines' normals, of the paint by a camera, and their standard deviations."""
    offset = measured.offset(camera, lines.position[measured.index])
    return offset / measured.px_per_metre, measured.noise_px / measured.px_per_metre


def _in_order(places: Sequence[SeamPlace]) -> list[SeamPlace]:
    if len(places) < 2:
        return list(places)
    at = np.array([place.at for place in places])
    _, _, axes = np.linalg.svd(at - at.mean(axis=0), full_matrices=False)
    along = axes[0] * (np.sign(axes[0][np.argmax(np.abs(axes[0]))]) or 1.0)
    return [places[n] for n in np.argsort(at @ along, kind="stable")]
