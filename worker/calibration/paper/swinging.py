"""Genomes of cameras that swing about the ground that they look at: the `l` of the paper's K (R | l)."""

import numpy as np

from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.derivatives import POSE_NUMBERS
from worker.calibration.geometry.rotation import rotation_matrices


def looked_at(camera: Camera) -> Array:
    """Return the point (3,) where the optical axis meets the ground z = 0; below the camera if it does not."""
    position, axis = camera.pose.position, camera.pose.matrix[2]
    if axis[2] >= 0:
        return np.array([*position[:2], 0.0])
    return np.asarray(position - position[2] / axis[2] * axis)


def swinging(genomes: Array, pivots: Array) -> Array:
    """Return genomes (..., 6 N) with the camera's place as that of a pivot in its frame: R (p - C) for `pivots` (N, 3).

    The `l` of the paper's K (R | l), with the origin on the ground that the camera looks at. A turn of such a genome
    swings the camera about the pivot: the two moves that a picture can hardly tell apart are one gene and not two.
    """
    poses = genomes.reshape(*genomes.shape[:-1], -1, POSE_NUMBERS).copy()
    turned = rotation_matrices(poses[..., :3]) @ (pivots - poses[..., 3:])[..., None]
    poses[..., 3:] = turned[..., 0]
    return np.asarray(poses.reshape(genomes.shape))


def from_swinging(genomes: Array, pivots: Array) -> Array:
    """Return genomes back from `swinging`: rotation vectors and positions C = p - R^T l."""
    poses = genomes.reshape(*genomes.shape[:-1], -1, POSE_NUMBERS).copy()
    turned = np.swapaxes(rotation_matrices(poses[..., :3]), -1, -2) @ poses[..., 3:, None]
    poses[..., 3:] = pivots - turned[..., 0]
    return np.asarray(poses.reshape(genomes.shape))
