"""Where the painted lines are in a frame: sub-pixel centres, measured across each line with a matched filter.

The filter is the profile that a line of the expected width should have after the blur of lens and sensor. The frame's
brightness says where it fits best; the segmentation only says whether a bright ridge is a marking.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.camera import Array, Camera, Frame
from worker.calibration.field import LinePoints
from worker.calibration.lineprofile import blurred_line
from worker.calibration.sampling import bilinear
from worker.calibration.visibility import SeenLines

LENS_BLUR_PX = 0.9
"""Standard deviation of lens, sensor and compression together: it softens the edges of the expected profile."""
ALONG_PX = (-3.0, -1.5, 0.0, 1.5, 3.0)
"""Parallel profiles averaged for one measurement: the noise of grass falls, and a line hardly bends over 6 px."""
WIDTH_CLASSES_PX = ((0.3, 3.0, 0.5), (3.0, 10.0, 0.5), (10.0, 30.0, 1.0), (30.0, 90.0, 2.0))
"""Lines from..to px wide share a filter length and a sampling step."""
BESIDE_PX = 4.0
"""How much of the grass on each side belongs to the filter, beyond a third of the line's width."""
LEAST_CORRELATION = 0.6
LEAST_RESPONSE = 0.3
OFF_CENTRE_PENALTY = 0.15
"""Correlation that a candidate at the end of the search loses against one where the pose expects the line."""
NOISE_PX = 0.25
"""Error of one measurement of a perfect line."""
PAINT_M = 0.01
"""Lines are painted to about a centimetre."""
UNEVEN_GROUND_M = 0.015
"""And the ground swells by a little more, which from a low camera moves a far line by decimetres."""


@dataclass(frozen=True)
class Measurements:
    """Line centres found in one frame, M of them.

    `index` (M,): which of the pitch's line points; `points`: those points; `pixel` (M, 2): where the line was found;
    `normal` (M, 2): across it in the picture, towards `points.normal`; `px_per_metre` and `px_per_metre_up` (M,): how
    far it moves along that when the line or the ground under it does (see `SeenLines`).
    """

    index: NDArray[np.intp]
    points: LinePoints
    pixel: Array
    normal: Array
    px_per_metre: Array
    px_per_metre_up: Array

    def __len__(self) -> int:
        return len(self.index)

    @property
    def sigma_px(self) -> Array:
        """Expected error (M,) along the normal: of the measurement, and of paint and ground."""
        of_model = np.hypot(PAINT_M * self.px_per_metre, UNEVEN_GROUND_M * self.px_per_metre_up)
        return np.hypot(NOISE_PX, of_model)

    def __getitem__(self, chosen: NDArray[np.bool_] | NDArray[np.intp]) -> Measurements:
        return Measurements(
            self.index[chosen],
            self.points[chosen],
            self.pixel[chosen],
            self.normal[chosen],
            self.px_per_metre[chosen],
            self.px_per_metre_up[chosen],
        )


def brightness_of(frame: Frame) -> NDArray[np.uint8]:
    """Brightness (H, W) 0..255: the mean of green and red.

    Lenses put blue elsewhere, up to some pixels towards the edges of the picture (the violet side of white lines). The
    intrinsics are those of green, which makes most of the grey in which boards are found.
    """
    return np.asarray(cv2.addWeighted(frame[..., 1], 0.5, frame[..., 2], 0.5, 0), dtype=np.uint8)


def measure_lines(
    lines: LinePoints,
    camera: Camera,
    brightness: NDArray[np.float32],
    response: NDArray[np.float32],
    search_px: float,
) -> Measurements:
    """The lines of `camera` found within `search_px` of where its pose expects them.

    `brightness` (H, W) see `brightness_of`; `response` (H, W) the segmentation in 0..1.
    """
    seen = SeenLines.from_camera(lines, camera)
    found = [
        _measure_class(
            seen[(seen.width_px >= low) & (seen.width_px < high)], brightness, response, search_px, high, sampling
        )
        for low, high, sampling in WIDTH_CLASSES_PX
    ]
    index = np.concatenate([m.index for m in found])
    return Measurements(
        index,
        lines[index],
        np.concatenate([m.pixel for m in found]),
        np.concatenate([m.normal for m in found]),
        np.concatenate([m.px_per_metre for m in found]),
        np.concatenate([m.px_per_metre_up for m in found]),
    )


