"""Blur of a lens, measured at edges in the frame itself."""

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Frame

FEWEST_EDGES = 12
REACH = 14
"""Steps of a profile to either side of an edge."""


def edge_blur_px(frame: Frame, small: NDArray[np.uint8], where: NDArray[np.bool_]) -> float | None:
    """Return the standard deviation, in pixels of `frame`, of the blur of its sharper edges; None with too few.

    `small` (h, w): the grey picture, reduced by area to about 960 columns; `where` (h, w): the part of it that counts.
    """
    pixel, direction = _steep_places(small, where)
    if len(pixel) < FEWEST_EDGES:
        return None
    scale = frame.shape[1] / small.shape[1]
    widths = []
    # A profile that is right for a sharp edge is too short for a smeared one, and the other way round.
    for step in (scale / 4, scale, 3 * scale):
        width, height, inner = _edges(_profiles(frame, (pixel + 0.5) * scale - 0.5, direction, step))
        # Least height of an edge, of 255: fainter ones drown in noise and texture.
        good = (height >= 14.0) & inner
        widths.append(np.where(good, width * step, np.nan))
    known = np.stack(widths)
    first = np.take_along_axis(known, np.argmax(np.isfinite(known), axis=0)[None], axis=0)[0]
    first = first[np.isfinite(first)]
    # Quantile of the edges' blur that is the picture's: shadows and grass have soft edges in a sharp picture too.
    return float(np.quantile(first, 0.3)) if len(first) >= FEWEST_EDGES else None


def _steep_places(small: NDArray[np.uint8], where: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Return the steepest pixels (N, 2), one of each cell, and the direction (N, 2) in which it gets brighter there."""
    smooth = cv2.GaussianBlur(small, (0, 0), 1.2).astype(np.float32)
    right, down = cv2.Sobel(smooth, cv2.CV_32F, 1, 0), cv2.Sobel(smooth, cv2.CV_32F, 0, 1)
    steep = cv2.magnitude(right, down) * where
    # Side of the squares of the small picture from which one edge each is taken, so that no caption decides.
    cell = 16
    rows, columns = small.shape[0] // cell, small.shape[1] // cell
    squares = steep[: rows * cell, : columns * cell].reshape(rows, cell, columns, cell).swapaxes(1, 2)
    blocks = squares.reshape(rows * columns, -1)
    best = blocks.argmax(axis=1)
    strongest = np.argsort(-blocks[np.arange(len(blocks)), best])[:200]
    row = strongest // columns * cell + best[strongest] // cell
    column = strongest % columns * cell + best[strongest] % cell
    slope = np.stack([right[row, column], down[row, column]], axis=1).astype(float)
    length = np.linalg.norm(slope, axis=1)
    known = length > 0
    return np.stack([column, row], axis=1)[known].astype(float), slope[known] / length[known, None]


def _profiles(frame: Frame, pixel: Array, direction: Array, step: float) -> Array:
    """Read the brightness (N, 2 REACH + 1) along directions (N, 2) through pixels (N, 2), averaged aside."""
    along = np.stack([-direction[:, 1], direction[:, 0]], axis=1)
    offsets = step * np.arange(-REACH, REACH + 1)
    total = np.zeros((len(pixel), len(offsets)))
    for aside in (-1.5, 0.0, 1.5):
        at = pixel[:, None] + offsets[:, None] * direction[:, None] + aside * step * along[:, None]
        read = cv2.remap(
            frame, at[..., 0].astype(np.float32), at[..., 1].astype(np.float32), cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_REPLICATE,
        )  # fmt: skip
        total += cv2.cvtColor(read, cv2.COLOR_BGR2GRAY)
    return total / 3


def _edges(profiles: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Measure the steepest rise in profiles (N, S): standard deviation in steps, height, True if it ends inside."""
    slope = np.diff(profiles, axis=1)
    slope = (
        np.pad(slope, ((0, 0), (1, 1)), mode="edge")[:, :-2]
        + 2 * slope
        + np.pad(slope, ((0, 0), (1, 1)), mode="edge")[:, 2:]
    ) / 4
    steepest = slope.argmax(axis=1)
    peak = slope.max(axis=1)
    row = np.arange(len(slope))
    # Slope at which an edge ends, as a part of that at its steepest place.
    rising = slope > 0.15 * peak[:, None]
    # From the steepest place outwards, as long as it rises.
    index = np.arange(slope.shape[1])
    after = np.where(~rising & (index > steepest[:, None]), index, slope.shape[1]).min(axis=1)
    before = np.where(~rising & (index < steepest[:, None]), index, -1).max(axis=1)
    part = (index > before[:, None]) & (index < after[:, None])
    height = np.sum(slope * part, axis=1)
    inner = (before >= 0) & (after < slope.shape[1]) & (peak[row] > 0)
    wide = height / (np.sqrt(2 * np.pi) * np.maximum(peak, 1e-6))
    # The average of neighbours smears by itself.
    return np.sqrt(np.maximum(wide**2 - 0.5, 0.0)), height, inner
