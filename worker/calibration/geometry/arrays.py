"""The kinds of arrays that the engine hands around."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Plane = NDArray[np.floating[Any]]
"""One coordinate of many points, in the precision of the caller."""
