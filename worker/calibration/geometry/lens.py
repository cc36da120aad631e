"""Lenses: OpenCV's two models, with projection and analytic derivatives. Those of panoramas are in `panorama`.

A lens of OpenCV's bends a ray, given by its undistorted image coordinates at depth 1 (x right, y down), to distorted
ones, and its matrix makes pixels of those (pixel centres at integers). The models differ in how they bend alone.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar, Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from worker.calibration.geometry.arrays import Array, Plane

LensModel = Literal["opencv", "fisheye", "cylindrical", "equirectangular"]
SigmaSource = Literal["lines"]
DISTORTION_LENGTHS = (0, 4, 5, 8, 12, 14)
FISHEYE_DISTORTION_LENGTHS = (0, 4)
WIDEST_FISHEYE_RAD = np.radians(89.0)
"""Largest angle off the axis at which a fisheye is used: from a right angle on there are no image coordinates at depth
1."""
NEAREST_M = 0.1
"""Least distance from a lens, along its axis or for a panorama from its axis, of a point that it sees."""
IN_PIXELS = ("fx", "fy", "cx", "cy")
LENS_PARAMETERS = ("focal_length_px", "principal_point_x_px", "principal_point_y_px", "aspect", "k1", "k2")
"""Lens parameters that lines can determine: fx, with which fy changes in proportion; cx and cy; fy / fx, which changes
fy alone; the first two coefficients of the distortion."""
SIGMA_NAMES = dict(zip(LENS_PARAMETERS, ("fx", "cx", "cy", "aspect", "k1", "k2"), strict=True))
"""Names of these parameters in the `sigma` of a lens."""


@dataclass(frozen=True)
class Lens(ABC):
    """A lens: points in the camera's frame (x right, y down, z forward) to pixels and back.

    `matrix` (3, 3) in pixels, `distortion` in OpenCV's order for the model, `size` (width, height); `sigma`: one
    standard deviation of its numbers by name (fx, fy, cx, cy in pixels, aspect = fy/fx, k1 ...), of those of which it
    is known. `sigma_from`: `lines` where it was found with a pose, by the same lines that calibrate it.
    """

    matrix: Array
    distortion: Array
    size: tuple[int, int]
    sigma: Mapping[str, float] = field(default_factory=dict)
    sigma_from: SigmaSource | None = None
    model: ClassVar[LensModel]
    terms: ClassVar[int]
    """Number of coefficients of the model."""
    parameters: ClassVar[tuple[str, ...]] = LENS_PARAMETERS
    """Parameters among `LENS_PARAMETERS` that the model has and lines can tell from the pose."""

    def project(self, points: Array) -> Array:
        """Project points (..., 3) in the camera's frame to pixels (..., 2); NaN where the model has no pixel."""
        return np.stack(self.project_planes(*np.moveaxis(points, -1, 0)), axis=-1)

    @abstractmethod
    def project_planes(self, x: Plane, y: Plane, z: Plane) -> tuple[Plane, Plane]:
        """Do as `project` for coordinates (...) apart, in their own precision: large populations need it."""

    @abstractmethod
    def point_jacobian(self, points: Array) -> Array:
        """Jacobian (..., 2, 3) of the pixels of points (..., 3) in the camera's frame by the points."""

    @abstractmethod
    def parameter_jacobian(self, points: Array) -> Array:
        """Jacobian (..., 2, 6) of the pixels of points (..., 3) in the camera's frame by `LENS_PARAMETERS`."""

    @abstractmethod
    def directions(self, pixels: ArrayLike) -> Array:
        """Return directions (..., 3) in the camera's frame, not normalised, of pixels (..., 2); NaN without a ray."""

    def distort(self, rays: Array) -> Array:
        """Project undistorted image coordinates (..., 2) at depth 1 to pixels (..., 2); NaN where none is."""
        return self.project(np.concatenate([rays, np.ones_like(rays[..., :1])], axis=-1))

    def undistort(self, pixels: ArrayLike) -> Array:
        """Return image coordinates (..., 2) at depth 1 of pixels (..., 2); NaN where no ray goes forward."""
        directions = self.directions(pixels)
        depth = directions[..., 2:]
        # As far aside as a fisheye is used.
        ahead = depth > np.cos(WIDEST_FISHEYE_RAD) * np.linalg.norm(directions, axis=-1, keepdims=True)
        return np.asarray(directions[..., :2] / np.where(ahead, depth, np.nan))

    def border(self, a_side: int) -> Array:
        """Return pixels (4 `a_side`, 2) around the border of the picture, in order, `a_side` of them on each side."""
        width, height = self.size
        across, down = np.linspace(0, width - 1, a_side), np.linspace(0, height - 1, a_side)
        top, right = np.c_[across, 0 * across], np.c_[0 * down + width - 1, down]
        bottom, left = np.c_[across[::-1], 0 * across + height - 1], np.c_[0 * down, down[::-1]]
        return np.concatenate([top, right, bottom, left])

    @property
    def focal_length_px(self) -> float:
        """Horizontal focal length."""
        return float(self.matrix[0, 0])

    @property
    def relative_size(self) -> float:
        """Ratio of the picture's longer side to that of a 4K frame, by which lengths in 4K pixels scale."""
        return max(self.size) / 3840

    @cached_property
    def coefficients(self) -> Array:
        """The coefficients (`terms`,) of the model in OpenCV's order, absent ones zero."""
        padded = np.zeros(self.terms)
        padded[: len(self.distortion)] = self.distortion
        return padded

    def scaled(self, factor: float) -> Self:
        """Return the lens of a picture resized by `factor`, pixel centres at integers before and after."""
        width, height = round(self.size[0] * factor), round(self.size[1] * factor)
        matrix = self.matrix.copy()
        for axis, ratio in ((0, width / self.size[0]), (1, height / self.size[1])):
            matrix[axis] *= ratio
            matrix[axis, 2] = (self.matrix[axis, 2] + 0.5) * ratio - 0.5
        sigma = {name: value * (factor if name in IN_PIXELS else 1.0) for name, value in self.sigma.items()}
        return replace(self, matrix=matrix, size=(width, height), sigma=sigma)


