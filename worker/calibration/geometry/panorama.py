"""Lenses of pictures that were stitched onto a cylinder or a sphere, with projection and analytic derivatives.

A ray is given by its turn about the y axis of the camera's frame (0 forward, positive to the right, up to half a turn
either way) and its height (positive down): columns are fx · turn + cx, rows fy · height + cy. There is no distortion.

Pose and lens share a panorama thus. Tilt and roll of the axis are the pose's alone, and bend the horizon. So is the
turn about the axis: cx shifts the picture exactly as such a turn does, and is never an unknown. The horizon's row cy
shifts the picture alike everywhere, and a tilt by the cosine of the turn, so lines tell the two apart; fy / fx is the
vertical scale, which stitchers choose as they like.
"""

from abc import abstractmethod
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from worker.calibration.geometry.arrays import Array, Plane
from worker.calibration.geometry.lens import LENS_PARAMETERS, NEAREST_M, Lens, LensModel

LARGEST_TURN_RAD = np.radians(179.0)
"""Largest turn from forward of a ray. The gap behind keeps the borders of a whole turn apart: no small step of a point
leads from one to the other."""
LARGEST_HEIGHT_RAD = np.radians(89.0)
"""Largest angle of a ray from the plane across the axis, along which turns have no meaning."""


class Panorama(Lens):
    """A picture stitched onto a surface of revolution about the y axis of the camera's frame."""

    terms: ClassVar[int] = 0
    parameters: ClassVar[tuple[str, ...]] = ("focal_length_px", "principal_point_y_px", "aspect")

    def project_planes(self, x: Plane, y: Plane, z: Plane) -> tuple[Plane, Plane]:
        """Do as `project` for coordinates (...) apart; NaN next to the axis and behind `LARGEST_TURN_RAD`."""
        (fx, _, cx), (_, fy, cy) = self.matrix[:2].tolist()
        turn, slope = self._turn_and_slope(x, y, z)
        return fx * turn + cx, fy * self._height(slope) + cy

    def point_jacobian(self, points: Array) -> Array:
        """Jacobian (..., 2, 3) of the pixels of points (..., 3) by the points; NaN where `project` is."""
        x, y, z = np.moveaxis(points, -1, 0)
        fx, fy = np.diag(self.matrix)[:2].tolist()
        turn, slope = self._turn_and_slope(x, y, z)
        level = np.where(np.isnan(turn), np.nan, np.hypot(x, z))
        by_slope = fy * self._height_derivative(slope) / level
        across = np.stack([fx * z / level**2, 0 * turn, -fx * x / level**2], axis=-1)
        down = np.stack([-by_slope * slope * x / level, by_slope, -by_slope * slope * z / level], axis=-1)
        return np.stack([across, down], axis=-2)

    def parameter_jacobian(self, points: Array) -> Array:
        """Jacobian (..., 2, 6) of the pixels of points (..., 3) by `LENS_PARAMETERS`; 0 by k1 and k2."""
        turn, slope = self._turn_and_slope(*np.moveaxis(points, -1, 0))
        height = self._height(slope)
        fx, fy = np.diag(self.matrix)[:2].tolist()
        jacobian = np.zeros((*turn.shape, 2, len(LENS_PARAMETERS)))
        jacobian[..., 0, 0], jacobian[..., 1, 0] = turn, fy / fx * height
        jacobian[..., 0, 1] = jacobian[..., 1, 2] = 1.0
        jacobian[..., 1, 3] = fx * height
        jacobian[np.isnan(turn)] = np.nan
        return jacobian

    def directions(self, pixels: ArrayLike) -> Array:
        """Return directions (..., 3) in the camera's frame, at distance 1 from the axis, of pixels (..., 2)."""
        linear = (np.asarray(pixels, dtype=float) - self.matrix[:2, 2]) / np.diag(self.matrix)[:2]
        turn = np.where(np.abs(linear[..., 0]) <= LARGEST_TURN_RAD, linear[..., 0], np.nan)
        slope = np.where(np.isnan(turn), np.nan, self._slope(linear[..., 1]))
        found = np.stack([np.sin(turn), slope, np.cos(turn)], axis=-1)
        found[np.isnan(slope)] = np.nan
        return found

    def _turn_and_slope(self, x: Plane, y: Plane, z: Plane) -> tuple[Plane, Plane]:
        """Return the turn (...) of points, rad, and the tangent (...) of their angle from the plane across the axis."""
        level = np.hypot(x, z)
        turn = np.arctan2(x, z)
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = y / level
        seen = (level > NEAREST_M) & (np.abs(turn) <= LARGEST_TURN_RAD)
        seen &= np.abs(slope) <= np.tan(LARGEST_HEIGHT_RAD)
        return np.where(seen, turn, np.nan), np.where(seen, slope, np.nan)

    @abstractmethod
    def _height(self, slope: Plane) -> Plane:
        """Return the height (...) in the picture, for fy = 1, of rays of such a slope."""

    @abstractmethod
    def _height_derivative(self, slope: Plane) -> Plane:
        """Return the derivative (...) of the height by the slope."""

    @abstractmethod
    def _slope(self, height: Array) -> Array:
        """Return the slope (...) of rays that end at such a height; NaN beyond `LARGEST_HEIGHT_RAD`."""


class Cylindrical(Panorama):
    """A cylindrical panorama: the height is the tangent of the angle from the plane across the axis."""

    model: ClassVar[LensModel] = "cylindrical"

    def _height(self, slope: Plane) -> Plane:
        return slope

    def _height_derivative(self, slope: Plane) -> Plane:
        return np.ones_like(slope)

    def _slope(self, height: Array) -> Array:
        return np.where(np.abs(height) <= np.tan(LARGEST_HEIGHT_RAD), height, np.nan)


class Equirectangular(Panorama):
    """An equirectangular panorama: the height is the angle from the plane across the axis."""

    model: ClassVar[LensModel] = "equirectangular"

    def _height(self, slope: Plane) -> Plane:
        return np.arctan(slope)

    def _height_derivative(self, slope: Plane) -> Plane:
        return 1 / (1 + slope * slope)

    def _slope(self, height: Array) -> Array:
        return np.tan(np.where(np.abs(height) <= LARGEST_HEIGHT_RAD, height, np.nan))
