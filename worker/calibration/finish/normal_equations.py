"""The sums of the least squares over poses, further numbers and the ground; the same whatever the number of threads."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from worker.calibration.finish.residuals import Residuals, Unknowns
from worker.calibration.scene.camera import Array

CLUSTER_POINTS = 40
"""Line points (25 cm apart) whose errors of paint, lens and measurement are taken as one."""

LEAST_NOISE = 0.2


@dataclass(frozen=True)
class NormalEquations:
    """`information` (U, U) on all unknowns and the `gradient` (U,) of half the weighted squares."""

    information: Array
    gradient: Array


def normal_equations(rows: Residuals, unknowns: Unknowns) -> NormalEquations:
    """Sums over the residuals. einsum and bincount rather than BLAS: the same to the last digit on any machine load."""
    dense, ground = unknowns.dense, unknowns.ground
    weighted = rows.jacobian * rows.weight[:, None]
    information = np.empty((len(unknowns), len(unknowns)))
    information[:dense, :dense] = np.einsum("mi,mj->ij", weighted, rows.jacobian)
    information[dense:, :dense] = -ground.gathered(rows.point, weighted * rows.rise[:, None])
    information[:dense, dense:] = information[dense:, :dense].T
    information[dense:, dense:] = ground.gathered_twice(rows.point, rows.weight * rows.rise**2)
    pull = rows.weight * rows.value
    on_ground = -ground.gathered(rows.point, (pull * rows.rise)[:, None])[:, 0]
    return NormalEquations(information, np.concatenate([np.einsum("mi,m->i", rows.jacobian, pull), on_ground]))


def error_of_measurement(rows: Residuals, unknowns: Unknowns) -> Array:
    """Covariance (U, U) of the gradient by the residuals themselves, those of ten metres of line taken as one.

    Neighbours on a line share the error of its paint and of the lens, so they are not as many as they seem (the
    sandwich of Liang and Zeger, 1986). On top, a fifth of what their expected errors say: no picture is perfect.
    """
    patches, patch = np.unique(rows.point // CLUSTER_POINTS, return_inverse=True)
    weighted = rows.jacobian * rows.weight[:, None]
    pull = np.zeros((len(patches), len(unknowns)))
    pull[:, : unknowns.dense] = _sum_by(patch, len(patches), weighted * rows.value[:, None])
    rises = -(rows.weight * rows.rise * rows.value)[:, None] * unknowns.ground.share[rows.point]
    np.add.at(pull, (patch[:, None], unknowns.dense + unknowns.ground.node[rows.point]), rises)
    expected = normal_equations(replace(rows, weight=rows.weight**2), unknowns).information
    return np.asarray(np.einsum("ci,cj->ij", pull, pull) + LEAST_NOISE * expected)


def _sum_by(group: NDArray[np.intp], groups: int, rows: Array) -> Array:
    """Sums (groups, C) of rows (M, C) by their group (M,)."""
    return np.stack([np.bincount(group, column, groups) for column in rows.T], axis=1)
