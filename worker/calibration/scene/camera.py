"""Cameras: OpenCV's two lens models, poses, and the projection of many points by many poses at once.

World: right-handed, metres, z up. Camera: OpenCV (x right, y down, z forward; pixel centres at integers).
A pose is the rotation vector world to camera and the camera's centre in the world, so that a change of rotation turns
the view and does not swing the camera around the pitch: P = K R [I | -C].
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from worker.calibration.scene.arrays import Array as Array  # Whoever takes a camera takes arrays.
from worker.calibration.scene.arrays import Plane as Plane
from worker.calibration.scene.ignored import Ignored
from worker.calibration.scene.rotation import rotation_matrices, rotation_vectors

Frame = NDArray[np.uint8]
"""A picture as a camera took it: (height, width, 3), blue, green, red."""

LensModel = Literal["opencv", "fisheye"]
DISTORTION_LENGTHS = (0, 4, 5, 8, 12, 14)
FISHEYE_DISTORTION_LENGTHS = (0, 4)
WIDEST_FISHEYE_RAD = np.radians(89.0)
"""How far off its axis a fisheye is used: beyond a right angle there are no image coordinates at depth 1."""
IN_PIXELS = ("fx", "fy", "cx", "cy")
NEAREST_DEPTH_M = 0.1
RAY_STEP = 1e-6


@dataclass(frozen=True)
class Pose:
    """Where a camera stands and looks: `rotation` (3,) rad, world to camera; `position` (3,) m in the world."""

    rotation: Array
    position: Array

    @classmethod
    def from_translation(cls, rotation: ArrayLike, translation: ArrayLike) -> Pose:
        """From OpenCV's rvec and tvec (tvec = -R position)."""
        rvec = np.asarray(rotation, dtype=float)
        return cls(rvec, -rotation_matrices(rvec).T @ np.asarray(translation, dtype=float))

    @classmethod
    def looking_at(cls, position: ArrayLike, target: ArrayLike, roll_deg: float = 0.0) -> Pose:
        """A camera at `position` that sees `target` in its principal point, horizon level but for `roll_deg`."""
        centre = np.asarray(position, dtype=float)
        forward = np.asarray(target, dtype=float) - centre
        forward = forward / np.linalg.norm(forward)
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right = right / np.linalg.norm(right)
        upright = np.stack([right, np.cross(forward, right), forward])
        roll = rotation_matrices(np.array([0.0, 0.0, np.radians(roll_deg)]))
        return cls(rotation_vectors(roll @ upright), centre)

    @property
    def matrix(self) -> Array:
        """Rotation matrix (3, 3), world to camera."""
        return rotation_matrices(self.rotation)

    @property
    def translation(self) -> Array:
        """OpenCV's tvec (3,), metres."""
        return -self.matrix @ self.position


