"""Where the painted lines are in a frame: sub-pixel centres, measured across each line with a matched filter.

That a ridge is a marking is said by one of two witnesses: the segmentation, or the ridge itself, where it goes on along
the line as noise and things beside the line do not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from worker.calibration.scene.camera import Array, Camera
from worker.calibration.scene.field import LinePoints
from worker.calibration.scene.ground import UNEVEN_M
from worker.calibration.scene.visibility import SeenLines
from worker.calibration.see.contrast import Channels
from worker.calibration.see.line_matching import LEAST_ALONG, LENS_BLUR_PX, Matches, filter_reach, match_lines
from worker.calibration.see.line_profile import blurred_point, blurred_step
from worker.calibration.see.sampling import bilinear

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


def measure_lines(
    lines: LinePoints,
    camera: Camera,
    channels: Channels,
    response: NDArray[np.float32],
    search_px: float,
) -> Measurements:
    """The lines of `camera` found within `search_px` of where its pose expects them.

    `channels` of the frame; `response` (H, W) the segmentation in 0..1. What either the network or the ridge along a
    line calls a marking is measured.
    """
    seen = SeenLines.from_camera(lines, camera)
    found = [
        _measured(seen[matches.which], matches, response, search_px)
        for matches in match_lines(seen, channels, search_px, camera.intrinsics.relative_size)
    ]
    index, pixel, normal, px_per_metre, px_per_metre_up, length_px = map(np.concatenate, zip(*found, strict=True))
    measured = Measurements(index, lines[index], pixel, normal, px_per_metre, px_per_metre_up, length_px)
    return measured if camera.ignored is None else measured[camera.sees(measured.pixel)]


def _measured(
    seen: SeenLines, matches: Matches, response: NDArray[np.float32], search_px: float
) -> tuple[NDArray[np.intp], Array, Array, Array, Array, Array]:
    """Where the lines of one class fit best, to a fraction of a pixel, but for what speaks against it."""
    shifts, row = matches.shifts, np.arange(len(seen))
    preference = matches.correlation - OFF_CENTRE_PENALTY * (shifts / search_px) ** 2
    best = np.argmax(preference, axis=1)
    windows = np.take_along_axis(matches.brightness, best[:, None] + np.arange(matches.expected.shape[1]), axis=1)
    shift = shifts[best] + _centre(windows, seen.width_px, matches.offsets, matches.sampling_px)
    pixel = seen.pixel + shift[:, None] * seen.normal
    marking = (bilinear(response, pixel) >= LEAST_RESPONSE) | (matches.along[row, best] >= LEAST_ALONG)
    good = (
        (best > 0)
        & (best < len(shifts) - 1)
        & (matches.correlation[row, best] >= LEAST_CORRELATION)
        & marking
        & np.isfinite(matches.brightness).all(axis=1)
    )
    seen = seen[good]
    return seen.index, pixel[good], seen.normal, seen.px_per_metre, seen.px_per_metre_up, seen.length_px


def _centre(windows: Array, width_px: Array, offsets: Array, reach_px: float) -> Array:
    """Centres (N,) of the lines in windows (N, K) of brightness at `offsets` (K,), at most `reach_px` from 0.

    Least squares of what is there: ground, paint, ground. Ground on one side of a line is seldom as bright as on the
    other, and that must not pull the line.
    """
    inside = np.abs(offsets) <= filter_reach(width_px)[:, None]
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
