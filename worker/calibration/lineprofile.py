"""What a painted line looks like across itself, after a blur."""

from __future__ import annotations

from math import erf, sqrt

import numpy as np

from worker.calibration.camera import Array

_erf = np.vectorize(erf, otypes=[float])


def blurred_line(width_px: Array, sigma_px: float, offset_px: Array | float = 0.0) -> Array:
    """Brightness at `offset_px` from the centre of a line of height 1 and `width_px`, blurred by `sigma_px`.

    Arguments broadcast together.
    """
    spread = sqrt(2) * sigma_px
    return 0.5 * (_erf((offset_px + width_px / 2) / spread) - _erf((offset_px - width_px / 2) / spread))
