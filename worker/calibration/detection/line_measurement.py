"""Measurement of painted lines in a frame: sub-pixel centres, by a matched filter across each line.

That a ridge is a marking is said by one of two witnesses: the segmentation, or the ridge itself, where it goes on along
the line as noise and things beside the line do not.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.contrast import Channels, PixelReader
from worker.calibration.detection.line_matching import (
    LEAST_ALONG,
    LENS_BLUR_PX,
    Matches,
    filter_reach,
    match_known,
    match_lines,
)
from worker.calibration.detection.line_profile import blurred_point, blurred_step, without_nan
from worker.calibration.detection.sampling import bilinear
from worker.calibration.geometry.arrays import Array, Plane, take_rows
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.derivatives import lens_jacobian, pixel_jacobian
from worker.calibration.geometry.field import LinePoints
from worker.calibration.geometry.visibility import VisibleLines

CORRELATION = (0.55, 0.65)
"""Correlation with the expected profile from which a measurement counts at all, and from which it counts in full.

Every limit is a ramp: with a step, a measurement beside it would come and go as the pose moves by a hair.
"""
NOISE_PX = 0.2
"""Standard deviation of one measurement of a perfect line."""
PAINT_M = 0.006
"""Standard deviation of a line's place on the ground: lines are painted to about a centimetre."""

SHARED_NOISE = 0.1
"""Part of the variance of `NOISE_PX` that is the same in every frame of a camera that stands still."""


@dataclass(frozen=True)
class Measurements:
    """M line centres measured in one frame.

    `index` (M,): which of the pitch's line points; `points`: those points; `pixel` (M, 2): where the line was found;
    `normal` (M, 2): across it in the picture, towards `points.normal`; `px_per_metre` and `px_per_metre_up` (M,): how
    far it moves along that when the line or the ground under it does (see `VisibleLines`); `trust` (M,) in 0..1: how
    much of a measurement it is; `jobs` (M,): the mean of so many frames of separate jobs.
    """

    index: NDArray[np.intp]
    points: LinePoints
    pixel: Array
    normal: Array
    px_per_metre: Array
    px_per_metre_up: Array
    length_px: Array
    trust: Array
    misfit_px: float = 0.0
    jobs: Array | float = 1.0

    def __len__(self) -> int:
        return len(self.index)

    def offset(self, camera: Camera, positions: Array) -> Array:
        """Return pixels (M,) along the normals from where `camera` puts points (M, 3) to the measured lines."""
        return np.asarray(np.sum((self.pixel - camera.project(positions)) * self.normal, axis=1))

    def jacobian(self, camera: Camera, positions: Array) -> Array:
        """Jacobian (M, 6) of `offset` by the camera's pose, per rad and metre (see `derivatives`)."""
        return -np.einsum("mij,mi->mj", pixel_jacobian(camera, positions), self.normal)

    def lens_jacobian(self, camera: Camera, positions: Array) -> Array:
        """Jacobian (M, 6) of `offset` by `LENS_PARAMETERS` of the camera's lens, px per unit of each."""
        return -np.einsum("mij,mi->mj", lens_jacobian(camera, positions), self.normal)

    @property
    def sigma_px(self) -> Array:
        """Standard deviation (M,) along the normal: of the measurement, of paint and ground, and of the misfit."""
        of_model = np.hypot(PAINT_M * self.px_per_metre, self.points.uneven_m * self.px_per_metre_up)
        return np.hypot(self.noise_px, of_model)

    @property
    def noise_px(self) -> Array:
        """Standard deviation (M,) of a measurement when paint and ground are where the model has them.

        The misfit is alike over 10 px: so much of a line counts as one measurement of it. The mean of many
        jobs keeps the part of the noise that all of them share.
        """
        noise = NOISE_PX * np.sqrt(SHARED_NOISE + (1 - SHARED_NOISE) / np.asarray(self.jobs))
        return np.hypot(noise, self.misfit_px * np.sqrt(self.alike))

    @property
    def alike(self) -> Array:
        """Number (M,) of neighbours that share the same misfit, 1 at least."""
        return np.maximum(10.0 / self.length_px, 1.0)

    def __getitem__(self, chosen: NDArray[np.bool_] | NDArray[np.intp]) -> "Measurements":
        return take_rows(self, chosen)


