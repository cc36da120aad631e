"""A small change of a camera's pose or lens, and what moves by it: the derivatives of a camera, all of one kind.

A change (6,) of a pose is a turn (rad, a rotation vector in the camera's own frame) and a shift (m, in the world). So a
turn turns the view about the camera, and a shift means the same for all cameras.
"""

from __future__ import annotations

import numpy as np

from worker.calibration.geometry.camera import NEAREST_DEPTH_M, Array, Camera, Pose
from worker.calibration.geometry.rotation import cross_matrices, rotation_matrices, rotation_vectors

POSE_NUMBERS = 6


def moved(camera: Camera, change: Array) -> Camera:
    """The camera after a change (6,) of its pose."""
    turned = rotation_vectors(rotation_matrices(change[:3]) @ camera.pose.matrix)
    return camera.with_pose(Pose(turned, camera.pose.position + change[3:]))


def change_between(before: Camera, after: Camera) -> Array:
    """The change (6,) that `moved` makes `after` of `before` with."""
    turn = rotation_vectors(after.pose.matrix @ before.pose.matrix.T)
    return np.concatenate([turn, after.pose.position - before.pose.position])


def pixel_slopes(camera: Camera, points: Array) -> Array:
    """How the pixels of world points (..., 3) move when their camera does: (..., 2, 6), per rad and metre.

    NaN where `Camera.project` is.
    """
    seen = _in_camera(camera, points)
    rays = _rays(seen)
    by_ray = camera.intrinsics.slopes(rays)
    by_point = np.concatenate([by_ray, -(by_ray @ rays[..., None])], axis=-1) / seen[..., 2:, None]
    # A turn w moves a point p by w x p, and b . (w x p) is w . (p x b); a shift of the camera moves it the other way.
    return np.concatenate([np.cross(seen[..., None, :], by_point), -by_point @ camera.pose.matrix], axis=-1)


def lens_slopes(camera: Camera, points: Array) -> Array:
    """How the pixels of world points (..., 3) move when a number of the lens does: (..., 2, 6), px per unit of each.

    The numbers are `LENS_NUMBERS`. NaN where `Camera.project` is.
    """
    return camera.intrinsics.slopes_by_numbers(_rays(_in_camera(camera, points)))


def pixel_slopes_of_all(camera: Camera, points: Array) -> Array:
    """How they move by pose and lens: (..., 2, 12), per rad, metre and unit of `LENS_NUMBERS`."""
    return np.concatenate([pixel_slopes(camera, points), lens_slopes(camera, points)], axis=-1)


def ground_slopes(camera: Camera, points: Array) -> Array:
    """How far (..., 2) off the camera puts points (..., 3) that it sees on the ground when its pose is a little wrong.

    (..., 2, 6), per rad and metre of what its pose is too much: along the level ground through each point.
    """
    ray = points - camera.pose.position
    carried = -camera.pose.matrix.T @ _point_slopes(camera, _in_camera(camera, points))
    # The changed ray, back to where it meets the ground.
    return np.asarray(carried[..., :2, :] - ray[..., :2, None] * carried[..., 2:, :] / ray[..., 2, None, None])


def ground_slopes_of_all(camera: Camera, points: Array) -> Array:
    """The same for pose and lens: (..., 2, 12), per rad, metre and unit of `LENS_NUMBERS`."""
    by_all = pixel_slopes_of_all(camera, points)
    # A camera that is shifted along the ground puts all of it there.
    by_ground = by_all[..., 3:5]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.linalg.inv(by_ground) @ by_all)


def _in_camera(camera: Camera, points: Array) -> Array:
    """World points (..., 3) in the camera's frame."""
    return (points - camera.pose.position) @ camera.pose.matrix.T


def _rays(seen: Array) -> Array:
    """Undistorted image coordinates (..., 2) at depth 1 of points (..., 3) in the camera's frame; NaN behind it."""
    depth = seen[..., 2:]
    return seen[..., :2] / np.where(depth > NEAREST_DEPTH_M, depth, np.nan)


def _point_slopes(camera: Camera, seen: Array) -> Array:
    """How points (..., 3) in the camera's frame move in it, (..., 3, 6): a turn w by w x p, a shift by its opposite."""
    shift = np.broadcast_to(-camera.pose.matrix, (*seen.shape, 3))
    return np.concatenate([-cross_matrices(seen), shift], axis=-1)
