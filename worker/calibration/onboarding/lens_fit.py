"""Lens fit to boards in photos by OpenCV (Zhang's method), with the terms that are left free."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array
from worker.calibration.geometry.lens import Lens, LensModel
from worker.calibration.geometry.lens_models import LENSES
from worker.calibration.geometry.rotation import rotation_matrices
from worker.calibration.onboarding.boards import BoardDetection


@dataclass(frozen=True)
class Rung:
    """Lens model to try: OpenCV's flags, and the names of the parameters they leave free."""

    terms: tuple[str, ...]
    flags: int


_PINHOLE = cv2.CALIB_USE_INTRINSIC_GUESS
_ONE_F = _PINHOLE | cv2.CALIB_FIX_ASPECT_RATIO
_STRAIGHT = cv2.CALIB_ZERO_TANGENT_DIST
_K1 = cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3
_FISHEYE = cv2.CALIB_RECOMPUTE_EXTRINSIC | cv2.CALIB_FIX_SKEW | cv2.CALIB_USE_INTRINSIC_GUESS
LADDERS: Mapping[LensModel, Sequence[Rung]] = {
    "opencv": (
        Rung(("f", "k1"), _ONE_F | _STRAIGHT | _K1 | cv2.CALIB_FIX_PRINCIPAL_POINT),
        Rung(("f", "cx", "cy", "k1"), _ONE_F | _STRAIGHT | _K1),
        Rung(("f", "cx", "cy", "k1", "k2"), _ONE_F | _STRAIGHT | cv2.CALIB_FIX_K3),
        Rung(("f", "cx", "cy", "k1", "k2", "p1", "p2"), _ONE_F | cv2.CALIB_FIX_K3),
        Rung(("f", "cx", "cy", "k1", "k2", "p1", "p2", "k3"), _ONE_F),
        Rung(("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"), _PINHOLE),
        Rung(
            ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
            _PINHOLE | cv2.CALIB_RATIONAL_MODEL,
        ),
    ),
    "fisheye": (
        Rung(("fx", "fy", "cx", "cy", "k1"), _FISHEYE | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | cv2.CALIB_FIX_K4),
        Rung(("fx", "fy", "cx", "cy", "k1", "k2"), _FISHEYE | cv2.CALIB_FIX_K3 | cv2.CALIB_FIX_K4),
        Rung(("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"), _FISHEYE),
    ),
}
"""Lens models from the simplest to the richest. Sensors have square pixels; a picture stretched by a converter has
not."""
PARAMETERS: Mapping[LensModel, tuple[str, ...]] = {
    "opencv": ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
    "fisheye": ("fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"),
}


@dataclass(frozen=True)
class LensFit:
    """Result of OpenCV: the board's place in each photo, `sigma` (K,) in the order of `PARAMETERS`, rms `by_photo`."""

    lens: Lens
    turns: Sequence[Array]
    shifts: Sequence[Array]
    sigma: Array
    by_photo: Array


def fit_lens(detections: Sequence[BoardDetection], size: tuple[int, int], model: LensModel, rung: Rung) -> LensFit:
    """Fit the lens with the terms of a rung. Raises `cv2.error` where the photos cannot carry them."""
    world = [s.world.astype(np.float32) for s in detections]
    pixel = [s.pixel.astype(np.float32) for s in detections]
    return (_fit_fisheye if model == "fisheye" else _fit_pinhole)(world, pixel, size, rung)


def _fit_pinhole(
    world: list[NDArray[np.float32]], pixel: list[NDArray[np.float32]], size: tuple[int, int], rung: Rung
) -> LensFit:
    guess = _centred(float(max(size)), size)
    _, matrix, distortion, turns, shifts, sigma, _, by_photo = cv2.calibrateCameraExtended(
        world, pixel, size, guess, np.zeros(8 if rung.flags & cv2.CALIB_RATIONAL_MODEL else 5), flags=rung.flags
    )
    lens = LENSES["opencv"](_floats(matrix), _floats(distortion).ravel(), size)
    numbers = _floats(sigma).ravel()[: len(PARAMETERS["opencv"])]
    return LensFit(lens, _vectors(turns), _vectors(shifts), numbers, _floats(by_photo).ravel())


