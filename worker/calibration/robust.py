"""How much a residual is believed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from worker.calibration.geometry.camera import Array

HUBER, TUKEY = 1.345, 4.685
"""Residuals, in standard deviations, where each begins to doubt: 95 % of the efficiency of least squares."""

USUAL = 1 / 1.4826
"""Half of normal errors are smaller than so many standard deviations."""

Weigh = Callable[[Array], Array]
"""How much each of M residuals, in units of its expected error, is believed."""


def robust_scale(values: Array) -> float:
    """Standard deviation by the median absolute value, at least 1: expected errors are not doubted downwards."""
    return max(1.0, float(np.median(np.abs(values))) / USUAL) if len(values) else 1.0


def huber_weights(values: Array) -> Array:
    """Huber's weights (M,) at the scale of the values themselves: 1 near zero, falling as 1 / |value| beyond."""
    scale = robust_scale(values)
    return np.minimum(1.0, HUBER * scale / np.maximum(np.abs(values), 1e-12)) / scale**2


def tukey_weights(values: Array) -> Array:
    """Tukey's biweight (M,) at the scale of the values themselves: 1 at zero, 0 for what cannot be this line."""
    scale = robust_scale(values)
    return np.maximum(0.0, 1 - (values / (TUKEY * scale)) ** 2) ** 2 / scale**2


def tukey_slopes(values: Array) -> Array:
    """How much more a residual pulls for being larger (M,), where Tukey's weights are how much it pulls for its size.

    Less than those: a residual that grows is believed less. Of single ones it is below zero, so each has its weight
    times what is true of all of them.
    """
    weights = tukey_weights(values)
    within = np.minimum((values / (TUKEY * robust_scale(values))) ** 2, 1.0)
    slopes, all_of = (1 - within) * (1 - 5 * within), (1 - within) ** 2
    return weights * slopes.sum() / all_of.sum() if len(values) else weights


def tukey_loss(values: Array, scale: float) -> Array:
    """What steps with Tukey's weights at this scale make small (M,): (values / scale)² near zero, bounded beyond."""
    within = np.minimum(np.abs(values) / (TUKEY * scale), 1.0)
    return np.asarray(TUKEY**2 / 3 * (1 - (1 - within**2) ** 3))
