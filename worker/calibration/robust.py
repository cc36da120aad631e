"""Robust weights and losses of residuals."""

from collections.abc import Callable

import numpy as np

from worker.calibration.geometry.camera import Array

HUBER, TUKEY = 1.345, 4.685
"""Residuals, in standard deviations, at which the weights begin to fall: 95 % of the efficiency of least squares."""

USUAL = 1 / 1.4826
"""Median absolute value of normal errors, in standard deviations."""

SURE = 3.0
"""Standard deviations from which a difference is no chance."""

Weigh = Callable[[Array], Array]
"""Function from M residuals, in units of their expected errors, to their weights (M,)."""


def robust_scale(values: Array) -> float:
    """Return the standard deviation by the median absolute value, at least 1: expected errors are not doubted
    downwards."""
    return max(1.0, float(np.median(np.abs(values))) / USUAL) if len(values) else 1.0


def huber_weights(values: Array) -> Array:
    """Return Huber's weights (M,) at the scale of the values themselves: 1 near zero, falling as 1 / |value| beyond."""
    scale = robust_scale(values)
    return np.minimum(1.0, HUBER * scale / np.maximum(np.abs(values), 1e-12)) / scale**2


def tukey_weights(values: Array) -> Array:
    """Return Tukey's biweight (M,) at the scale of the values themselves: 1 at zero, 0 for what cannot be this line."""
    scale = robust_scale(values)
    return np.maximum(0.0, 1 - (values / (TUKEY * scale)) ** 2) ** 2 / scale**2


def tukey_derivatives(values: Array) -> Array:
    """Return the mean derivative (M,) of a residual's influence under Tukey's weights: each weight times the same
    factor.

    Below the weights: a residual that grows counts less. The derivative at a single residual can be negative, so all
    share the mean.
    """
    weights = tukey_weights(values)
    within = np.minimum((values / (TUKEY * robust_scale(values))) ** 2, 1.0)
    derivatives, all_of = (1 - within) * (1 - 5 * within), (1 - within) ** 2
    return weights * derivatives.sum() / all_of.sum() if len(values) else weights


def tukey_loss(values: Array, scale: float) -> Array:
    """Return the loss (M,) that steps with Tukey's weights at this scale minimise: (values / scale)² near zero,
    bounded beyond."""
    within = np.minimum(np.abs(values) / (TUKEY * scale), 1.0)
    return np.asarray(TUKEY**2 / 3 * (1 - (1 - within**2) ** 3))