class LineProfiles:
    """Brightness across the expected lines of one frame, read once and matched from any pose that is near."""

    def __init__(
        self,
        seen: VisibleLines,
        camera: Camera,
        matches: Sequence[Matches],
        response: NDArray[np.float32] | None,
        reach_px: float,
    ) -> None:
        """Take `matches` of lines that were read where `camera` has `seen` them; see `read` and `read_known`."""
        self._camera, self._response, self._reach_px, self._seen = camera, response, reach_px, seen
        self._classes = [_Centred(of_class, seen.width_px[of_class.which]) for of_class in matches]

    @classmethod
    def read(
        cls, lines: LinePoints, camera: Camera, channels: Channels, response: NDArray[np.float32], reach_px: float
    ) -> Self:
        """Read profiles up to `reach_px` to each side of where `camera` expects the `lines`.

        `channels` of the frame; `response` (H, W) the segmentation in 0..1.
        """
        seen = VisibleLines.from_camera(lines, camera)
        matches = match_lines(seen, channels, reach_px, camera.intrinsics.relative_size)
        return cls(seen, camera, matches, response, reach_px)

    @classmethod
    def read_known(
        cls, lines: LinePoints, camera: Camera, picture: PixelReader, contrasts: NDArray[np.intp], reach_px: float
    ) -> Self:
        """Read profiles without the network, by known `contrasts` (K, 2) of all markings (see `known_contrasts`)."""
        seen = VisibleLines.from_camera(lines, camera)
        matches = match_known(seen, picture, contrasts, reach_px, camera.intrinsics.relative_size)
        return cls(seen, camera, matches, None, reach_px)

    @property
    def any(self) -> bool:
        """True if any line was read."""
        return bool(self._classes)

    def measure(self, camera: Camera, lines: LinePoints, search_px: float) -> Measurements:
        """Measure the lines within `search_px` of where `camera` expects them: `lines` are those that were read.

        What either the network or the ridge along a line calls a marking is measured.
        """
        expected = self._expected(camera, lines)
        found = [self._found(of_class, expected[of_class.matches.which], search_px) for of_class in self._classes]
        which, shift, trust = map(np.concatenate, zip(*found, strict=True))
        seen = self._seen[which]
        measured = Measurements(
            seen.index,
            lines[seen.index],
            seen.pixel + shift[:, None] * seen.normal,
            seen.normal,
            seen.px_per_metre,
            seen.px_per_metre_up,
            seen.length_px,
            trust,
        )
        return measured if camera.ignored is None else measured[camera.sees(measured.pixel)]

    def cover(self, camera: Camera, lines: LinePoints, search_px: float) -> bool:
        """True if all that was read reaches `search_px` beyond where `camera` expects the lines."""
        farthest = np.nanmax(np.abs(self._expected(camera, lines)), initial=0.0)
        return bool(farthest + search_px <= self._reach_px)

    def _expected(self, camera: Camera, lines: LinePoints) -> Array:
        """Return pixels (N,) along their normals from where the lines were read to where `camera` expects them."""
        moved = camera.project(lines.position[self._seen.index]) - self._seen.pixel
        return np.asarray(np.sum(moved * self._seen.normal, axis=1))

    def _found(self, centred: "_Centred", expected: Array, search_px: float) -> tuple[NDArray[np.intp], Array, Array]:
        """Return which lines of one class were found, how far (px) from where they were read, and their trust 0..1."""
        matches = centred.matches
        shifts = matches.base[:, None] + matches.shifts
        beside = np.abs(shifts - expected[:, None])
        # A candidate at the end of the search loses so much correlation against one where the pose expects the line.
        preference = matches.correlation - 0.15 * (beside / search_px) ** 2
        preference[~(beside <= search_px + matches.sampling_px)] = -np.inf
        best = _peaks(matches.correlation, np.argmax(preference, axis=1))
        every = np.arange(len(best))
        like_a_line = matches.correlation[every, best] > CORRELATION[0]
        row = np.flatnonzero(like_a_line & (best > 0) & (best < shifts.shape[1] - 1))
        best, seen = best[row], self._seen[matches.which[row]]
        shift = shifts[row, best] + centred.at(row, best)
        pixel = seen.pixel + shift[:, None] * seen.normal
        marking = _ramp(matches.along[row, best], LEAST_ALONG - 0.05, LEAST_ALONG + 0.05)
        if self._response is not None:
            # Network probability of a marking from which a measurement counts at all, and in full.
            marking = np.maximum(marking, _ramp(bilinear(self._response, pixel), 0.25, 0.35))
        # It fades towards the end of the search, and towards the border of the picture.
        trust = (
            marking
            * _ramp(matches.correlation[row, best], *CORRELATION)
            * _ramp(search_px - np.abs(shift - expected[row]), 0.0, 1.0)
            * _ramp(self._to_border(seen, shift, matches), 0.0, 2.0)
        )
        good = trust > 0
        return matches.which[row[good]], shift[good], trust[good]

    def _to_border(self, seen: VisibleLines, shift: Array, matches: Matches) -> Array:
        """Return pixels (N,) from what was read of each line to the border of the picture, negative beyond it."""
        width, height = self._camera.intrinsics.size
        outward = (np.abs(shift) + matches.offsets[-1])[:, None] * np.abs(seen.normal)
        to_last = np.array([width - 1, height - 1]) - (seen.pixel + outward)
        return np.asarray(np.minimum(seen.pixel - outward, to_last).min(axis=1))