def _fit_fisheye(
    world: list[NDArray[np.float32]], pixel: list[NDArray[np.float32]], size: tuple[int, int], rung: Rung
) -> LensFit:
    # From a lens of 180 degrees across the longer side.
    guess = _centred(max(size) / np.pi, size)
    _, matrix, distortion, turns, shifts = cv2.fisheye.calibrate(
        [w[None] for w in world], [p[None] for p in pixel], size, guess, np.zeros((4, 1)), flags=rung.flags
    )
    lens = LENSES["fisheye"](_floats(matrix), _floats(distortion).ravel(), size)
    places = _vectors(turns), _vectors(shifts)
    off = [residuals_px(lens, *place) for place in zip(*places, map(_floats, world), map(_floats, pixel), strict=True)]
    by_photo = np.array([rms(np.linalg.norm(o, axis=1)) for o in off])
    sigma = _fisheye_sigma(lens, *places, [_floats(w) for w in world], rung, np.concatenate(off))
    return LensFit(lens, *places, sigma, by_photo)


def _centred(focal: float, size: tuple[int, int]) -> Array:
    return np.array([[focal, 0, (size[0] - 1) / 2], [0, focal, (size[1] - 1) / 2], [0, 0, 1]])


def _fisheye_sigma(
    lens: Lens, turns: Sequence[Array], shifts: Sequence[Array], world: Sequence[Array], rung: Rung, off: Array
) -> Array:
    """Return a fisheye's deviations, with the boards' places eliminated from the normal matrix (Schur)."""
    names = PARAMETERS["fisheye"]
    free = np.array([name in rung.terms for name in names])
    information = np.zeros((int(free.sum()), int(free.sum())))
    for turn, shift, corners in zip(turns, shifts, world, strict=True):
        _, found = cv2.fisheye.projectPoints(corners[None], turn, shift, lens.matrix, lens.distortion)
        # Its columns: fx fy cx cy k1 to k4, the turn, the shift, the skew.
        jacobian = _floats(found)
        a, b = jacobian[:, :8][:, free], jacobian[:, 8:14]
        information += a.T @ a - a.T @ b @ np.linalg.solve(b.T @ b, b.T @ a)
    spare = max(off.size - int(free.sum()) - 6 * len(world), 1)
    variance = np.diag(np.linalg.pinv(information, hermitian=True)) * np.sum(off**2) / spare
    sigma = np.zeros(len(names))
    sigma[free] = np.sqrt(np.maximum(variance, 0.0))
    return sigma


def predicted_rms_px(lens: Lens, detection: BoardDetection) -> float:
    """Return the rms of the corners of a photo by a lens that was not fitted to it; only the board's place is."""
    unforetold = float(max(lens.size))
    rays = lens.undistort(detection.pixel)
    known = np.isfinite(rays).all(axis=1)
    if known.sum() < 6:
        return unforetold
    found, turn, shift = cv2.solvePnP(detection.world[known], rays[known], np.eye(3), None)
    if not found:
        return unforetold
    off = residuals_px(lens, _floats(turn).ravel(), _floats(shift).ravel(), detection.world, detection.pixel)
    return rms(np.linalg.norm(np.nan_to_num(off, nan=unforetold), axis=1))


def residuals_px(lens: Lens, turn: Array, shift: Array, world: Array, pixel: Array) -> Array:
    """Return projected minus seen (N, 2) of a board at OpenCV's rvec and tvec."""
    points = world @ rotation_matrices(turn).T + shift
    return lens.distort(points[:, :2] / points[:, 2:]) - pixel


def _floats(values: Any) -> Array:
    """Return OpenCV's values as a NumPy array of floats."""
    return np.asarray(values, dtype=float)


def _vectors(columns: Any) -> list[Array]:
    return [_floats(column).ravel() for column in columns]


def parameter_values(lens: Lens) -> Array:
    """Return the parameters of a lens, in the order of `PARAMETERS`."""
    terms = lens.coefficients[: len(PARAMETERS[lens.model]) - 4]
    return np.array([lens.matrix[0, 0], lens.matrix[1, 1], lens.matrix[0, 2], lens.matrix[1, 2], *terms])


def rms(values: Array) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(np.square(values))))
