"""Pictures in the form in which video travels, and the arithmetic between it and blue, green, red.

Brightness (luma) has a value for each pixel, the two differences of colour (chroma) one for every 2 x 2: BT.709, luma
16 to 235, chroma 16 to 240 around 128, a chroma sample beside the left pixels of its four, between its two rows. What
comes otherwise is converted on its way in.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.contrast import LUMA_SHARES, Channel
from worker.calibration.detection.sampling import read_bytes
from worker.calibration.geometry.camera import Array, Frame

if TYPE_CHECKING:
    import av

Plane = NDArray[np.uint8]

BLACK, NO_COLOUR = 16, 128
# libav's numbers: matrices of colour (AVCOL_SPC_*) and ranges (AVCOL_RANGE_*).
BT709, UNTOLD, RANGE_LIMITED, RANGE_FULL = 1, 2, 1, 2
# What names no matrix is BT.601 if it is no higher than PAL, BT.709 otherwise: what players take it for.
PAL_ROWS, BT601 = 576, 5
# swscale's bilinear, rounded properly and with all of the chroma: without these it darkens by up to five levels.
EXACT = 0x2 | 0x40000 | 0x2000 | 0x4000
# Levels from the darkest luma to the brightest.
LUMA_LEVELS = 219


def _to_planes() -> Array:
    """Return the matrix (3, 4) from blue, green, red, 1 to luma and both chroma."""
    luma = np.array(LUMA_SHARES)
    blue, _, red = LUMA_SHARES
    of_blue = (np.array([1.0, 0, 0]) - luma) / (2 * (1 - blue))
    of_red = (np.array([0, 0, 1.0]) - luma) / (2 * (1 - red))
    rows = np.stack([LUMA_LEVELS * luma, 224 * of_blue, 224 * of_red]) / 255
    return np.column_stack([rows, [BLACK, NO_COLOUR, NO_COLOUR]])


TO_PLANES = _to_planes()
_INVERSE = np.linalg.inv(TO_PLANES[:, :3])
FROM_PLANES = np.column_stack([_INVERSE, -_INVERSE @ TO_PLANES[:, 3]])
"""Matrix (3, 4) from luma, both chroma, 1 to blue, green, red."""


@dataclass(frozen=True)
class Picture:
    """A frame of a clip: yuv420p in BT.709, limited range."""

    frame: av.VideoFrame

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.frame.width, self.frame.height

    @cached_property
    def planes(self) -> tuple[Plane, Plane, Plane]:
        """Luma (H, W) and both chroma (H/2, W/2), the frame's own memory."""
        return planes_of(self.frame)

    @cached_property
    def colours(self) -> Frame:
        """Blue, green, red (H, W, 3)."""
        shown = self.frame.reformat(
            format="bgr24",
            src_colorspace=BT709,
            dst_colorspace=BT709,
            src_color_range=RANGE_LIMITED,
            dst_color_range=RANGE_FULL,
            interpolation=EXACT,
        )
        return np.asarray(shown.to_ndarray(), np.uint8)

    def read(self, channel: int, column: NDArray[np.float32], row: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the brightness (P, N) 0..255 of one channel at columns and rows (P, N), NaN outside the picture.

        A `worker.calibration.detection.contrast.PixelReader`.
        """
        luma, blue, red = self.planes
        brightness = read_bytes(luma, column, row)
        if channel == Channel.LUMA:
            brightness = (brightness - BLACK) * np.float32(255 / LUMA_LEVELS)
        else:
            by_luma, by_blue, by_red, constant = FROM_PLANES[channel].astype(np.float32)
            there = column / np.float32(2), (row - np.float32(0.5)) / np.float32(2)
            brightness = by_luma * brightness + constant
            brightness += by_blue * read_bytes(blue, *there) + by_red * read_bytes(red, *there)
        width, height = self.size
        brightness[(column < 0) | (column > width - 1) | (row < 0) | (row > height - 1)] = np.nan
        return brightness


def picture_of(frame: av.VideoFrame) -> Picture:
    """Return a decoded frame of any format as yuv420p in BT.709."""
    matrix = _matrix(frame)
    full = frame.color_range == RANGE_FULL or frame.format.name.startswith("yuvj")
    if frame.format.name == "yuv420p" and matrix == BT709 and not full:
        return Picture(frame)
    return Picture(
        frame.reformat(
            format="yuv420p",
            src_colorspace=matrix,
            dst_colorspace=BT709,
            src_color_range=RANGE_FULL if full else RANGE_LIMITED,
            dst_color_range=RANGE_LIMITED,
            interpolation=EXACT,
        )
    )


def _matrix(frame: av.VideoFrame) -> int:
    matrix = int(frame.colorspace)
    if matrix != UNTOLD:
        return matrix
    return BT601 if frame.height <= PAL_ROWS else BT709


def planes_of(frame: av.VideoFrame) -> tuple[Plane, Plane, Plane]:
    """Return views into a yuv420p frame: luma (H, W) and both chroma (H/2, W/2), rounded up."""
    luma, blue, red = (_view(plane) for plane in frame.planes)
    return luma, blue, red


def _view(plane: Any) -> Plane:
    rows = np.frombuffer(plane, np.uint8)
    return rows[: plane.height * plane.line_size].reshape(plane.height, plane.line_size)[:, : plane.width]
