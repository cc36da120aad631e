"""Seam of two cameras: the distance between their places of the same paint, all along what both see.

It is measured across lines, where both cameras have measured the same piece of one. Along a line nothing tells: each
place says in which direction it holds.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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
    index, apart, sigma = paint_apart(lines, (first.camera, first.measured), (second.camera, second.measured))
    # Largest sigma of a line that is compared.
    known = sigma < 0.2
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


def paint_apart(
    lines: LinePoints, first: tuple[Camera, Measurements], second: tuple[Camera, Measurements]
) -> tuple[NDArray[np.intp], Array, Array]:
    """Return the line points (M,) that both cameras have measured, where both distances below are known.

    With each, how far (M,) m along its normal the second camera puts the paint from where the first does, and sigma.
    """
    index, *its = np.intersect1d(first[1].index, second[1].index, return_indices=True)
    puts, sigmas = [], []
    for (camera, measured), common in zip((first, second), its, strict=True):
        of_both = measured[common]
        puts.append(of_both.offset(camera, lines.position[index]) / of_both.px_per_metre)
        sigmas.append(of_both.noise_px / of_both.px_per_metre)
    apart, sigma = puts[1] - puts[0], np.hypot(*sigmas)
    known = np.isfinite(apart) & np.isfinite(sigma)
    return index[known], apart[known], sigma[known]


def _in_order(places: Sequence[SeamPlace]) -> list[SeamPlace]:
    if len(places) < 2:
        return list(places)
    at = np.array([place.at for place in places])
    _, _, axes = np.linalg.svd(at - at.mean(axis=0), full_matrices=False)
    along = axes[0] * (np.sign(axes[0][np.argmax(np.abs(axes[0]))]) or 1.0)
    return [places[n] for n in np.argsort(at @ along, kind="stable")]
