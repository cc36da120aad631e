"""Surfaces on which the lines of a frame are laid out: a plane, or the cylinder or sphere of a panorama.

A plane shows straight lines straight, whatever the lens. Half a turn has no plane: towards its ends a pixel of the
frame would be ten of the plane, and what is painted there would be dots far apart. A panorama is laid out as it is.

Places are in view pixels: those of the focal length 1, times a focal length, from the principal point.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Plane
from worker.calibration.geometry.lens import NEAREST_M, Lens
from worker.calibration.geometry.panorama import Panorama

Places = tuple[Plane, Plane]
Points = tuple[Plane, Plane, Plane]
"""Coordinates in the camera's frame, each (...)."""


class ViewSurface(ABC):
    """A surface around a camera, on which its `lens` lays out a frame."""

    @abstractmethod
    def lay_out(self, pixels: Array) -> Array:
        """Return the places (n, 2), for the focal length 1, of pixels (n, 2) of the frame; NaN without a ray."""

    @abstractmethod
    def outline(self) -> Array:
        """Return the places (n, 2), for the focal length 1, around all that the lens sees."""

    @abstractmethod
    def project(self, points: Points, focal_px: Plane) -> tuple[Places, NDArray[np.bool_]]:
        """Return the places of points, and True where they have one; the others mean nothing."""

    @abstractmethod
    def rays(self, places: Places, focal_px: Plane) -> Points:
        """Return points that are seen at places; coordinates that all of them share once."""

    @abstractmethod
    def moves(self, rays: Points, by: Points) -> Places:
        """Return the moves of places, for the focal length 1, when the points of `rays` move `by` so much."""

    @abstractmethod
    def pulls(self, points: Array, across: Array, focal_px: Array) -> Array:
        """Return the derivatives (..., 3), by points (..., 3), of their places along `across` (..., 2)."""

    @abstractmethod
    def normals(self, starts: Array, ends: Array, focal_px: Array) -> Array:
        """Return normals (..., S, 3) of the planes through the camera and segments (S, 2), for focal lengths (...)."""


def surface_of(lens: Lens) -> ViewSurface:
    """Return the surface on which the frames of a lens are laid out."""
    return PanoramaSurface(lens) if isinstance(lens, Panorama) else PlaneSurface(lens)


@dataclass(frozen=True)
class PlaneSurface(ViewSurface):
    """The plane on which straight lines are straight: the picture without the distortion of its `lens`."""

    lens: Lens

    def lay_out(self, pixels: Array) -> Array:
        """Return rays at depth 1."""
        return self.lens.undistort(pixels)

    def outline(self) -> Array:
        """Return the places along the border of the picture, or nearer where the lens folds before."""
        centre = self.lens.matrix[:2, 2]
        shares = np.linspace(1.0, 0.05, 20)[:, None, None]
        rays = self.lens.undistort(centre + shares * (self.lens.border(60) - centre))
        outermost = np.argmax(np.isfinite(rays).all(axis=-1), axis=0)
        return np.asarray(rays[outermost, np.arange(rays.shape[1])])

    def project(self, points: Points, focal_px: Plane) -> tuple[Places, NDArray[np.bool_]]:
        """Project through a lens that bends nothing."""
        x, y, z = points
        ahead = np.asarray(z > NEAREST_M)
        depth = np.where(ahead, z, 1)
        return (focal_px * x / depth, focal_px * y / depth), ahead

    def rays(self, places: Places, focal_px: Plane) -> Points:
        """Return points at depth 1."""
        x, y = (place / focal_px for place in places)
        return x, y, np.ones((1,) * x.ndim, x.dtype)

    def moves(self, rays: Points, by: Points) -> Places:
        """Return the moves of points at depth 1."""
        x, y, _ = rays
        return by[0] - x * by[2], by[1] - y * by[2]

    def pulls(self, points: Array, across: Array, focal_px: Array) -> Array:
        """Return the derivatives of the projection; those of points behind the camera mean nothing."""
        depth = np.where(points[..., 2:] > NEAREST_M, points[..., 2:], 1.0)
        places = focal_px[..., None] * points[..., :2] / depth
        along = (places * across).sum(axis=-1, keepdims=True)
        return np.concatenate([focal_px[..., None] * across, -along], axis=-1) / depth

    def normals(self, starts: Array, ends: Array, focal_px: Array) -> Array:
        """Return the cross products of the rays at depth 1, times the focal length."""
        (x, y), (other_x, other_y) = starts.T, ends.T
        beyond = (x * other_y - y * other_x) / focal_px[..., None]
        return np.stack(np.broadcast_arrays(y - other_y, other_x - x, beyond), axis=-1)


@dataclass(frozen=True)
class PanoramaSurface(ViewSurface):
    """The cylinder or sphere of a panorama: places are its pixels, but for their size and vertical scale."""

    lens: Panorama

    @cached_property
    def _unit(self) -> Panorama:
        """The panorama of the focal length 1, about the principal point."""
        return replace(self.lens, matrix=np.eye(3))

    def lay_out(self, pixels: Array) -> Array:
        """Return turns and heights."""
        linear = (pixels - self.lens.matrix[:2, 2]) / np.diag(self.lens.matrix)[:2]
        has_ray = np.isfinite(self.lens.directions(pixels)).all(axis=-1, keepdims=True)
        return np.where(has_ray, linear, np.nan)

    def outline(self) -> Array:
        """Return the places along the border of the picture."""
        return self.lay_out(self.lens.border(60))

    def project(self, points: Points, focal_px: Plane) -> tuple[Places, NDArray[np.bool_]]:
        """Project as the lens does."""
        turn, height = self._unit.project_planes(*points)
        seen = np.isfinite(turn)
        return (focal_px * np.where(seen, turn, 0), focal_px * np.where(seen, height, 0)), seen

    def rays(self, places: Places, focal_px: Plane) -> Points:
        """Return points at distance 1 from the axis."""
        directions = self._unit.directions(np.stack([place / focal_px for place in places], axis=-1))
        return directions[..., 0], directions[..., 1], directions[..., 2]

    def moves(self, rays: Points, by: Points) -> Places:
        """Return the moves of points at distance 1 from the axis."""
        jacobian = self._unit.point_jacobian(np.stack(rays, axis=-1))
        moved = np.einsum("...ij,...j->...i", jacobian, np.stack(by, axis=-1))
        return moved[..., 0], moved[..., 1]

    def pulls(self, points: Array, across: Array, focal_px: Array) -> Array:
        """Return the derivatives of the projection, 0 where there is none."""
        by_point = np.einsum("...i,...ij->...j", across, self._unit.point_jacobian(points))
        return np.nan_to_num(focal_px[..., None] * by_point)

    def normals(self, starts: Array, ends: Array, focal_px: Array) -> Array:
        """Return the cross products of the directions of both ends."""
        first, last = (self._unit.directions(places / focal_px[..., None, None]) for places in (starts, ends))
        return np.cross(first, last)
