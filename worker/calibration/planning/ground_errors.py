"""Errors of places on the ground by the expected errors of poses, lenses and field."""

import numpy as np

from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.derivatives import POSE_NUMBERS, full_pixel_jacobian
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.lens import LENS_PARAMETERS
from worker.calibration.geometry.parameters import FieldMeasure, FieldParameter, LensParameter
from worker.calibration.refinement.unknowns import Unknowns


def ground_error_jacobian(pitch: Field, camera: Camera, view: int, points: Array, unknowns: Unknowns) -> Array:
    """Jacobian (N, 2, D + 1) of where a camera puts points (N, 3) of the field, by all errors; metres.

    By the dense unknowns, and last by how much higher the ground is under each point than the field's surface. A place
    counts relative to the markings: a field that is longer than it is said to be moves both.
    """
    by_camera = full_pixel_jacobian(camera, points)
    by_point = -by_camera[..., 3:POSE_NUMBERS]
    in_picture = np.zeros((len(points), 2, unknowns.dense + 1))
    in_picture[..., unknowns.pose(view)] = by_camera[..., :POSE_NUMBERS]
    for at, parameter in unknowns.parameters_of(view):
        if isinstance(parameter, LensParameter):
            in_picture[..., at] = by_camera[..., POSE_NUMBERS + LENS_PARAMETERS.index(parameter.name)]
        else:
            shift = _shift(pitch, parameter, points)
            in_picture[..., at] = (by_point @ shift[..., None])[..., 0]
    in_picture[..., -1] = by_point[..., 2]
    return np.asarray(-np.linalg.inv(by_point[..., :2]) @ in_picture, dtype=float)


def _shift(pitch: Field, parameter: FieldParameter, points: Array) -> Array:
    """Return how points (N, 3) of the field move with a parameter of it, (N, 3), metres per metre."""
    if not isinstance(parameter, FieldMeasure):
        # The skew, see `FieldSkew`.
        return points[:, 1:2] / (pitch.width / 2) * [1.0, 0.0, 0.0]
    step_m = 1e-3
    ahead, behind = (
        _places(pitch, parameter.write(pitch, parameter.read(pitch) + step), points) for step in (step_m, -step_m)
    )
    return np.asarray((ahead - behind) / (2 * step_m), dtype=float)


def _places(pitch: Field, changed: Field, points: Array) -> Array:
    """Return the points (N, 3) of a changed field that correspond to those of the pitch."""
    return changed.lift(points[:, :2] * [changed.length / pitch.length, changed.width / pitch.width])


def sigmas(jacobian: Array, covariance: Array, uneven_m: float) -> Array:
    """Return one standard deviation (N,) of places (both directions together), m, by a jacobian (N, 2, D + 1).

    `covariance` (D, D) of the errors, `uneven_m` of the ground beside the surface.
    """
    by_errors, by_ground = jacobian[..., :-1], jacobian[..., -1]
    # A camera has some of the unknowns of all cameras.
    own = np.flatnonzero(by_errors.any(axis=(0, 1)))
    by_errors = by_errors[..., own]
    variance = np.sum((by_errors @ covariance[np.ix_(own, own)]) * by_errors, axis=(1, 2))
    return np.asarray(np.sqrt(variance + uneven_m**2 * np.sum(by_ground**2, axis=-1)), dtype=float)
