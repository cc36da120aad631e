"""Cameras: lenses at poses, and the projection of many points by many poses at once.

World: right-handed, metres, z up. Camera: OpenCV (x right, y down, z forward; pixel centres at integers).
A pose is the rotation vector world to camera and the camera's centre in the world, so that a change of rotation turns
the view and does not swing the camera around the pitch: P = K R [I | -C].
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from worker.calibration.geometry.arrays import Array as Array  # Whoever takes a camera takes arrays.
from worker.calibration.geometry.arrays import Plane as Plane
from worker.calibration.geometry.ignored_areas import Ignored
from worker.calibration.geometry.lens import Lens
from worker.calibration.geometry.rotation import rotation_matrices, rotation_vectors

Frame = NDArray[np.uint8]
"""A picture as a camera took it: (height, width, 3), blue, green, red."""


@dataclass(frozen=True)
class Pose:
    """Pose of a camera: `rotation` (3,) rad, world to camera; `position` (3,) m, the camera's centre in the world."""

    rotation: Array
    position: Array

    @classmethod
    def from_translation(cls, rotation: ArrayLike, translation: ArrayLike) -> "Pose":
        """Return the pose of OpenCV's rvec and tvec (tvec = -R position)."""
        rvec = np.asarray(rotation, dtype=float)
        return cls(rvec, -rotation_matrices(rvec).T @ np.asarray(translation, dtype=float))

    @classmethod
    def looking_at(cls, position: ArrayLike, target: ArrayLike, roll_deg: float = 0.0) -> "Pose":
        """Return the pose at `position` with `target` in the principal point and a level horizon but for `roll_deg`."""
        centre = np.asarray(position, dtype=float)
        forward = np.asarray(target, dtype=float) - centre
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right = right / np.linalg.norm(right)
        upright = np.stack([right, np.cross(forward, right), forward])
        roll = rotation_matrices(np.array([0.0, 0.0, np.radians(roll_deg)]))
        return cls(rotation_vectors(roll @ upright), centre)

    @cached_property
    def matrix(self) -> Array:
        """Rotation matrix (3, 3), world to camera."""
        return rotation_matrices(self.rotation)

    @property
    def translation(self) -> Array:
        """OpenCV's tvec (3,), metres."""
        return -self.matrix @ self.position


@dataclass(frozen=True)
class Camera:
    """One camera of an installation: lens, pose, and the `ignored` parts of its picture."""

    id: str
    intrinsics: Lens
    pose: Pose
    ignored: Ignored | None = None

    def project(self, points: Array) -> Array:
        """Project world points (..., 3) to pixels (..., 2); NaN where its lens has no pixel."""
        in_a_row = points.reshape(-1, 3).T
        planes = _turned_and_bent(in_a_row, self.pose.matrix[None], self.pose.position[None], self.intrinsics)
        return np.stack(planes, axis=-1)[0].reshape(*points.shape[:-1], 2)

    def rays(self, pixels: ArrayLike) -> Array:
        """Return directions in the world (..., 3), not normalised, through pixels (..., 2)."""
        return self.intrinsics.directions(pixels) @ self.pose.matrix

    def distance_m(self, other: "Camera") -> float:
        """Return the distance (m) between the positions of two cameras."""
        return float(np.linalg.norm(self.pose.position - other.pose.position))

    def with_pose(self, pose: Pose) -> "Camera":
        """Return the camera with another pose."""
        return Camera(self.id, self.intrinsics, pose, self.ignored)

    def with_lens(self, intrinsics: Lens) -> "Camera":
        """Return the camera with another lens."""
        return Camera(self.id, intrinsics, self.pose, self.ignored)

    def resized(self, width_px: int) -> "Camera":
        """Return the camera of its picture resized to a width."""
        lens = self.intrinsics.scaled(width_px / self.intrinsics.size[0])
        return Camera(self.id, lens, self.pose, None if self.ignored is None else self.ignored.resized(lens.size))

    def sees(self, pixels: Array) -> NDArray[np.bool_]:
        """True for pixels (..., 2) inside the picture and not ignored."""
        within = inside(pixels, self.intrinsics.size)
        return within if self.ignored is None else within & ~self.ignored.at(pixels, self.intrinsics.size)


def project(points: Array, rotations: Array, positions: Array, intrinsics: Lens) -> Array:
    """Project N points by each of P poses in one array operation.

    points (N, 3) metres; rotations (P, 3) rad; positions (P, 3) metres. Returns pixels (P, N, 2), NaN where a point is
    behind the camera or outside what the lens model covers.
    """
    return np.stack(project_planes(points.T, rotations, positions, intrinsics), axis=-1)


def project_planes(points: Plane, rotations: Array, positions: Array, intrinsics: Lens) -> tuple[Plane, Plane]:
    """`project` for points (3, N), to columns and rows (P, N) apart, in the precision of the points."""
    return _turned_and_bent(points, rotation_matrices(rotations), positions, intrinsics)


def _turned_and_bent(points: Plane, matrices: Array, positions: Array, intrinsics: Lens) -> tuple[Plane, Plane]:
    """`project_planes` by rotation matrices (P, 3, 3)."""
    # R (X - C) as R X - R C: one product for the whole population.
    turned = matrices.astype(points.dtype) @ points
    x, y, z = np.moveaxis(turned - (matrices @ positions[..., None]).astype(points.dtype), 1, 0)
    return intrinsics.project_planes(x, y, z)


def inside(pixels: NDArray[np.floating[Any]], size: tuple[int, int], margin: float = 0.0) -> NDArray[np.bool_]:
    """True for pixels (..., 2) inside a picture of `size` (width, height), at least `margin` from its border."""
    x, y = pixels[..., 0], pixels[..., 1]
    return (x >= margin) & (y >= margin) & (x <= size[0] - 1 - margin) & (y <= size[1] - 1 - margin)
