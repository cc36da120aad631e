"""Camera fit to clicked points: its pose, and as many parameters of its lens as are set free.

The clicks are taken for a mixture: most are where their point is, but for an error of a normal distribution whose width
is found with the pose; the others (a wrong label) are anywhere in the picture. So what a fit costs, -2 log likelihood,
can be compared between fits that doubt different clicks, and with a term for each free number (Schwarz's criterion,
BIC) between fits of different lenses.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.derivatives import POSE_NUMBERS, lens_jacobian, moved, pixel_jacobian
from worker.calibration.geometry.lens import LENS_PARAMETERS, Lens
from worker.calibration.onboarding.clicks import Clicks

CLICK_PX = 2.0
"""Standard deviation of a click, in pixels of a 4K frame."""
FREE_PARAMETERS = {
    "focal length": "focal_length_px",
    "centre x": "principal_point_x_px",
    "centre y": "principal_point_y_px",
    "k1": "k1",
    "k2": "k2",
}
"""Parameters of `LENS_PARAMETERS` that clicks may set free, by their names in a fit, where the focal length is its
logarithm."""
STRONG, AMBIGUOUS = 10.0, 6.0
"""Differences of costs: very strong evidence, and not even positive (Kass and Raftery, "Bayes factors", 1995)."""


@dataclass(frozen=True)
class PointFit:
    """Camera fitted to clicks: `off` (N, 2) px, projected minus clicked; `noise_px` of a click, per axis.

    `covariance` (6 + L, 6 + L) of (rotation in the camera's frame rad, position m, the free parameters of the lens: log
    focal length, centre px, k1, k2).
    """

    camera: Camera
    clicks: Clicks
    free: tuple[str, ...]
    off: Array
    noise_px: float
    covariance: Array

    @property
    def residual_px(self) -> Array:
        """Distances (N,) of the clicks from their points; infinite where the camera cannot see the point."""
        return np.where(np.isfinite(self.off).all(axis=1), np.linalg.norm(self.off, axis=1), np.inf)

    @cached_property
    def costs(self) -> Array:
        """Costs (N,) of the clicks: -2 log likelihood."""
        return click_costs(self.residual_px**2, self.noise_px, self.camera.intrinsics.size)

    @property
    def doubted(self) -> NDArray[np.bool_]:
        """True for clicks (N,) that are likelier anywhere in the picture than where their point is."""
        return self.costs >= anywhere_cost(self.camera.intrinsics.size)

    @property
    def believable_px(self) -> float:
        """Largest distance of a click that belongs to a point."""
        width, height = self.camera.intrinsics.size
        return float(self.noise_px * np.sqrt(2 * np.log(width * height / (2 * np.pi * self.noise_px**2))))

    @property
    def rms_px(self) -> float:
        """Rms of the clicks that are not doubted."""
        kept = ~self.doubted
        return float(np.sqrt(np.mean(self.residual_px[kept] ** 2))) if kept.any() else float("inf")

    @property
    def cost(self) -> float:
        """Cost of the fit: -2 log likelihood plus log(2 N) per free parameter; the smaller the better."""
        return float(self.costs.sum()) + (POSE_NUMBERS + len(self.free)) * float(np.log(2 * len(self.clicks)))


def click_costs(squared_px: Array, noise_px: float, size: tuple[int, int]) -> Array:
    """Return -2 log likelihood (...) of clicks off by the root of `squared_px` (...), doubted ones included."""
    near = squared_px / noise_px**2 + 2 * np.log(2 * np.pi * noise_px**2)
    return np.minimum(near, anywhere_cost(size))


def anywhere_cost(size: tuple[int, int]) -> float:
    """Return -2 log likelihood of a click that is anywhere in the picture."""
    return float(2 * np.log(size[0] * size[1]))


def fit(clicks: Clicks, start: Camera, free: tuple[str, ...] = ()) -> PointFit:
    """Return the robust fit nearest to `start`: its pose, and the `free` parameters of its lens (`FREE_PARAMETERS`)."""
    problem = _Problem(clicks, start.intrinsics, free)
    camera, change = start, np.zeros(len(free))
    # Least deviation of a click in the rounds before any click is believed or doubted, in pixels of a 4K frame: a start
    # from three clicks fits those exactly, and they alone must not settle how well people click.
    for least in (16.0, 8.0, 4.0, CLICK_PX):
        noise = problem.median_noise(camera, least)
        # Cauchy's weights while the fit may still be far away; then the likelihood's own verdict on each click.
        squared = np.sum(problem.off(camera) ** 2, axis=1) / noise**2
        soft = 1 / (1 + np.nan_to_num(squared, nan=np.inf) / 4)
        camera, change = problem.descend(camera, change, soft / noise**2)
    noise = problem.median_noise(camera, CLICK_PX)
    for _ in range(4):
        believed = problem.believed(camera, noise)
        camera, change = problem.descend(camera, change, believed / noise**2)
        noise = problem.noise(camera, believed)
    off = problem.off(camera)
    weights = problem.believed(camera, noise) / noise**2
    return PointFit(camera, clicks, free, off, noise, problem.covariance(camera, change, weights))


def refit(before: PointFit, clicks: Clicks) -> PointFit:
    """Return the same fit to other clicks, all believed: for leaving some out."""
    problem = _Problem(clicks, before.camera.intrinsics, before.free)
    weights = np.full(len(clicks), before.noise_px**-2)
    camera, change = problem.descend(before.camera, np.zeros(len(before.free)), weights)
    return replace(
        before,
        camera=camera,
        clicks=clicks,
        off=problem.off(camera),
        covariance=problem.covariance(camera, change, weights),
    )


class _Problem:
    """Least squares of clicks over a pose and the free numbers of a lens."""

    def __init__(self, clicks: Clicks, lens: Lens, free: tuple[str, ...]) -> None:
        self.clicks = clicks
        self.lens = lens
        self.index = [list(FREE_PARAMETERS).index(name) for name in free]
        self.columns = [LENS_PARAMETERS.index(FREE_PARAMETERS[name]) for name in free]
        # Expected errors of a lens that was measured badly; they keep what the clicks do not tell from running away.
        everything = np.array([0.2, 0.1 * lens.size[0], 0.1 * lens.size[0], 0.3, 0.3])
        self.information = np.concatenate([np.zeros(POSE_NUMBERS), everything[self.index] ** -2])

    def off(self, camera: Camera) -> Array:
        """Return projected minus clicked (N, 2)."""
        return camera.project(self.clicks.world) - self.clicks.pixel

    def descend(self, camera: Camera, change: Array, weights: Array) -> tuple[Camera, Array]:
        """Minimise by Levenberg-Marquardt at fixed weights (N,); `change`: of the free parameters so far."""
        damping, loss = 1e-3, self._loss(camera, change, weights)
        for _ in range(6):
            normal, gradient = self._normal(camera, change, weights)
            for _ in range(8):
                damped = normal + damping * np.diag(np.maximum(np.diag(normal), 1e-12))
                move: Array = -np.linalg.solve(damped, gradient).astype(float)
                there, then = self._moved(camera, change, move)
                below = self._loss(there, then, weights)
                if below < loss:
                    break
                damping *= 10
            else:
                return camera, change
            gain = loss - below
            camera, change, loss, damping = there, then, below, damping / 10
            if gain < 1e-9 * loss:
                break
        return camera, change

    def covariance(self, camera: Camera, change: Array, weights: Array) -> Array:
        """Return the covariance of pose and free parameters, from inverse variances of the clicks (N,)."""
        normal, _ = self._normal(camera, change, weights)
        # A direction that the clicks do not fix has an infinite variance; as good as infinite will do, nothing less.
        weakest = np.concatenate([np.full(POSE_NUMBERS, 1e3**-2), np.zeros(len(self.index))])
        return np.linalg.inv(normal + np.diag(weakest)).astype(float)

    def median_noise(self, camera: Camera, least: float) -> float:
        """Return a click's deviation per axis (px), at least `least` (px of a 4K frame), by the median."""
        squared = np.nan_to_num(np.sum(self.off(camera) ** 2, axis=1), nan=np.inf)
        # The median of a distance is 1.18 of either axis's deviation.
        middle = float(np.sqrt(np.median(squared))) / 1.1774
        return float(np.clip(middle, least * self.lens.relative_size, 0.1 * max(self.lens.size)))

    def believed(self, camera: Camera, noise: float) -> Array:
        """Return 1 for clicks (N,) that are likelier where their point is than anywhere else, 0 for others."""
        squared = np.sum(self.off(camera) ** 2, axis=1)
        costs = click_costs(np.nan_to_num(squared, nan=np.inf), noise, self.lens.size)
        return (costs < anywhere_cost(self.lens.size)).astype(float)

    def noise(self, camera: Camera, believed: Array) -> float:
        """Return the deviation of a click per axis (px), by the `believed` ones (N,) and by how well people click."""
        squared = float(np.nansum(believed[:, None] * self.off(camera) ** 2))
        numbers = max(2 * float(believed.sum()) - POSE_NUMBERS - len(self.index), 0.0)
        expected = (CLICK_PX * self.lens.relative_size) ** 2
        # Weight of `CLICK_PX` in the estimate of a click's deviation, in coordinates.
        click_evidence = 4.0
        return float(np.sqrt((click_evidence * expected + squared) / (click_evidence + numbers)))

    def _moved(self, camera: Camera, change: Array, move: Array) -> tuple[Camera, Array]:
        then = change + move[POSE_NUMBERS:]
        there = moved(camera, move[:POSE_NUMBERS])
        return (there.with_lens(self._lens(then)) if self.index else there), then

    def _lens(self, change: Array) -> Lens:
        by = np.zeros(len(FREE_PARAMETERS))
        by[self.index] = change
        matrix = self.lens.matrix.copy()
        matrix[[0, 1], [0, 1]] *= np.exp(np.clip(by[0], -2, 2))
        matrix[:2, 2] += by[1:3]
        distortion = np.zeros(max(len(self.lens.distortion), 4))
        distortion[: len(self.lens.distortion)] = self.lens.distortion
        distortion[:2] += by[3:]
        return replace(self.lens, matrix=matrix, distortion=distortion)

    def _loss(self, camera: Camera, change: Array, weights: Array) -> float:
        squared = np.sum(self.off(camera) ** 2, axis=1)
        # A believed click that the camera cannot see must not look like one that fits.
        unseen = float(sum(self.lens.size)) ** 2
        prior = np.sum(self.information[POSE_NUMBERS:] * change**2)
        return float(np.sum(weights * np.nan_to_num(squared, nan=unseen)) + prior)

    def _normal(self, camera: Camera, change: Array, weights: Array) -> tuple[Array, Array]:
        off, jacobian = self.off(camera), self._jacobian(camera)
        seen = np.isfinite(off).all(axis=1) & np.isfinite(jacobian).all(axis=(1, 2))
        off, jacobian, weights = off[seen], jacobian[seen], weights[seen]
        normal = np.einsum("nai,n,naj->ij", jacobian, weights, jacobian) + np.diag(self.information)
        gradient = np.einsum("nai,n,na->i", jacobian, weights, off)
        gradient[POSE_NUMBERS:] += self.information[POSE_NUMBERS:] * change
        return normal, gradient

    def _jacobian(self, camera: Camera) -> Array:
        """Jacobian (N, 2, 6 + L) of the pixels by pose and free parameters."""
        by_lens = lens_jacobian(camera, self.clicks.world)
        by_lens[..., 0] *= camera.intrinsics.focal_length_px
        return np.concatenate([pixel_jacobian(camera, self.clicks.world), by_lens[..., self.columns]], axis=-1)
