"""Where the painted lines are in a frame: sub-pixel centres, measured across each line with a matched filter.

The filter is the profile that a line of the expected width should have after the blur of lens and sensor. The frame's
brightness says where it fits best. That it is a marking is said by one of two witnesses: the segmentation, or the ridge
itself, where it goes on along the line as noise and things beside the line do not.
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
TOGETHER_PX = 40.0
"""Length of line, in pixels of a 4K frame, over which a ridge has to go on to be one."""
LEAST_ALONG = 0.5
"""Mean correlation with the expected profile, over that length, from which a ridge is a line for itself."""
DARK_SHARE, DARK_OVER_BRIGHT = 0.5, 2.0
"""A marking is dark where so much of it is seen as a dark ridge, and so many times as much as as a bright one."""
CENTRE_STEPS = 2
RIDGE = 1e-6
OFF_CENTRE_PENALTY = 0.15
"""Correlation that a candidate at the end of the search loses against one where the pose expects the line."""
NOISE_PX = 0.2
"""Error of one measurement of a perfect line."""
PAINT_M = 0.006
"""Lines are painted to about a centimetre."""

MISFIT_ALIKE_PX = 10.0
"""Length of line over which what lens and field have wrong is the same."""


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
    length_px: Array
    misfit_px: float = 0.0

    def __len__(self) -> int:
        return len(self.index)

    @property
    def sigma_px(self) -> Array:
        """Expected error (M,) along the normal: of the measurement, of paint and ground, and what nothing explains."""
        of_model = np.hypot(PAINT_M * self.px_per_metre, UNEVEN_M * self.px_per_metre_up)
        return np.hypot(self.noise_px, of_model)

    @property
    def noise_px(self) -> Array:
        """Expected error (M,) of a measurement when paint and ground are where the model has them.

        What nothing explains is alike over `MISFIT_ALIKE_PX`: so much of a line counts as one measurement of it.
        """
        return np.hypot(NOISE_PX, self.misfit_px * np.sqrt(np.maximum(MISFIT_ALIKE_PX / self.length_px, 1.0)))

    def __getitem__(self, chosen: NDArray[np.bool_] | NDArray[np.intp]) -> Measurements:
        return Measurements(
            self.index[chosen],
            self.points[chosen],
            self.pixel[chosen],
            self.normal[chosen],
            self.px_per_metre[chosen],
            self.px_per_metre_up[chosen],
            self.length_px[chosen],
            self.misfit_px,
        )


def brightness_of(frame: Frame) -> NDArray[np.uint8]:
    """Brightness (H, W) 0..255: green alone.

    Lenses put blue and red elsewhere, up to some pixels towards the edges of the picture (the violet side of white
    lines). The intrinsics are those of green, which makes most of the grey in which boards are found.
    """
    return frame[..., 1]


@dataclass(frozen=True)
class Profiles:
    """Pieces of line of about one width, and how well they fit at shifts across themselves.

    `which` (M,): of the lines that were looked for; `brightness` (M, S + K - 1): profiles across them, NaN outside the
    picture, in steps of `sampling_px`; `expected` (M, K) at `offsets` (K,) from their centres, see `expected_profiles`;
    `correlation` (M, S) of the two at `shifts` (S,) px along their normals; `along` (M, S): its mean over the pieces
    of the same marking around each, -1..1: high where a ridge goes on along the line, near zero elsewhere.
    """

    which: NDArray[np.intp]
    brightness: Array
    expected: Array
    offsets: Array
    correlation: Array
    along: Array
    shifts: Array
    sampling_px: float


def line_profiles(
    seen: SeenLines, brightness: NDArray[np.float32], reach_px: float, relative_size: float
) -> list[Profiles]:
    """The profiles of all lines that are wide enough to be seen, for shifts up to `reach_px`, by class of width."""
    bend = _bend(seen)
    classes = []
    for low, high, sampling in WIDTH_CLASSES_PX:
        which = np.flatnonzero((seen.width_px >= low) & (seen.width_px < high))
        pieces = seen[which]
        half_filter = int(np.ceil((high * 0.85 + BESIDE_PX) / sampling))
        half_search = int(np.ceil(reach_px / sampling)) + 1
        reach = half_filter + half_search
        across = _profiles(brightness, pieces, bend[which], sampling * np.arange(-reach, reach + 1, dtype=float))
        offsets = sampling * np.arange(-half_filter, half_filter + 1, dtype=float)
        expected = expected_profiles(pieces.width_px, offsets)
        correlation = sliding_correlation(across, expected)
        along = _mean_along(correlation, pieces, TOGETHER_PX * relative_size)
        shifts = sampling * np.arange(-half_search, half_search + 1, dtype=float)
        classes.append(Profiles(which, across, expected, offsets, correlation, along, shifts, sampling))
    return classes


def measure_lines(
    lines: LinePoints,
    camera: Camera,
    brightness: NDArray[np.float32],
    response: NDArray[np.float32],
    search_px: float,
) -> Measurements:
    """The lines of `camera` found within `search_px` of where its pose expects them.

    `brightness` (H, W) see `brightness_of`; `response` (H, W) the segmentation in 0..1. What either the network or the
    ridge along a line calls a marking is measured.
    """
    seen = SeenLines.from_camera(lines, camera)
    profiles = line_profiles(seen, brightness, search_px, camera.intrinsics.relative_size)
    found = [_measured(seen[of_class.which], of_class, response, search_px) for of_class in profiles]
    index = np.concatenate([m.index for m in found])
    return Measurements(
        index,
        lines[index],
        np.concatenate([m.pixel for m in found]),
        np.concatenate([m.normal for m in found]),
        np.concatenate([m.px_per_metre for m in found]),
        np.concatenate([m.px_per_metre_up for m in found]),
        np.concatenate([m.length_px for m in found]),
    )


def _measured(seen: SeenLines, profiles: Profiles, response: NDArray[np.float32], search_px: float) -> Measurements:
    """Where the lines of one class fit best, to a fraction of a pixel, but for what speaks against it."""
    shifts, polarity = profiles.shifts, _polarity(profiles, seen)
    correlation, along = polarity * profiles.correlation, polarity * profiles.along
    preference = correlation - OFF_CENTRE_PENALTY * (shifts / search_px) ** 2
    best = np.argmax(preference, axis=1)
    at_end = (best == 0) | (best == len(shifts) - 1)
    windows = np.take_along_axis(profiles.brightness, best[:, None] + np.arange(profiles.expected.shape[1]), axis=1)
    shift = shifts[best] + _centre(windows, seen.width_px, profiles.offsets, profiles.sampling_px)
    pixel = seen.pixel + shift[:, None] * seen.normal
    row = np.arange(len(seen))
    marking = (bilinear(response, pixel) >= LEAST_RESPONSE) | (along[row, best] >= LEAST_ALONG)
    good = (
        ~at_end & (correlation[row, best] >= LEAST_CORRELATION) & marking & np.isfinite(profiles.brightness).all(axis=1)
    )
    return Measurements(
        seen.index, seen.points, pixel, seen.normal, seen.px_per_metre, seen.px_per_metre_up, seen.length_px
    )[good]


def _polarity(profiles: Profiles, seen: SeenLines) -> Array:
    """1 (M, 1) for lines brighter than their ground, -1 for those of a marking that goes on as a dark ridge instead."""
    bright, dark = (
        np.bincount(seen.points.marking, (sign * profiles.along).max(axis=1) >= LEAST_ALONG) for sign in (1, -1)
    )
    pieces = np.bincount(seen.points.marking)
    is_dark = (dark >= DARK_SHARE * pieces) & (dark > DARK_OVER_BRIGHT * bright)
    return np.where(is_dark[seen.points.marking], -1.0, 1.0)[:, None]


def _mean_along(correlation: Array, pieces: SeenLines, length_px: float) -> Array:
    """Correlations (M, S) averaged along each marking over about `length_px`, as many pieces to each side."""
    half = np.ceil(length_px / 2 / np.maximum(pieces.length_px, 1e-6)).astype(int)
    breaks = (np.diff(pieces.index) != 1) | (np.diff(pieces.points.marking) != 0)
    stretch = np.concatenate([[0], np.cumsum(breaks)])[: len(pieces)]
    first = np.searchsorted(stretch, stretch, side="left")
    last = np.searchsorted(stretch, stretch, side="right")
    at = np.arange(len(pieces))
    low, high = np.maximum(at - half, first), np.minimum(at + half + 1, last)
    total = np.concatenate([np.zeros((1, correlation.shape[1])), np.cumsum(np.nan_to_num(correlation), axis=0)])
    return np.asarray((total[high] - total[low]) / (high - low)[:, None])


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
