"""Derivatives of a camera's projection by small changes of its pose and lens.

A change (6,) of a pose is a turn (rad, a rotation vector in the camera's own frame) and a shift (m, in the world). So a
turn turns the view about the camera, and a shift means the same for all cameras.
"""

import numpy as np

from worker.calibration.geometry.camera import Array, Camera, Pose
from worker.calibration.geometry.rotation import cross_matrices, rotation_matrices, rotation_vectors

POSE_NUMBERS = 6


def moved(camera: Camera, change: Array) -> Camera:
    """Return the camera after a change (6,) of its pose."""
    turned = rotation_vectors(rotation_matrices(change[:3]) @ camera.pose.matrix)
    return camera.with_pose(Pose(turned, camera.pose.position + change[3:]))


def change_between(before: Camera, after: Camera) -> Array:
    """Return the change (6,) with which `moved` turns `before` into `after`."""
    turn = rotation_vectors(after.pose.matrix @ before.pose.matrix.T)
    return np.concatenate([turn, after.pose.position - before.pose.position])


def pixel_jacobian(camera: Camera, points: Array) -> Array:
    """Jacobian (..., 2, 6) of the pixels of world points (..., 3) by the pose, px per rad and metre.

    NaN where `Camera.project` is.
    """
    seen = _in_camera(camera, points)
    by_point = camera.intrinsics.point_jacobian(seen)
    # A turn w moves a point p by w x p, and b . (w x p) is w . (p x b); a shift of the camera moves it the other way.
    return np.concatenate([np.cross(seen[..., None, :], by_point), -by_point @ camera.pose.matrix], axis=-1)


def lens_jacobian(camera: Camera, points: Array) -> Array:
    """Jacobian (..., 2, 6) of the pixels of world points (..., 3) by `LENS_PARAMETERS`, px per unit of each.

    NaN where `Camera.project` is.
    """
    return camera.intrinsics.parameter_jacobian(_in_camera(camera, points))


def full_pixel_jacobian(camera: Camera, points: Array) -> Array:
    """Jacobian (..., 2, 12) of the pixels by pose and lens, px per rad, metre and unit of `LENS_PARAMETERS`."""
    return np.concatenate([pixel_jacobian(camera, points), lens_jacobian(camera, points)], axis=-1)


def ground_jacobian(camera: Camera, points: Array) -> Array:
    """Jacobian (..., 2, 6) of ground positions, m per rad and metre of error in the pose.

    The camera sees points (..., 3) at given pixels and back-projects those onto the level ground through each point.
    """
    ray = points - camera.pose.position
    carried = -camera.pose.matrix.T @ _point_jacobian(camera, _in_camera(camera, points))
    # The changed ray, back to where it meets the ground.
    return np.asarray(carried[..., :2, :] - ray[..., :2, None] * carried[..., 2:, :] / ray[..., 2, None, None])


def full_ground_jacobian(camera: Camera, points: Array) -> Array:
    """Jacobian (..., 2, 12) of ground positions by pose and lens, per rad, m and `LENS_PARAMETERS`."""
    by_all = full_pixel_jacobian(camera, points)
    # A camera that is shifted along the ground puts all of it there.
    by_ground = by_all[..., 3:5]
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.linalg.inv(by_ground) @ by_all)


def _in_camera(camera: Camera, points: Array) -> Array:
    """Return world points (..., 3) in the camera's frame."""
    return (points - camera.pose.position) @ camera.pose.matrix.T


def _point_jacobian(camera: Camera, seen: Array) -> Array:
    """Jacobian (..., 3, 6) of points (..., 3) in the camera's frame by its pose: turn w as w x p, and shift."""
    shift = np.broadcast_to(-camera.pose.matrix, (*seen.shape, 3))
    return np.concatenate([-cross_matrices(seen), shift], axis=-1)
