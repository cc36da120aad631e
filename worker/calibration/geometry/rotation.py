"""Rotations: vectors (axis times angle, rad) and matrices, many at once."""

import numpy as np
from numpy.typing import ArrayLike

from worker.calibration.geometry.arrays import Array


def rotation_matrices(vectors: ArrayLike) -> Array:
    """Return matrices (..., 3, 3) of rotation vectors (..., 3), rad (Rodrigues)."""
    v = np.asarray(vectors, dtype=float)
    angle = _lengths(v)[..., None]
    cross = cross_matrices(v)
    # sin(a)/a and (1-cos(a))/a², both finite at a = 0; np.sinc(x) is sin(pi x)/(pi x).
    a = np.sinc(angle / np.pi)
    b = 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
    return np.eye(3) + a * cross + b * (cross @ cross)


def rotation_vectors(matrices: ArrayLike) -> Array:
    """Return rotation vectors (..., 3) of length 0..pi of matrices (..., 3, 3) (inverse Rodrigues).

    Goes through the unit quaternion of largest component, which stays exact near 0 and near pi.
    """
    m = np.asarray(matrices, dtype=float)
    trace = m[..., 0, 0] + m[..., 1, 1] + m[..., 2, 2]
    # Four times the outer product of the quaternion (w, x, y, z) with itself; its best-conditioned row is taken.
    q = np.empty((*m.shape[:-2], 4, 4))
    q[..., 0, 0] = 1 + trace
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        q[..., i + 1, i + 1] = 1 + 2 * m[..., i, i] - trace
        q[..., 0, i + 1] = q[..., i + 1, 0] = m[..., k, j] - m[..., j, k]
        q[..., j + 1, k + 1] = q[..., k + 1, j + 1] = m[..., k, j] + m[..., j, k]
    best = np.argmax(np.diagonal(q, axis1=-2, axis2=-1), axis=-1)
    row = np.take_along_axis(q, best[..., None, None], axis=-2)[..., 0, :]
    row = row / _lengths(row)
    row = np.where(row[..., :1] < 0, -row, row)
    sine = _lengths(row[..., 1:])
    half = np.arctan2(sine, row[..., :1])
    # half / sin(half) -> 1 for small angles.
    return 2 * row[..., 1:] * np.where(sine > 1e-12, half / np.maximum(sine, 1e-300), 1.0)


def cross_matrices(vectors: Array) -> Array:
    """Return matrices (..., 3, 3) of the cross product with vectors (..., 3)."""
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    cross = np.zeros((*vectors.shape, 3))
    cross[..., 0, 1], cross[..., 0, 2] = -z, y
    cross[..., 1, 0], cross[..., 1, 2] = z, -x
    cross[..., 2, 0], cross[..., 2, 1] = -y, x
    return cross


def rotation_angles_deg(a: ArrayLike, b: ArrayLike) -> Array:
    """Return the angle in degrees of the rotation between rotation vectors (..., 3) and (..., 3)."""
    relative = rotation_matrices(a) @ np.swapaxes(rotation_matrices(b), -1, -2)
    return np.degrees(np.linalg.norm(rotation_vectors(relative), axis=-1))


def _lengths(vectors: Array) -> Array:
    """Return lengths (..., 1) of vectors (..., n): `np.linalg.norm` without its checks, which cost more."""
    return np.sqrt(np.add.reduce(vectors * vectors, axis=-1, keepdims=True))