def _measure_class(
    seen: SeenLines,
    brightness: NDArray[np.float32],
    response: NDArray[np.float32],
    search_px: float,
    widest_px: float,
    sampling_px: float,
) -> Measurements:
    """Lines of about one width: profiles, correlation with the expected one, peak, and what speaks against it."""
    half_filter = int(np.ceil((widest_px * 0.85 + BESIDE_PX) / sampling_px))
    half_search = int(np.ceil(search_px / sampling_px)) + 1
    offsets = sampling_px * np.arange(-half_filter - half_search, half_filter + half_search + 1, dtype=float)
    profiles = _profiles(brightness, seen, offsets)
    around = sampling_px * np.arange(-half_filter, half_filter + 1, dtype=float)
    filters = expected_profiles(seen.width_px, around)
    correlation = sliding_correlation(profiles, filters)

    shifts = np.arange(-half_search, half_search + 1) * sampling_px
    preference = correlation - OFF_CENTRE_PENALTY * (shifts / search_px) ** 2
    best = np.argmax(preference, axis=1)
    at_end = (best == 0) | (best == len(shifts) - 1)
    best = np.clip(best, 1, len(shifts) - 2)
    shift = shifts[best] + sampling_px * _parabola_peak(correlation, best)
    pixel = seen.pixel + shift[:, None] * seen.normal
    row = np.arange(len(seen))
    good = (
        ~at_end
        & (correlation[row, best] >= LEAST_CORRELATION)
        & (bilinear(response, pixel) >= LEAST_RESPONSE)
        & np.isfinite(profiles).all(axis=1)
    )
    return Measurements(seen.index, seen.points, pixel, seen.normal, seen.px_per_metre, seen.px_per_metre_up)[good]


def expected_profiles(width_px: Array, offsets_px: Array) -> Array:
    """Zero-mean, unit-norm profiles (N, K) of lines `width_px` (N,) wide at `offsets_px` (K,) from their centre.

    A filter reaches a third of the width (and `BESIDE_PX`) beyond each edge and is zero farther out.
    """
    half = width_px[:, None] / 2
    profile = blurred_line(width_px[:, None], LENS_BLUR_PX, offsets_px)
    inside = np.abs(offsets_px) <= half + width_px[:, None] / 3 + BESIDE_PX
    mean = np.sum(profile * inside, axis=1, keepdims=True) / np.sum(inside, axis=1, keepdims=True)
    profile = (profile - mean) * inside
    return profile / np.linalg.norm(profile, axis=1, keepdims=True)


def sliding_correlation(profiles: Array, filters: Array) -> Array:
    """Normalised correlation (N, S - K + 1) of profiles (N, S) with their filters (N, K) at every shift.

    Mean and norm of a window are taken over the filter's support, so that far surroundings do not count.
    """
    windows = np.lib.stride_tricks.sliding_window_view(profiles, filters.shape[1], axis=1)
    support = (filters != 0).astype(float)
    count = support.sum(axis=1)[:, None]
    product = np.einsum("nsk,nk->ns", windows, filters)
    total = np.einsum("nsk,nk->ns", windows, support)
    squares = np.einsum("nsk,nk->ns", windows**2, support)
    spread = np.sqrt(np.maximum(squares - total**2 / count, 1e-6))
    return product / np.maximum(spread, np.sqrt(count))


def _profiles(image: NDArray[np.float32], seen: SeenLines, offsets: Array) -> Array:
    """Brightness (N, S) across the lines at `offsets` (S,) px, averaged along them; NaN outside the picture."""
    along = np.stack([seen.normal[:, 1], -seen.normal[:, 0]], axis=1)
    total = np.zeros((len(seen), len(offsets)))
    for shift in ALONG_PX:
        where = (seen.pixel + shift * along)[:, None] + offsets[None, :, None] * seen.normal[:, None]
        total += bilinear(image, where, outside=np.nan)
    return total / len(ALONG_PX)


def _parabola_peak(values: Array, best: NDArray[np.intp]) -> Array:
    """Position (N,) of the peak relative to column `best` (N,) of values (N, S), in columns."""
    row = np.arange(len(values))
    left, middle, right = values[row, best - 1], values[row, best], values[row, best + 1]
    curvature = left - 2 * middle + right
    return np.where(curvature < 0, 0.5 * (left - right) / np.minimum(curvature, -1e-12), 0.0).clip(-1, 1)