@dataclass(frozen=True)
class Intrinsics:
    """A lens of OpenCV's calib3d: pinhole with radial, tangential, thin prism and tilt terms.

    `matrix` (3, 3) in pixels, `distortion` in OpenCV's order (`DISTORTION_LENGTHS`), `size` (width, height); `sigma`:
    one standard deviation of its numbers by name (fx, fy, cx, cy in pixels, aspect = fy/fx, k1 ...), of those of which
    it is known.
    """

    matrix: Array
    distortion: Array
    size: tuple[int, int]
    sigma: Mapping[str, float] = field(default_factory=dict)
    model: ClassVar[LensModel] = "opencv"

    @property
    def focal_length_px(self) -> float:
        """The horizontal one."""
        return float(self.matrix[0, 0])

    @property
    def relative_size(self) -> float:
        """The longer side of the picture relative to a 4K frame's: what is given in 4K pixels scales by it."""
        return max(self.size) / 3840

    @cached_property
    def coefficients(self) -> Array:
        """The 14 coefficients k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 tau_x tau_y, absent ones zero."""
        padded = np.zeros(14)
        padded[: len(self.distortion)] = self.distortion
        return padded

    @cached_property
    def tilt(self) -> Array:
        """Homography (3, 3) of a tilted sensor (tau_x, tau_y), identity without tilt; as in OpenCV's documentation."""
        tau_x, tau_y = self.coefficients[12:]
        if tau_x == 0 and tau_y == 0:
            return np.eye(3)
        cx, sx, cy, sy = np.cos(tau_x), np.sin(tau_x), np.cos(tau_y), np.sin(tau_y)
        rot = np.array([[cy, 0, -sy], [0, 1, 0], [sy, 0, cy]]) @ np.array([[1, 0, 0], [0, cx, sx], [0, -sx, cx]])
        return np.array([[rot[2, 2], 0, -rot[0, 2]], [0, rot[2, 2], -rot[1, 2]], [0, 0, 1]]) @ rot

    @cached_property
    def largest_radius(self) -> float:
        """Undistorted radius (at depth 1) up to which the radial model grows.

        Beyond it the polynomial folds back and would put points from far outside the view into the picture.
        """
        k1, k2, _, _, k3, k4, k5, k6 = self.coefficients[:8]
        radii = np.linspace(0.0, 20.0, 20001)
        r2 = radii**2
        denominator = 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
        radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / np.where(denominator > 0, denominator, np.nan)
        growing = np.diff(radii * radial) > 0
        return float(radii[-1] if growing.all() else radii[np.argmin(growing)])

    def distort(self, rays: Array) -> Array:
        """Undistorted image coordinates at depth 1, (..., 2), to pixels (..., 2); NaN beyond `largest_radius`."""
        return np.stack(self.distort_planes(rays[..., 0], rays[..., 1]), axis=-1)

    def distort_planes(self, x: Plane, y: Plane) -> tuple[Plane, Plane]:
        """`distort` for columns and rows (...) apart, in their own precision: what large populations take."""
        k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, tau_x, tau_y = self.coefficients.tolist()
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        if k4 or k5 or k6:
            radial = radial / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
        xd = x * radial
        yd = y * radial
        if p1 or p2 or s1 or s2 or s3 or s4:
            xd = xd + 2 * p1 * x * y + p2 * (r2 + 2 * x * x) + r2 * (s1 + s2 * r2)
            yd = yd + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y + r2 * (s3 + s4 * r2)
        if tau_x or tau_y:
            (a, b, c), (d, e, f), (g, h, i) = self.tilt.tolist()
            depth = g * xd + h * yd + i
            xd, yd = (a * xd + b * yd + c) / depth, (d * xd + e * yd + f) / depth
        (fx, skew, cx), (_, fy, cy) = self.matrix[:2].tolist()
        column, row = fx * xd + skew * yd + cx, fy * yd + cy
        beyond = r2 > self.largest_radius**2
        return np.where(beyond, np.nan, column), np.where(beyond, np.nan, row)

    def slopes(self, rays: Array) -> Array:
        """How the pixels of rays (..., 2) move with them, (..., 2, 2); NaN beyond `largest_radius`."""
        steps = RAY_STEP * np.eye(2)
        return np.stack([(self.distort(rays + s) - self.distort(rays - s)) / (2 * RAY_STEP) for s in steps], axis=-1)

    def undistort(self, pixels: ArrayLike, iterations: int = 20) -> Array:
        """Pixels (..., 2) to undistorted image coordinates at depth 1 (..., 2), by Newton's method from a table.

        NaN where no ray of the model ends at the pixel.
        """
        target = np.asarray(pixels, dtype=float)
        linear = self.matrix[:2, :2]
        rays = (target - self.matrix[:2, 2]) @ np.linalg.inv(linear).T
        rays = self._within_model(rays * self._undistorted_scale(np.linalg.norm(rays, axis=-1))[..., None])
        step = 1e-6
        for _ in range(iterations):
            here = self.distort(rays)
            jacobian = np.stack(
                [
                    (self.distort(rays + [step, 0.0]) - here) / step,
                    (self.distort(rays + [0.0, step]) - here) / step,
                ],
                axis=-1,
            )
            determinant = jacobian[..., 0, 0] * jacobian[..., 1, 1] - jacobian[..., 0, 1] * jacobian[..., 1, 0]
            miss = target - here
            move = np.stack(
                [
                    jacobian[..., 1, 1] * miss[..., 0] - jacobian[..., 0, 1] * miss[..., 1],
                    jacobian[..., 0, 0] * miss[..., 1] - jacobian[..., 1, 0] * miss[..., 0],
                ],
                axis=-1,
            )
            with np.errstate(divide="ignore", invalid="ignore"):
                move = move / determinant[..., None]
            rays = self._within_model(rays + move)
            if np.nanmax(np.abs(move), initial=0.0) < 1e-12:
                break
        with np.errstate(invalid="ignore"):
            off = ~(np.linalg.norm(self.distort(rays) - target, axis=-1) < 1e-3)
        rays[off] = np.nan
        return rays

    def _within_model(self, rays: Array) -> Array:
        """Rays (..., 2) pulled back to where the radial model still grows: Newton must not jump over its end."""
        radius = np.linalg.norm(rays, axis=-1, keepdims=True)
        limit = 0.9999 * self.largest_radius
        return np.where(radius > limit, rays * (limit / np.maximum(radius, limit)), rays)

    def _undistorted_scale(self, distorted_radius: Array) -> Array:
        """Ratio of undistorted to distorted radius by the radial terms alone: a start for Newton."""
        k1, k2, _, _, k3, k4, k5, k6 = self.coefficients[:8]
        radii = np.linspace(1e-6, min(self.largest_radius, 20.0), 4000)
        r2 = radii**2
        distorted = radii * (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
        return np.interp(distorted_radius, distorted, radii) / np.maximum(distorted_radius, 1e-6)

    def scaled(self, factor: float) -> Intrinsics:
        """The same lens on a picture resized by `factor`, pixel centres at integers before and after."""
        width, height = round(self.size[0] * factor), round(self.size[1] * factor)
        matrix = self.matrix.copy()
        for axis, ratio in ((0, width / self.size[0]), (1, height / self.size[1])):
            matrix[axis] *= ratio
            matrix[axis, 2] = (self.matrix[axis, 2] + 0.5) * ratio - 0.5
        sigma = {name: value * (factor if name in IN_PIXELS else 1.0) for name, value in self.sigma.items()}
        return replace(self, matrix=matrix, size=(width, height), sigma=sigma)


class Fisheye(Intrinsics):
    """A lens of OpenCV's fisheye module: Kannala and Brandt, "A generic camera model", PAMI 2006, with four terms.

    A ray at the angle t off the axis ends at the distance t (1 + k1 t² + k2 t⁴ + k3 t⁶ + k4 t⁸) from the centre, for
    `matrix` = 1. `distortion` (`FISHEYE_DISTORTION_LENGTHS`) are k1 to k4.
    """

    model: ClassVar[LensModel] = "fisheye"

    @cached_property
    def coefficients(self) -> Array:
        """The 4 coefficients k1 k2 k3 k4, absent ones zero."""
        padded = np.zeros(4)
        padded[: len(self.distortion)] = self.distortion
        return padded

    @cached_property
    def _largest_angle(self) -> float:
        """Up to which angle (rad) the model grows; `WIDEST_FISHEYE_RAD` at most."""
        angles = np.linspace(0.0, WIDEST_FISHEYE_RAD, 8901)
        growing = np.diff(self._distorted_angle(angles)) > 0
        return float(angles[-1] if growing.all() else angles[np.argmin(growing)])

    @cached_property
    def largest_radius(self) -> float:
        """Undistorted radius (at depth 1) up to which the model grows."""
        return float(np.tan(self._largest_angle))

    def _distorted_angle(self, angle: Plane) -> Plane:
        k1, k2, k3, k4 = self.coefficients.tolist()
        t2 = angle * angle
        return angle * (1 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))))

    def distort_planes(self, x: Plane, y: Plane) -> tuple[Plane, Plane]:
        """`distort` for columns and rows (...) apart, in their own precision."""
        radius = np.sqrt(x * x + y * y)
        # On the axis the ratio of the two radii is 1, and this far off it still is.
        scale = np.where(radius > 1e-6, self._distorted_angle(np.arctan(radius)) / np.maximum(radius, 1e-6), 1)
        scale = np.where(radius > self.largest_radius, np.nan, scale).astype(radius.dtype, copy=False)
        (fx, skew, cx), (_, fy, cy) = self.matrix[:2].tolist()
        return fx * x * scale + skew * y * scale + cx, fy * y * scale + cy

    def undistort(self, pixels: ArrayLike, iterations: int = 6) -> Array:
        """Pixels (..., 2) to undistorted image coordinates at depth 1 (..., 2), by Newton's method from a table.

        NaN where no ray of the model ends at the pixel.
        """
        linear = self.matrix[:2, :2]
        rays = (np.asarray(pixels, dtype=float) - self.matrix[:2, 2]) @ np.linalg.inv(linear).T
        distorted = np.linalg.norm(rays, axis=-1)
        table = np.linspace(0.0, self._largest_angle, 4000)
        angle = np.interp(distorted, self._distorted_angle(table), table)
        k1, k2, k3, k4 = self.coefficients.tolist()
        for _ in range(iterations):
            t2 = angle * angle
            slope = 1 + t2 * (3 * k1 + t2 * (5 * k2 + t2 * (7 * k3 + t2 * 9 * k4)))
            # At its very end the model may stand still.
            step = (distorted - self._distorted_angle(angle)) / np.maximum(slope, 1e-6)
            angle = np.clip(angle + step, 0.0, self._largest_angle)
        known = np.abs(distorted - self._distorted_angle(angle)) * linear[0, 0] < 1e-3
        scale = np.where(distorted > 1e-9, np.tan(angle) / np.maximum(distorted, 1e-9), 1.0)
        return np.where(known, scale, np.nan)[..., None] * rays