class PlanarLens(Lens):
    """A lens whose rays are given by their undistorted image coordinates at depth 1, as OpenCV's are."""

    def project_planes(self, x: Plane, y: Plane, z: Plane) -> tuple[Plane, Plane]:
        """Do as `project` for coordinates (...) apart; NaN behind the camera and beyond `largest_radius`."""
        depth = np.where(z > NEAREST_M, z, np.nan)
        return self.distort_planes(x / depth, y / depth)

    def point_jacobian(self, points: Array) -> Array:
        """Jacobian (..., 2, 3) of the pixels of points (..., 3) by the points; NaN where `project` is."""
        rays = self._rays(points)
        by_ray = self.jacobian(rays)
        return np.concatenate([by_ray, -(by_ray @ rays[..., None])], axis=-1) / points[..., 2:, None]

    def parameter_jacobian(self, points: Array) -> Array:
        """Jacobian (..., 2, 6) of the pixels of points (..., 3) by `LENS_PARAMETERS`; NaN where `project` is."""
        return self.jacobian_by_parameters(self._rays(points))

    def directions(self, pixels: ArrayLike) -> Array:
        """Return directions (..., 3) of depth 1 in the camera's frame of pixels (..., 2); NaN without a ray."""
        plane = self.undistort(pixels)
        return np.concatenate([plane, np.ones_like(plane[..., :1])], axis=-1)

    def _rays(self, points: Array) -> Array:
        """Return image coordinates (..., 2) at depth 1 of points (..., 3); NaN behind the camera."""
        depth = points[..., 2:]
        return np.asarray(points[..., :2] / np.where(depth > NEAREST_M, depth, np.nan))

    def distort(self, rays: Array) -> Array:
        """Project undistorted image coordinates (..., 2) at depth 1 to pixels (..., 2); NaN beyond `largest_radius`."""
        return np.stack(self.distort_planes(rays[..., 0], rays[..., 1]), axis=-1)

    def distort_planes(self, x: Plane, y: Plane) -> tuple[Plane, Plane]:
        """Do as `distort` for columns and rows (...) apart, in their own precision: large populations need it."""
        xd, yd = self._bent(x, y)
        (fx, skew, cx), (_, fy, cy) = self.matrix[:2].tolist()
        return fx * xd + skew * yd + cx, fy * yd + cy

    def jacobian(self, rays: Array) -> Array:
        """Jacobian (..., 2, 2) of the pixels of rays (..., 2) by the rays; NaN beyond `largest_radius`."""
        return self.matrix[:2, :2] @ self._bent_by_ray(rays)

    def jacobian_by_parameters(self, rays: Array) -> Array:
        """Jacobian (..., 2, 6) of the pixels of rays (..., 2) by `LENS_PARAMETERS`; NaN beyond `largest_radius`."""
        xd, yd = self._bent(rays[..., 0], rays[..., 1])
        (fx, _), (_, fy) = self.matrix[:2, :2].tolist()
        jacobian = np.zeros((*rays.shape, len(LENS_PARAMETERS)))
        jacobian[..., 0, 0], jacobian[..., 1, 0] = xd, fy / fx * yd
        jacobian[..., 0, 1] = jacobian[..., 1, 2] = 1.0
        jacobian[..., 1, 3] = fx * yd
        jacobian[..., 4:] = self.matrix[:2, :2] @ self._bent_by_terms(rays)
        jacobian[np.isnan(xd)] = np.nan
        return jacobian

    @abstractmethod
    def undistort(self, pixels: ArrayLike) -> Array:
        """Return image coordinates (..., 2) at depth 1 of pixels (..., 2); NaN where the model has no ray."""

    @property
    @abstractmethod
    def largest_radius(self) -> float:
        """Undistorted radius (at depth 1) up to which the model grows.

        Beyond it the polynomial folds back and would put points from far outside the view into the picture.
        """

    @abstractmethod
    def _bent(self, x: Plane, y: Plane) -> tuple[Plane, Plane]:
        """Return distorted coordinates (...) of rays (...), in their own precision; NaN beyond `largest_radius`."""

    @abstractmethod
    def _bent_by_ray(self, rays: Array) -> Array:
        """Jacobian (..., 2, 2) of the distorted coordinates of rays (..., 2) by the rays."""

    @abstractmethod
    def _bent_by_terms(self, rays: Array) -> Array:
        """Jacobian (..., 2, 2) of the distorted coordinates of rays (..., 2) by k1 and k2."""

    def _within_model(self, rays: Array) -> Array:
        """Return rays (..., 2), NaN beyond `largest_radius`."""
        beyond = np.sum(rays * rays, axis=-1, keepdims=True) > self.largest_radius**2
        return np.where(beyond, np.nan, rays)


