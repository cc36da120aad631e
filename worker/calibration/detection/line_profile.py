"""Brightness profile across a painted line, after a blur."""

from math import erf, pi, sqrt

import numpy as np

from worker.calibration.geometry.camera import Array

_FARTHEST, _STEPS = 4.0, 500
_ERF = np.array([erf(step / _STEPS) for step in range(round(-_FARTHEST * _STEPS), round(_FARTHEST * _STEPS) + 2)])
_RISE = np.diff(_ERF)


def blurred_line(width_px: Array, sigma_px: float, offset_px: Array | float = 0.0) -> Array:
    """Return the brightness at `offset_px` from the centre of a line of height 1 and `width_px`, blurred by `sigma_px`.

    Arguments broadcast together.
    """
    return blurred_step(offset_px + width_px / 2, sigma_px) - blurred_step(offset_px - width_px / 2, sigma_px)


def blurred_step(offset_px: Array, sigma_px: float) -> Array:
    """Return the brightness at `offset_px` from a step of height 1, blurred by `sigma_px`."""
    # Between the places of the table the error function is off by less than a millionth.
    place = (np.clip(offset_px / (sqrt(2) * sigma_px), -_FARTHEST, _FARTHEST) + _FARTHEST) * _STEPS
    before = place.astype(np.intp)
    return np.asarray(0.5 + 0.5 * (_ERF[before] + (place - before) * _RISE[before]))


def blurred_point(offset_px: Array, sigma_px: float) -> Array:
    """Return the derivative of `blurred_step`, per px."""
    return np.asarray(np.exp(-0.5 * (offset_px / sigma_px) ** 2) / (sqrt(2 * pi) * sigma_px))


def without_nan(values: Array, instead: float = 0.0) -> Array:
    """Return values (...) with `instead` in place of NaN, which stands for places outside the picture."""
    return np.where(np.isnan(values), instead, values)
