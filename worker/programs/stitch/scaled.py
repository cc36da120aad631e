"""Size to which a frame is scaled before a view is sampled from it, by tools that know no levels of detail."""

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.ground_view import level_of_detail
from worker.calibration.stitching.panorama import Contribution


def scaled_size(part: Contribution) -> tuple[int, int]:
    """Width and height, even: halved as often as most of the view's pixels of this camera call for."""
    counts = part.weight > 0
    level = int(np.median(level_of_detail(part.source)[counts])) if counts.any() else 0
    width, height = (max(4, side >> level & ~1) for side in part.frame_size)
    return width, height


def in_scaled(part: Contribution, size: tuple[int, int]) -> NDArray[np.float32]:
    """Return the place of each pixel of the view in the scaled frame (H, W, 2), pixel centres at integers."""
    scale = np.array(size, np.float32) / np.array(part.frame_size, np.float32)
    return np.asarray((part.source + 0.5) * scale - 0.5, np.float32)
