"""Genomes: poses as vectors that can be mutated and mixed, per camera a rotation vector and a position."""

from collections.abc import Sequence

import numpy as np

from worker.calibration.geometry.camera import Array, Camera, Pose
from worker.calibration.geometry.derivatives import POSE_NUMBERS


def genome_of(cameras: Sequence[Camera]) -> Array:
    """Return poses as one vector (6 N,): per camera rotation vector, position."""
    return np.concatenate([[*camera.pose.rotation, *camera.pose.position] for camera in cameras])


def with_genome(cameras: Sequence[Camera], genome: Array) -> list[Camera]:
    """Return the cameras at the poses of a genome (6 N,)."""
    poses = genome.reshape(-1, POSE_NUMBERS)
    return [camera.with_pose(Pose(pose[:3], pose[3:])) for camera, pose in zip(cameras, poses, strict=True)]
