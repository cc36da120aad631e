"""Views of a court: a pinhole camera for a crop, or a camera of the engine for a whole frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from models.training.drawing.noise import Patch
from models.training.pitches.surface import ground_patch, window_rays
from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.field import Field


class View(Protocol):
    """Projection between the ground and a square picture, both ways."""

    @property
    def focal(self) -> float:
        """Pixels."""

    def project(self, xy: Array) -> tuple[Array, Array]:
        """Pixels (n, 2) and depths (n,) of points (n, 2) on the ground; a depth of 0 or less is not in sight."""

    def patch(self, size: int) -> Patch:
        """Return the places on the ground that the pixels of a picture of `size` px show."""


@dataclass(frozen=True)
class Window:
    """A pinhole camera of its own for one crop: pixel = K R (X - centre), bent by `bend` about `pivot`."""

    centre: Array
    rotation: Array
    focal: float
    principal: Array
    bend: float
    pivot: Array

    def project(self, xy: Array) -> tuple[Array, Array]:
        """Pixels (n, 2) and depths (n,) of points (n, 2) on the ground."""
        seen = (np.column_stack([xy, np.zeros(len(xy))]) - self.centre) @ self.rotation.T
        depth = seen[:, 2]
        pixel = self.focal * seen[:, :2] / np.maximum(depth, 1e-3)[:, None] + self.principal
        away = pixel - self.pivot
        return self.pivot + away * (1 + self.bend * (away**2).sum(axis=1, keepdims=True)), depth

    def patch(self, size: int) -> Patch:
        """Return the places on the ground that pixels show, without distortion."""
        row, column = np.mgrid[0:size, 0:size].astype(np.float32)
        rays = np.stack([(column - self.principal[0]), (row - self.principal[1]), np.full_like(row, self.focal)], -1)
        rays = rays @ self.rotation
        down = rays[..., 2] < -1e-3 * self.focal
        reach = np.where(down, -self.centre[2] / np.minimum(rays[..., 2], -1e-3 * self.focal), 0)
        x, y = (np.float32(self.centre[i] + reach * rays[..., i]) for i in (0, 1))
        return Patch(x, y, np.float32(reach * np.linalg.norm(rays, axis=-1)), down)


@dataclass(frozen=True)
class FieldView:
    """The whole frame of a camera that looks at a field: exact, with its lens and the field's surface."""

    pitch: Field
    camera: Camera

    @property
    def focal(self) -> float:
        """Pixels."""
        return float(self.camera.intrinsics.matrix[0, 0])

    def project(self, xy: Array) -> tuple[Array, Array]:
        """Pixels (n, 2) and depths (n,) of points (n, 2) on the field, 0 where the lens does not show them."""
        place = self.pitch.lift(xy)
        pixel = self.camera.project(place)
        depth = (place - self.camera.pose.position) @ self.camera.pose.matrix[2]
        return pixel, np.where(np.isfinite(pixel).all(axis=1), depth, 0.0)

    def patch(self, size: int) -> Patch:
        """Return the places on the field, and on the ground around it, that pixels show."""
        return ground_patch(self.pitch, None, self.camera.pose.position, window_rays(self.camera, (0, 0, size, size)))