def measure_lines(
    lines: LinePoints,
    camera: Camera,
    channels: Channels,
    response: NDArray[np.float32],
    search_px: float,
) -> Measurements:
    """Measure the lines within `search_px` of where the pose of `camera` expects them (see `LineProfiles`)."""
    return LineProfiles.read(lines, camera, channels, response, search_px).measure(camera, lines, search_px)


class _Centred:
    """Matches of one class of width, with the centres of lines in their windows, computed once for each."""

    def __init__(self, matches: Matches, width_px: Array) -> None:
        self.matches, self._width_px = matches, width_px
        self._window = np.full(len(width_px), -1)
        self._centre = np.zeros(len(width_px))

    def at(self, row: NDArray[np.intp], window: NDArray[np.intp]) -> Array:
        """Return pixels (M,) from the middles of windows (M,) of rows (M,) to the centres of their lines."""
        new = window != self._window[row]
        if new.any():
            there, begins = row[new], window[new]
            reach = np.arange(self.matches.expected.shape[1])
            across = np.take_along_axis(self.matches.brightness[there], begins[:, None] + reach, axis=1)
            centre = _centre(across, self._width_px[there], self.matches.offsets, self.matches.sampling_px)
            self._centre[there], self._window[there] = centre, begins
        return self._centre[row]


def _peaks(values: Array, begun: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the columns (N,) of the local maxima in rows of values (N, S) that lie uphill of columns `begun` (N,)."""
    rows, last, height = np.arange(len(values)), values.shape[1] - 1, without_nan(values, -np.inf)
    here = begun
    # Most sampling steps from the match that is preferred for lying near to where the line is expected to the best
    # match beside it: where a line is measured does not depend on where it is expected.
    for _ in range(8):
        around = np.clip(here + np.array([[0], [-1], [1]]), 0, last)
        higher = np.argmax(height[rows, around], axis=0)
        if not higher.any():
            break
        here = around[higher, rows]
    return here


def _ramp(value: Plane, low: float, high: float) -> Array:
    """Return 0 below `low`, 1 above `high`, straight between them; 0 for NaN."""
    return without_nan(np.clip((np.asarray(value, dtype=float) - low) / (high - low), 0.0, 1.0))


def _centre(windows: Array, width_px: Array, offsets: Array, reach_px: float) -> Array:
    """Fit the centres (N,) of lines in windows (N, K) of brightness at `offsets` (K,), at most `reach_px` from 0.

    Least squares of ground, paint, ground. Ground on one side of a line is seldom as bright as on the other, and that
    must not pull the line.
    """
    inside = np.abs(offsets) <= filter_reach(width_px)[:, None]
    windows = without_nan(windows) * inside
    sides = np.array([1.0, -1.0])[:, None, None]
    centre, move = np.zeros(len(windows)), np.zeros((len(windows), len(offsets)))
    model = np.empty((len(windows), 4, len(offsets)))
    for _ in range(3):
        edges = offsets - centre[:, None] + sides * width_px[:, None] / 2
        first, second = blurred_step(edges, LENS_BLUR_PX)
        model[:, 0], model[:, 1], model[:, 2], model[:, 3] = 1 - first, first - second, second, move
        model *= inside[:, None]
        normal = np.einsum("nak,nbk->nab", model, model) + 1e-6 * np.eye(4)
        before, paint, behind, by = np.linalg.solve(normal, np.einsum("nak,nk->na", model, windows)[..., None])[
            ..., 0
        ].T
        centre = np.clip(centre + by, -reach_px, reach_px)
        rise, fall = blurred_point(edges, LENS_BLUR_PX)
        # How the brightness changes when the line moves, which the first time round is not yet known.
        move = (before - paint)[:, None] * rise + (paint - behind)[:, None] * fall
    return centre
