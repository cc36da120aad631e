"""Freed lens: as many free parameters of a lens as clicks can justify, and what freeing them is worth.

A lens measured badly and a wrong label can pass for each other. So a lens is touched only where the fit's cost falls by
what is very strong evidence, and clicks left out of it are foretold better.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from worker.calibration.geometry.camera import Array
from worker.calibration.geometry.derivatives import POSE_NUMBERS
from worker.calibration.geometry.lens import Lens
from worker.calibration.onboarding.point_fit import FREE_PARAMETERS, STRONG, PointFit, fit, refit

LENS_LADDER: tuple[tuple[str, ...], ...] = (
    ("focal length",),
    ("focal length", "k1", "k2"),
    ("focal length", "centre x", "centre y", "k1", "k2"),
)
FEWEST_SPARE = 6
"""Fewest coordinates beyond the parameters of a fit with which its lens is freed."""
OF_THE_MATRIX = ("fx", "fy", "aspect", "cx", "cy")


@dataclass(frozen=True)
class LensGain:
    """Gain from freeing parameters of the lens: the fits `before` and `after`, and how well each predicts clicks.

    `left_out_px`: rms of clicks where a fit to the others puts them.
    """

    before: PointFit
    after: PointFit
    left_out_before_px: float
    left_out_px: float

    @property
    def evidence(self) -> float:
        """Decrease of the cost (a difference of BIC: above 10 is very strong evidence)."""
        return self.before.cost - self.after.cost

    @property
    def sigma(self) -> Mapping[str, float]:
        """Standard deviation of each free parameter; of the focal length and of the centre in pixels."""
        deviations = np.sqrt(np.maximum(np.diag(self.after.covariance)[POSE_NUMBERS:], 0.0))
        # Its logarithm is what was fitted.
        focal = self.after.camera.intrinsics.focal_length_px
        scale = [focal if name == "focal length" else 1.0 for name in self.after.free]
        return {name: float(s * k) for name, s, k in zip(self.after.free, deviations, scale, strict=True)}

    @property
    def found(self) -> PointFit:
        """Fit `after`, whose lens has the `sigma` of what was freed and of what it keeps of the lens before."""
        lens, freed = self.after.camera.intrinsics, dict(self.sigma)
        names = {"centre x": "cx", "centre y": "cy"}
        one = freed.pop("focal length")
        both = {"fx": one, "fy": one * float(lens.matrix[1, 1] / lens.matrix[0, 0])}
        known = {**lens.sigma, **both, **{names.get(name, name): value for name, value in freed.items()}}
        return replace(self.after, camera=self.after.camera.with_lens(replace(lens, sigma=known)))


def free_lens(found: PointFit) -> LensGain | None:
    """Return the gain from as many free parameters of the lens as the clicks justify; None: they justify none."""
    lens = found.camera.intrinsics
    believed = int((~found.doubted).sum())
    rungs = [
        free
        for free in LENS_LADDER
        if 2 * believed >= POSE_NUMBERS + len(free) + FEWEST_SPARE
        and {FREE_PARAMETERS[name] for name in free} <= set(lens.parameters)
    ]
    tried = [
        fit(found.clicks, found.camera.with_lens(two_terms(lens)) if "k1" in free else found.camera, free)
        for free in rungs
    ]
    best = min(tried, key=lambda candidate: candidate.cost, default=found)
    if best.cost > found.cost - STRONG:
        return None
    gain = LensGain(found, best, left_out_px(found), left_out_px(best))
    return gain if gain.left_out_px < gain.left_out_before_px else None


def left_out_px(found: PointFit) -> float:
    """Return the rms of believed clicks, each against a fit to the others."""
    believed = found.clicks[~found.doubted]
    squared = []
    folds = 10
    for number in range(min(folds, len(believed))):
        out = np.arange(len(believed)) % min(folds, len(believed)) == number
        without = refit(found, believed[~out])
        off = without.camera.project(believed.world[out]) - believed.pixel[out]
        squared.append(np.sum(off**2, axis=1))
    return float(np.sqrt(np.nanmean(np.concatenate(squared)))) if squared else float("inf")


def two_terms(lens: Lens) -> Lens:
    """Return the lens of the same kind with k1 and k2 alone, and square pixels, that comes nearest to `lens`.

    How well the matrix is known stays; k1 and k2 are others, of which nothing is known yet.
    """
    matrix = lens.matrix.copy()
    matrix[0, 1] = 0.0
    # Deviation from square up to which pixels are square: a board that says otherwise by less was misread.
    if abs(matrix[1, 1] / matrix[0, 0] - 1) < 0.02:
        matrix[0, 0] = matrix[1, 1] = np.sqrt(matrix[0, 0] * matrix[1, 1])
    farthest = np.nanmax(np.linalg.norm(lens.undistort(lens.border(20)), axis=1))
    radius = np.linspace(0.0, farthest, 50)[1:-1]
    across = np.stack([radius, np.zeros_like(radius)], axis=1)
    plain = type(lens)(np.eye(3), np.zeros(0), lens.size)
    bent = type(lens)(np.eye(3), _radial_only(lens), lens.size).distort(across)[:, 0]
    straight = plain.distort(across)[:, 0]
    terms = np.stack([straight**3, straight**5], axis=1)
    (k1, k2), *_ = np.linalg.lstsq(terms, bent - straight, rcond=None)
    distortion = np.zeros(4 if lens.model == "fisheye" else 5)
    distortion[:2] = k1, k2
    sigma = {name: value for name, value in lens.sigma.items() if name in OF_THE_MATRIX}
    return type(lens)(matrix, distortion, lens.size, sigma)


def _radial_only(lens: Lens) -> Array:
    """Return the distortion of a lens without its terms that are not the same all around its axis."""
    distortion = np.array(lens.distortion, dtype=float)
    if lens.model == "opencv":
        distortion[2:4] = 0.0
        distortion[8:] = 0.0
    return distortion
