"""A segmentation without training: streaks as wide as the expected lines, in their directions, where they can be.

The network knows lines better than this on the fields that it has learnt. On others, and in paint of any colour, this
sees what it does not, so that a search that came to nothing with the one may find the pose with the other.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.contrast import Channel, Channels
from worker.calibration.detection.streaks import DIRECTIONS, LEAST_CONTRAST, LEVELS, Streaks, level_of
from worker.calibration.geometry.visibility import VisibleLines


def ridge_response(channels: Channels, lines: VisibleLines, reach_px: float) -> NDArray[np.float32]:
    """Return a response (H, W) in 0..1: how much each pixel looks like one of `lines` at most `reach_px` away."""
    height, width = channels[Channel.GREEN].shape
    # Columns of the reduced picture in which streaks are looked for.
    working_px = 960
    size = (min(working_px, width), max(1, round(height * min(1.0, working_px / width))))
    scale = size[0] / width
    reduced = [
        cv2.resize(channels[channel], size, interpolation=cv2.INTER_AREA)
        for channel in (Channel.BLUE, Channel.GREEN, Channel.RED)
    ]
    streaks = Streaks.of(np.rint(np.dstack(reduced)).astype(np.uint8))
    level = level_of(lines.width_px * scale)
    direction = np.arctan2(lines.normal[:, 1], lines.normal[:, 0]) * DIRECTIONS / np.pi
    response = np.zeros(size[::-1], dtype=np.float32)
    for number in range(DIRECTIONS):
        apart = np.abs((direction - number + DIRECTIONS / 2) % DIRECTIONS - DIRECTIONS / 2)
        for which in range(LEVELS):
            # Largest angle between a streak and a line, in steps between two directions.
            expected = (level == which) & (apart <= 0.75)
            if expected.any():
                near = _within(lines.pixel[expected] * scale, reach_px * scale, size)
                likely = cv2.resize(_likelihood(streaks.strength[which][number], which), size)
                np.maximum(response, likely * near, out=response)
    return np.asarray(cv2.resize(response, (width, height)), dtype=np.float32)


def _likelihood(strength: NDArray[np.uint8], level: int) -> NDArray[np.float32]:
    """Return the likelihood (h, w), 0..1, that streaks of a level are lines, beside what is usual around them."""
    # A streak is compared with the mean of its surroundings: texture is full of streaks.
    side = 121 // 2**level | 1
    values = strength.astype(np.float32)
    # Twice the usual may be a line; four times is one for sure.
    usual = np.maximum(2.0 * cv2.blur(values, (side, side)), LEAST_CONTRAST)
    return np.asarray(np.clip(values / usual - 1, 0, 1), dtype=np.float32)


def _within(pixels: NDArray[np.float64], reach_px: float, size: tuple[int, int]) -> NDArray[np.float32]:
    """Return 1 (H, W) where any of the pixels (N, 2) is at most about `reach_px` away, 0 elsewhere."""
    # Side of the squares of the mask of where lines can be.
    mask_px = 8
    coarse = np.zeros((-(-size[1] // mask_px), -(-size[0] // mask_px)), dtype=np.uint8)
    column, row = np.clip((pixels / mask_px).astype(int).T, 0, [[coarse.shape[1] - 1], [coarse.shape[0] - 1]])
    coarse[row, column] = 1
    reach = max(1, round(reach_px / mask_px))
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1,) * 2)
    coarse = np.asarray(cv2.dilate(coarse, disc), dtype=np.uint8)
    near = np.repeat(np.repeat(coarse, mask_px, axis=0), mask_px, axis=1)[: size[1], : size[0]]
    return near.astype(np.float32)