LENSES: Mapping[LensModel, type[Intrinsics]] = {"opencv": Intrinsics, "fisheye": Fisheye}


@dataclass(frozen=True)
class Camera:
    """One camera of an installation: its lens and its pose, and what of its picture is `ignored`."""

    id: str
    intrinsics: Intrinsics
    pose: Pose
    ignored: Ignored | None = None

    def project(self, points: Array) -> Array:
        """World points (..., 3) to pixels (..., 2); NaN behind the camera and outside what the lens model covers."""
        in_a_row = points.reshape(-1, 3)
        pixels = project(in_a_row, self.pose.rotation[None], self.pose.position[None], self.intrinsics)[0]
        return pixels.reshape(*points.shape[:-1], 2)

    def rays(self, pixels: ArrayLike) -> Array:
        """Directions in the world (..., 3), not normalised (depth 1), through pixels (..., 2)."""
        plane = self.intrinsics.undistort(pixels)
        return np.concatenate([plane, np.ones_like(plane[..., :1])], axis=-1) @ self.pose.matrix

    def with_pose(self, pose: Pose) -> Camera:
        """The same lens elsewhere."""
        return Camera(self.id, self.intrinsics, pose, self.ignored)

    def with_lens(self, intrinsics: Intrinsics) -> Camera:
        """Another lens in the same place."""
        return Camera(self.id, intrinsics, self.pose, self.ignored)

    def sees(self, pixels: Array) -> NDArray[np.bool_]:
        """Which pixels (..., 2) lie in the picture where it is of use."""
        within = inside(pixels, self.intrinsics.size)
        return within if self.ignored is None else within & ~self.ignored.at(pixels, self.intrinsics.size)