class Intrinsics(PlanarLens):
    """A lens of OpenCV's calib3d: pinhole with radial, tangential, thin prism and tilt terms (Brown and Conrady).

    `distortion` (`DISTORTION_LENGTHS`): k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tau_x tau_y. The formulae are those of
    OpenCV's documentation of calib3d.
    """

    model: ClassVar[LensModel] = "opencv"
    terms: ClassVar[int] = 14

    def undistort(self, pixels: ArrayLike, iterations: int = 20) -> Array:
        """Return undistorted image coordinates (..., 2) at depth 1 of pixels (..., 2), by Newton's method from a table.

        NaN where no ray of the model ends at the pixel.
        """
        target = np.asarray(pixels, dtype=float)
        linear = self.matrix[:2, :2]
        rays = (target - self.matrix[:2, 2]) @ np.linalg.inv(linear).T
        rays = self._pulled_back(rays * self._undistorted_scale(np.linalg.norm(rays, axis=-1))[..., None])
        for _ in range(iterations):
            jacobian, miss = self.jacobian(rays), target - self.distort(rays)
            determinant = jacobian[..., 0, 0] * jacobian[..., 1, 1] - jacobian[..., 0, 1] * jacobian[..., 1, 0]
            move = np.stack(
                [
                    jacobian[..., 1, 1] * miss[..., 0] - jacobian[..., 0, 1] * miss[..., 1],
                    jacobian[..., 0, 0] * miss[..., 1] - jacobian[..., 1, 0] * miss[..., 0],
                ],
                axis=-1,
            )
            with np.errstate(divide="ignore", invalid="ignore"):
                # No step where the map is stationary.
                move = np.where(determinant[..., None] == 0, np.nan, move / determinant[..., None])
            rays = self._pulled_back(rays + move)
            if np.nanmax(np.abs(move), initial=0.0) < 1e-12:
                break
        with np.errstate(invalid="ignore"):
            off = ~(np.linalg.norm(self.distort(rays) - target, axis=-1) < 1e-3)
        rays[off] = np.nan
        return rays

    @cached_property
    def largest_radius(self) -> float:
        """Undistorted radius (at depth 1) up to which the radial model grows."""
        k1, k2, _, _, k3, k4, k5, k6 = self.coefficients[:8]
        # The whole picture of a long lens lies within some thousandths.
        radii = np.concatenate([[0.0], np.geomspace(1e-5, 0.1, 1000)[:-1], np.linspace(0.1, 20.0, 19901)])
        r2 = radii**2
        denominator = 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
        radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / np.where(denominator > 0, denominator, np.nan)
        growing = np.diff(radii * radial) > 0
        return float(radii[-1] if growing.all() else radii[np.argmin(growing)])

    @cached_property
    def tilt(self) -> Array:
        """Homography (3, 3) of a tilted sensor (tau_x, tau_y), identity without tilt; as in OpenCV's documentation."""
        tau_x, tau_y = self.coefficients[12:]
        if tau_x == 0 and tau_y == 0:
            return np.eye(3)
        cx, sx, cy, sy = np.cos(tau_x), np.sin(tau_x), np.cos(tau_y), np.sin(tau_y)
        rot = np.array([[cy, 0, -sy], [0, 1, 0], [sy, 0, cy]]) @ np.array([[1, 0, 0], [0, cx, sx], [0, -sx, cx]])
        return np.array([[rot[2, 2], 0, -rot[0, 2]], [0, rot[2, 2], -rot[1, 2]], [0, 0, 1]]) @ rot

    def _bent(self, x: Plane, y: Plane) -> tuple[Plane, Plane]:
        # Before the powers of their radius: those of a ray from far outside may be infinite.
        beyond = x * x + y * y > self.largest_radius**2
        x, y = np.where(beyond, np.nan, x), np.where(beyond, np.nan, y)
        return self._tilted(*self._bent_upright(x, y))

    def _bent_upright(self, x: Plane, y: Plane) -> tuple[Plane, Plane]:
        """Return distorted coordinates (...) of rays (...) on a sensor without tilt."""
        k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4 = self.coefficients[:12].tolist()
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        if k4 or k5 or k6:
            radial = radial / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
        xd = x * radial
        yd = y * radial
        if p1 or p2 or s1 or s2 or s3 or s4:
            xd = xd + 2 * p1 * x * y + p2 * (r2 + 2 * x * x) + r2 * (s1 + s2 * r2)
            yd = yd + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y + r2 * (s3 + s4 * r2)
        return xd, yd

    def _tilted(self, xd: Plane, yd: Plane) -> tuple[Plane, Plane]:
        """Map coordinates (...) on a sensor without tilt to those on the tilted sensor."""
        if not self._is_tilted:
            return xd, yd
        (a, b, c), (d, e, f), (g, h, i) = self.tilt.tolist()
        depth = g * xd + h * yd + i
        return (a * xd + b * yd + c) / depth, (d * xd + e * yd + f) / depth

    def _bent_by_ray(self, rays: Array) -> Array:
        x, y = np.moveaxis(self._within_model(rays), -1, 0)
        _, _, p1, p2, _, _, _, _, s1, s2, s3, s4 = self.coefficients[:12].tolist()
        r2 = x * x + y * y
        radial, by_r2, _ = self._radial(r2)
        xd_by_r2, yd_by_r2 = x * by_r2 + s1 + 2 * s2 * r2, y * by_r2 + s3 + 2 * s4 * r2
        aside = 2 * (p1 * x + p2 * y)
        jacobian = np.stack(
            [
                radial + 2 * x * xd_by_r2 + 2 * p1 * y + 6 * p2 * x,
                2 * y * xd_by_r2 + aside,
                2 * x * yd_by_r2 + aside,
                radial + 2 * y * yd_by_r2 + 6 * p1 * y + 2 * p2 * x,
            ],
            axis=-1,
        )
        return self._on_tilted(x, y, jacobian.reshape(*x.shape, 2, 2))

    def _bent_by_terms(self, rays: Array) -> Array:
        x, y = np.moveaxis(self._within_model(rays), -1, 0)
        r2 = x * x + y * y
        _, _, denominator = self._radial(r2)
        by_k1 = rays * (r2 / denominator)[..., None]
        return self._on_tilted(x, y, np.stack([by_k1, by_k1 * r2[..., None]], axis=-1))

    def _radial(self, r2: Array) -> tuple[Array, Array, Array]:
        """Return radial factor, its derivative by `r2`, and its denominator at squared radius `r2` (...)."""
        k1, k2, _, _, k3, k4, k5, k6 = self.coefficients[:8].tolist()
        denominator = 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
        radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / denominator
        by_r2 = k1 + r2 * (2 * k2 + r2 * 3 * k3) - radial * (k4 + r2 * (2 * k5 + r2 * 3 * k6))
        return radial, by_r2 / denominator, denominator

    def _on_tilted(self, x: Array, y: Array, jacobian: Array) -> Array:
        """Map a Jacobian (..., 2, n) of distorted coordinates of rays (...) to the tilted sensor."""
        if not self._is_tilted:
            return jacobian
        xd, yd = self._bent_upright(x, y)
        there = np.stack(self._tilted(xd, yd), axis=-1)
        depth = self.tilt[2, 0] * xd + self.tilt[2, 1] * yd + self.tilt[2, 2]
        by_upright = (self.tilt[:2, :2] - there[..., None] * self.tilt[2, :2]) / depth[..., None, None]
        return by_upright @ jacobian

    @property
    def _is_tilted(self) -> bool:
        return bool(self.coefficients[12:].any())

    def _pulled_back(self, rays: Array) -> Array:
        """Return rays (..., 2) limited to where the radial model grows: Newton must not jump over its end."""
        radius = np.linalg.norm(rays, axis=-1, keepdims=True)
        limit = 0.9999 * self.largest_radius
        return np.where(radius > limit, rays * (limit / np.maximum(radius, max(limit, 1e-12))), rays)

    def _undistorted_scale(self, distorted_radius: Array) -> Array:
        """Return the ratio of undistorted to distorted radius by the radial terms alone, to start Newton's method."""
        radii = np.linspace(1e-6, min(self.largest_radius, 20.0), 4000)
        radial, _, _ = self._radial(radii**2)
        return np.interp(distorted_radius, radii * radial, radii) / np.maximum(distorted_radius, 1e-6)


