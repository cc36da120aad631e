"""Poses as vectors of numbers that can be mutated and mixed: per camera a rotation vector and a place."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from worker.calibration.geometry.camera import Array, Camera, Pose
from worker.calibration.geometry.rotation import rotation_matrices

GENES = 6
"""Numbers per camera."""


def genome_of(cameras: Sequence[Camera]) -> Array:
    """Poses as one vector (6 N,): per camera rotation vector, position."""
    return np.concatenate([[*camera.pose.rotation, *camera.pose.position] for camera in cameras])


def with_genome(cameras: Sequence[Camera], genome: Array) -> list[Camera]:
    """The cameras at the poses of a genome (6 N,)."""
    poses = genome.reshape(-1, GENES)
    return [camera.with_pose(Pose(pose[:3], pose[3:])) for camera, pose in zip(cameras, poses, strict=True)]


def looked_at(camera: Camera) -> Array:
    """Where the optical axis meets the ground z = 0, (3,); below the camera if it does not."""
    position, axis = camera.pose.position, camera.pose.matrix[2]
    if axis[2] >= 0:
        return np.array([*position[:2], 0.0])
    return np.asarray(position - position[2] / axis[2] * axis)


def swinging(genomes: Array, pivots: Array) -> Array:
    """Genomes (..., 6 N) with the camera's place told as that of a pivot in its frame: R (p - C) for `pivots` (N, 3).

    The `l` of the paper's K (R | l), with the origin on the ground that the camera looks at. A turn of such a genome
    swings the camera about the pivot: the two moves that a picture can hardly tell apart are one gene and not two.
    """
    poses = genomes.reshape(*genomes.shape[:-1], -1, GENES).copy()
    turned = rotation_matrices(poses[..., :3]) @ (pivots - poses[..., 3:])[..., None]
    poses[..., 3:] = turned[..., 0]
    return np.asarray(poses.reshape(genomes.shape))


def from_swinging(genomes: Array, pivots: Array) -> Array:
    """Back from `swinging`: rotation vectors and positions C = p - R^T l."""
    poses = genomes.reshape(*genomes.shape[:-1], -1, GENES).copy()
    turned = np.swapaxes(rotation_matrices(poses[..., :3]), -1, -2) @ poses[..., 3:, None]
    poses[..., 3:] = pivots - turned[..., 0]
    return np.asarray(poses.reshape(genomes.shape))