def project(points: Array, rotations: Array, positions: Array, intrinsics: Intrinsics) -> Array:
    """Project N points by each of P poses in one array operation.

    points (N, 3) metres; rotations (P, 3) rad; positions (P, 3) metres. Returns pixels (P, N, 2), NaN where a point is
    behind the camera or outside what the lens model covers.
    """
    return np.stack(project_planes(points.T, rotations, positions, intrinsics), axis=-1)


def project_planes(points: Plane, rotations: Array, positions: Array, intrinsics: Intrinsics) -> tuple[Plane, Plane]:
    """`project` for points (3, N), to columns and rows (P, N) apart, in the precision of the points."""
    matrices = rotation_matrices(rotations)
    # R (X - C) as R X - R C: one product for the whole population.
    turned = matrices.astype(points.dtype) @ points
    x, y, depth = np.moveaxis(turned - (matrices @ positions[..., None]).astype(points.dtype), 1, 0)
    depth = np.where(depth > NEAREST_DEPTH_M, depth, np.nan)
    return intrinsics.distort_planes(x / depth, y / depth)


def inside(pixels: NDArray[np.floating[Any]], size: tuple[int, int], margin: float = 0.0) -> NDArray[np.bool_]:
    """Which pixels (..., 2) lie in a picture of `size` (width, height), at least `margin` from its border."""
    x, y = pixels[..., 0], pixels[..., 1]
    return (x >= margin) & (y >= margin) & (x <= size[0] - 1 - margin) & (y <= size[1] - 1 - margin)