class Fisheye(PlanarLens):
    """A lens of OpenCV's fisheye module: Kannala and Brandt, "A generic camera model", PAMI 2006, with four terms.

    A ray at the angle t off the axis ends at the distance t (1 + k1 t² + k2 t⁴ + k3 t⁶ + k4 t⁸) from the centre, for
    `matrix` = 1. `distortion` (`FISHEYE_DISTORTION_LENGTHS`) are k1 to k4.
    """

    model: ClassVar[LensModel] = "fisheye"
    terms: ClassVar[int] = 4

    def undistort(self, pixels: ArrayLike, iterations: int = 6) -> Array:
        """Return undistorted image coordinates (..., 2) at depth 1 of pixels (..., 2), by Newton's method from a table.

        NaN where no ray of the model ends at the pixel.
        """
        linear = self.matrix[:2, :2]
        rays = (np.asarray(pixels, dtype=float) - self.matrix[:2, 2]) @ np.linalg.inv(linear).T
        distorted = np.linalg.norm(rays, axis=-1)
        table = np.linspace(0.0, self._largest_angle, 4000)
        angle = np.interp(distorted, self._distorted_angle(table), table)
        for _ in range(iterations):
            # At its very end the model may stand still.
            step = (distorted - self._distorted_angle(angle)) / np.maximum(self._angle_derivative(angle), 1e-6)
            angle = np.clip(angle + step, 0.0, self._largest_angle)
        known = np.abs(distorted - self._distorted_angle(angle)) * linear[0, 0] < 1e-3
        scale = np.where(distorted > 1e-9, np.tan(angle) / np.maximum(distorted, 1e-9), 1.0)
        return np.where(known, scale, np.nan)[..., None] * rays

    @cached_property
    def largest_radius(self) -> float:
        """Undistorted radius (at depth 1) up to which the model grows; that of `WIDEST_FISHEYE_RAD` at most."""
        return float(np.tan(self._largest_angle))

    @cached_property
    def _largest_angle(self) -> float:
        """Largest angle (rad) up to which the model grows, at most `WIDEST_FISHEYE_RAD`."""
        angles = np.linspace(0.0, WIDEST_FISHEYE_RAD, 8901)
        growing = np.diff(self._distorted_angle(angles)) > 0
        return float(angles[-1] if growing.all() else angles[np.argmin(growing)])

    def _distorted_angle(self, angle: Plane) -> Plane:
        k1, k2, k3, k4 = self.coefficients.tolist()
        t2 = angle * angle
        return angle * (1 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))))

    def _angle_derivative(self, angle: Array) -> Array:
        k1, k2, k3, k4 = self.coefficients.tolist()
        t2 = angle * angle
        return 1 + t2 * (3 * k1 + t2 * (5 * k2 + t2 * (7 * k3 + t2 * 9 * k4)))

    def _bent(self, x: Plane, y: Plane) -> tuple[Plane, Plane]:
        radius = np.sqrt(x * x + y * y)
        scale = np.where(radius > self.largest_radius, np.nan, self._scale(radius, np.arctan(radius)))
        scale = scale.astype(radius.dtype, copy=False)
        return x * scale, y * scale

    def _scale(self, radius: Plane, angle: Plane) -> Plane:
        """Return the ratio (...) of distorted to undistorted radius."""
        # On the axis it is 1, and this far off it still is.
        return np.where(radius > 1e-6, self._distorted_angle(angle) / np.maximum(radius, 1e-6), 1)

    def _bent_by_ray(self, rays: Array) -> Array:
        radius, angle, outwards = self._polar(rays)
        across = self._scale(radius, angle)[..., None, None]
        along = (self._angle_derivative(angle) / (1 + radius * radius))[..., None, None]
        return across * np.eye(2) + (along - across) * outwards[..., :, None] * outwards[..., None, :]

    def _bent_by_terms(self, rays: Array) -> Array:
        _, angle, outwards = self._polar(rays)
        by_k1 = outwards * (angle * angle * angle)[..., None]
        return np.stack([by_k1, by_k1 * (angle * angle)[..., None]], axis=-1)

    def _polar(self, rays: Array) -> tuple[Array, Array, Array]:
        """Return radius (...), angle (...) off the axis and direction (..., 2), 0 on the axis, of rays (..., 2).

        NaN beyond `largest_radius`.
        """
        rays = self._within_model(rays)
        radius = np.linalg.norm(rays, axis=-1)
        return radius, np.arctan(radius), rays / np.maximum(radius, 1e-12)[..., None]
