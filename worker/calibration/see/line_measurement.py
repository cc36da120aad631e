"""Where the painted lines are in a frame: sub-pixel centres, measured across each line with a matched filter.

The filter is the profile that a line of the expected width should have after the blur of lens and sensor. The frame's
brightness says where it fits best; the segmentation only says whether a bright ridge is a marking.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from worker.calibration.scene.camera import Array, Camera, Frame
from worker.calibration.scene.field import LinePoints
from worker.calibration.scene.ground import UNEVEN_M
from worker.calibration.scene.visibility import SeenLines
from worker.calibration.see.line_profile import blurred_line, blurred_point, blurred_step
from worker.calibration.see.sampling import bilinear

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
CENTRE_STEPS = 2
RIDGE = 1e-6
OFF_CENTRE_PENALTY = 0.15
"""Correlation that a candidate at the end of the search loses against one where the pose expects the line."""
NOISE_PX = 0.2
"""Error of one measurement of a perfect line."""
PAINT_M = 0.006
"""Lines are painted to about a centimetre."""


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
        of_model = np.hypot(PAINT_M * self.px_per_metre, UNEVEN_M * self.px_per_metre_up)
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
    """Brightness (H, W) 0..255: green alone.

    Lenses put blue and red elsewhere, up to some pixels towards the edges of the picture (the violet side of white
    lines). The intrinsics are those of green, which makes most of the grey in which boards are found.
    """
    return frame[..., 1]


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
    bend = _bend(seen)
    found = []
    for low, high, sampling in WIDTH_CLASSES_PX:
        of_class = (seen.width_px >= low) & (seen.width_px < high)
        found.append(_measure_class(seen[of_class], bend[of_class], brightness, response, search_px, high, sampling))
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
    bend: Array,
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
    profiles = _profiles(brightness, seen, bend, offsets)
    around = sampling_px * np.arange(-half_filter, half_filter + 1, dtype=float)
    filters = expected_profiles(seen.width_px, around)
    correlation = sliding_correlation(profiles, filters)

    shifts = np.arange(-half_search, half_search + 1) * sampling_px
    preference = correlation - OFF_CENTRE_PENALTY * (shifts / search_px) ** 2
    best = np.argmax(preference, axis=1)
    at_end = (best == 0) | (best == len(shifts) - 1)
    windows = np.take_along_axis(profiles, best[:, None] + np.arange(filters.shape[1]), axis=1)
    shift = shifts[best] + _centre(windows, seen.width_px, around, sampling_px)
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
    profile = blurred_line(width_px[:, None], LENS_BLUR_PX, offsets_px)
    inside = np.abs(offsets_px) <= _reach(width_px)[:, None]
    mean = np.sum(profile * inside, axis=1, keepdims=True) / np.sum(inside, axis=1, keepdims=True)
    profile = (profile - mean) * inside
    return profile / np.linalg.norm(profile, axis=1, keepdims=True)


def _reach(width_px: Array) -> Array:
    """How far (N,) from the centre of a line its filter reaches, in px."""
    return width_px / 2 + width_px / 3 + BESIDE_PX


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


def _profiles(image: NDArray[np.float32], seen: SeenLines, bend: Array, offsets: Array) -> Array:
    """Brightness (N, S) across the lines at `offsets` (S,) px, averaged along them; NaN outside the picture.

    `bend` (N,): 1 / radius of the lines in the picture, in 1 / px, positive where they turn towards their normals.
    """
    along = np.stack([seen.normal[:, 1], -seen.normal[:, 0]], axis=1)
    total = np.zeros((len(seen), len(offsets)))
    for shift in ALONG_PX:
        on_line = seen.pixel + shift * along + (bend * shift**2 / 2)[:, None] * seen.normal
        where = on_line[:, None] + offsets[None, :, None] * seen.normal[:, None]
        total += bilinear(image, where, outside=np.nan)
    return total / len(ALONG_PX)


def _bend(seen: SeenLines) -> Array:
    """1 / radius (N,) of the lines in the picture (see `_profiles`), from the neighbours on the same marking."""
    rise, run = np.zeros(len(seen)), np.zeros(len(seen))
    together = (np.diff(seen.index) == 1) & (np.diff(seen.points.marking) == 0)
    step = np.diff(seen.pixel, axis=0)[together]
    here, there = np.flatnonzero(together), np.flatnonzero(together) + 1
    for at, sign in ((here, 1), (there, -1)):
        across = sign * np.sum(step * seen.normal[at], axis=1)
        rise[at] += across
        run[at] += np.sum(step**2, axis=1) - across**2
    return np.divide(2 * rise, run, out=np.zeros(len(seen)), where=run > 0)


def _centre(windows: Array, width_px: Array, offsets: Array, reach_px: float) -> Array:
    """Centres (N,) of the lines in windows (N, K) of brightness at `offsets` (K,), at most `reach_px` from 0.

    Least squares of what is there: ground, paint, ground. Ground on one side of a line is seldom as bright as on the
    other, and that must not pull the line.
    """
    inside = np.abs(offsets) <= _reach(width_px)[:, None]
    windows = np.nan_to_num(windows) * inside
    centre, move = np.zeros(len(windows)), np.zeros((len(windows), len(offsets)))
    for _ in range(1 + CENTRE_STEPS):
        begin, end = (offsets - centre[:, None] + side * width_px[:, None] / 2 for side in (1, -1))
        first, second = blurred_step(begin, LENS_BLUR_PX), blurred_step(end, LENS_BLUR_PX)
        model = np.stack([1 - first, first - second, second, move], axis=1) * inside[:, None]
        normal = np.einsum("nak,nbk->nab", model, model) + RIDGE * np.eye(4)
        before, paint, behind, by = np.linalg.solve(normal, np.einsum("nak,nk->na", model, windows)[..., None])[
            ..., 0
        ].T
        centre = np.clip(centre + by, -reach_px, reach_px)
        edges = [blurred_point(edge, LENS_BLUR_PX) for edge in (begin, end)]
        # How the brightness changes when the line moves, which the first time round is not yet known.
        move = (before - paint)[:, None] * edges[0] + (paint - behind)[:, None] * edges[1]
    return centre
