"""What a painted line looks like across itself, after a blur."""

from __future__ import annotations

from math import erf, pi, sqrt

import numpy as np

from worker.calibration.camera import Array

_AT = np.linspace(-4.0, 4.0, 4001)
_ERF = np.array([erf(x) for x in _AT])


def blurred_line(width_px: Array, sigma_px: float, offset_px: Array | float = 0.0) -> Array:
    """Brightness at `offset_px` from the centre of a line of height 1 and `width_px`, blurred by `sigma_px`.

    Arguments broadcast together.
    """
    spread = sqrt(2) * sigma_px
    ends = [(offset_px + side * width_px / 2) / spread for side in (1, -1)]
    # Between the places of the table the error function is off by less than a millionth.
    return 0.5 * (np.interp(ends[0], _AT, _ERF) - np.interp(ends[1], _AT, _ERF))


def blurred_line_slope(width_px: Array, sigma_px: float, offset_px: Array | float = 0.0) -> Array:
    """The derivative of `blurred_line` by the offset, per px."""
    spread = sqrt(2) * sigma_px
    edges = [np.exp(-(((offset_px + side * width_px / 2) / spread) ** 2)) for side in (1, -1)]
    return (edges[0] - edges[1]) / (sqrt(2 * pi) * sigma_px)
