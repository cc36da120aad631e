"""Matched filter for expected lines: correlation of a frame with the profile of a painted line, at shifts across it.

The profile is the one that a line of the expected width should have after the blur of lens and sensor, bright or dark,
in the channel in which the marking stands out.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fields.shapes import WHITE
from worker.calibration.detection.contrast import CONTRASTS, Channel, Channels, PixelReader, possible_signs
from worker.calibration.detection.line_profile import blurred_line, without_nan
from worker.calibration.geometry.camera import Array
from worker.calibration.geometry.visibility import VisibleLines

LENS_BLUR_PX = 0.9
"""Standard deviation of the blur of lens, sensor and compression together, which softens the edges of the expected
profile."""
ALONG_PX = (-3.0, -1.5, 0.0, 1.5, 3.0)
"""Places of the parallel profiles that are averaged for one measurement: the noise of grass falls, and a line hardly
bends over 6 px."""
WIDTH_CLASSES_PX = ((0.3, 3.0, 0.5), (3.0, 10.0, 0.5), (10.0, 30.0, 1.0), (30.0, 90.0, 2.0))
"""Classes of line widths (from, to, sampling step): lines of one class share a filter length and a step."""
BESIDE_PX = 4.0
"""Width of grass on each side that belongs to the filter, beyond a third of the line's width."""
LEAST_ALONG = 0.5
"""Mean correlation with the expected profile, over 40 px of a 4K frame, from which a ridge is a line by itself."""


@dataclass(frozen=True)
class Matches:
    """Matched-filter responses of pieces of line of about one width, at shifts across themselves.

    `which` (M,): of the lines that were looked for; `brightness` (M, S + K - 1): profiles across them, NaN outside the
    picture, in steps of `sampling_px`; `expected` (M, K) at `offsets` (K,) from their centres, see `expected_profiles`;
    `correlation` (M, S) of the two at `shifts` (S,) px along their normals, -1..1, positive where a piece is bright or
    dark as its marking is; `base` (M,) px: where the shifts of each begin, within a step of where it is expected;
    `along` (M, S): the mean correlation of the pieces of the same marking around each: high where a ridge goes on along
    the line, near zero elsewhere; `opposed` (M, S): True where another paint's colour is seen.
    """

    which: NDArray[np.intp]
    brightness: Array
    expected: Array
    offsets: Array
    correlation: Array
    along: Array
    opposed: NDArray[np.bool_]
    shifts: Array
    base: Array
    sampling_px: float

    def with_polarity(self, sign: int) -> "Matches":
        """Return the matches for lines brighter (1) or darker (-1) than their ground; ignores other paint."""
        return self if sign == 1 else replace(self, correlation=-self.correlation, along=-self.along)

    def where(self, chosen: NDArray[np.bool_], sign: int) -> "Matches":
        """Return the matches of some pieces, for lines that are brighter (1) or darker (-1) than their ground."""
        return replace(
            self,
            which=self.which[chosen],
            brightness=self.brightness[chosen],
            expected=self.expected[chosen],
            correlation=np.where(self.opposed[chosen], -1.0, sign * self.correlation[chosen]),
            along=np.where(self.opposed[chosen], -1.0, sign * self.along[chosen]),
            opposed=self.opposed[chosen],
            base=self.base[chosen],
        )

    @property
    def contrast(self) -> Array:
        """Contrast (M, S) of the pieces as lines at each shift: grey levels, but for the filter's norm."""
        windows = np.lib.stride_tricks.sliding_window_view(self.brightness, self.expected.shape[1], axis=1)
        return np.asarray(np.einsum("nsk,nk->ns", windows, self.expected))


def match_lines(seen: VisibleLines, channels: Channels, reach_px: float, relative_size: float) -> list[Matches]:
    """Return the matches of all lines that are wide enough to be seen, for shifts up to `reach_px`, by class of width.

    Each marking is looked for where it stands out most: in another channel than green only if green does not show it.
    What has another colour than a marking that is known not to be white is no match.
    """
    looked, strength = _match_channels(seen, channels, reach_px, relative_size)
    chosen = _strongest(strength)[seen.points.marking]
    return [
        of_class.where(chosen[of_class.which] == number, sign)
        for number, (channel, sign) in enumerate(CONTRASTS)
        if number == 0 or number in chosen
        for of_class in looked[channel]
    ]


def known_contrasts(seen: VisibleLines, channels: Channels, reach_px: float, relative_size: float) -> NDArray[np.intp]:
    """Return the contrast of each marking in one picture, (K, 2): the channel, and 1 for brighter or -1 for darker.

    Luma replaces green for all markings that luma shows as well.
    """
    _, strength = _match_channels(seen, channels, reach_px, relative_size)
    chosen = _strongest(strength)
    everywhere = np.ones(len(seen), dtype=bool)
    in_luma: dict[int, list[Matches]] = {
        Channel.GREEN: _matches_in(channels, Channel.LUMA, seen, _bend(seen), everywhere, reach_px, relative_size)
    }
    by_luma = _strengths(in_luma, seen)
    contrasts = np.array(CONTRASTS)[chosen]
    of_marking = np.arange(len(chosen))
    # Mean correlation by which a marking may stand out less in luma than in green and still be read in luma.
    as_well = by_luma[chosen, of_marking] >= strength[chosen, of_marking] - 0.05
    contrasts[as_well & (contrasts[:, 0] == Channel.GREEN), 0] = Channel.LUMA
    return contrasts


def match_known(
    seen: VisibleLines, picture: PixelReader, contrasts: NDArray[np.intp], reach_px: float, relative_size: float
) -> list[Matches]:
    """Return the matches of lines by known `contrasts` (K, 2) of the markings (see `known_contrasts`), by width."""
    bend, of_lines = _bend(seen), contrasts[seen.points.marking]
    matches = []
    for channel, sign in np.unique(of_lines, axis=0).tolist():
        for of_class, which in _by_width(seen, (of_lines == (channel, sign)).all(axis=1)):
            if which.any():
                rows = np.flatnonzero(which)
                found = _matches_of(of_class, rows, picture, channel, seen, bend, reach_px, relative_size)
                matches.append(found.with_polarity(sign))
    return matches


def _match_channels(
    seen: VisibleLines, channels: Channels, reach_px: float, relative_size: float
) -> tuple[dict[int, list[Matches]], Array]:
    """Return the matches by channel, and the strengths of markings in them (see `_strengths`).

    Other channels than green are read for markings that green does not show, and for those that are known not to be
    white.
    """
    everywhere, bend = np.ones(len(seen), dtype=bool), _bend(seen)
    in_green = _matches_in(channels, Channel.GREEN, seen, bend, everywhere, reach_px, relative_size)
    looked: dict[int, list[Matches]] = {Channel.GREEN: in_green}
    strength = _strengths(looked, seen)
    chosen = (strength.max(axis=0) < LEAST_ALONG)[seen.points.marking] | (seen.points.colour != WHITE)
    if chosen.any():
        looked |= {
            c: _matches_in(channels, c, seen, bend, chosen, reach_px, relative_size)
            for c in (Channel.RED, Channel.BLUE)
        }
        looked = _without_other_paint(looked, seen.points.colour)
        strength = _strengths(looked, seen)
    return looked, strength


def _strongest(strength: Array) -> NDArray[np.intp]:
    """Return the index into `CONTRASTS` of each marking (K,): the usual one unless another one is clearly stronger."""
    favoured = strength.copy()
    usual = np.argmax(strength > -np.inf, axis=0)
    # Another contrast has to correlate better by so much.
    favoured[usual, np.arange(strength.shape[1])] += 0.2
    return np.asarray(np.argmax(favoured, axis=0))


def _without_other_paint(looked: Mapping[int, list[Matches]], colour: NDArray[np.str_]) -> dict[int, list[Matches]]:
    """Return the matches in three channels, opposed where another colour than the paint (N,) is seen."""
    freed = {channel: list(classes) for channel, classes in looked.items()}
    for number, (green, red, blue) in enumerate(
        zip(*(looked[c] for c in (Channel.GREEN, Channel.RED, Channel.BLUE)), strict=True)
    ):
        named = colour[red.which] != WHITE
        everywhere = np.isin(green.which, red.which[named])
        contrast = {
            Channel.GREEN: green.contrast[everywhere],
            Channel.RED: red.contrast[named],
            Channel.BLUE: blue.contrast[named],
        }
        most = np.abs(np.stack(list(contrast.values()))).max(axis=0)
        opposed = np.zeros(most.shape, dtype=bool)
        for channel, sign in CONTRASTS:
            impossible = np.array([sign not in possible_signs(str(c), channel) for c in colour[red.which[named]]], bool)
            # A third of the strongest contrast that the paint cannot have shows another paint.
            opposed |= impossible[:, None] & (sign * contrast[channel] >= 0.33 * most)
        for channel, of_class, rows in (
            (Channel.GREEN, green, everywhere),
            (Channel.RED, red, named),
            (Channel.BLUE, blue, named),
        ):
            there = of_class.opposed.copy()
            there[rows] = opposed
            freed[channel][number] = replace(of_class, opposed=there)
    return freed


def _strengths(looked: Mapping[int, Sequence[Matches]], seen: VisibleLines) -> Array:
    """Return the strength of markings (K,) in each of `CONTRASTS`, -1..1, at the shift that suits most of each marking.

    Minus infinity where their paint cannot look so, or where the channel was not read.
    """
    marking, colour = seen.points.marking, seen.points.colour
    count = int(marking.max(initial=-1)) + 1
    strength = np.full((len(CONTRASTS), count), -np.inf)
    pieces = np.maximum(np.bincount(marking, minlength=count), 1)
    for number, (channel, sign) in enumerate(CONTRASTS):
        possible = [name for name in np.unique(colour) if sign in possible_signs(str(name), channel)]
        may_be = np.unique(marking[np.isin(colour, possible)])
        total = np.zeros(count)
        for of_class in looked.get(channel, []):
            members = marking[of_class.which] == np.arange(count)[:, None]
            total += (sign * (members.astype(float) @ of_class.along)).max(axis=1)
        if channel in looked:
            strength[number, may_be] = (total / pieces)[may_be]
    return strength


def _matches_in(
    picture: PixelReader,
    channel: int,
    seen: VisibleLines,
    bend: Array,
    chosen: NDArray[np.bool_],
    reach_px: float,
    relative_size: float,
) -> list[Matches]:
    """Return the matches of the `chosen` lines (N,), of curvature `bend` (N,), in one channel, by class of width."""
    return [
        _matches_of(of_class, np.flatnonzero(which), picture, channel, seen, bend, reach_px, relative_size)
        for of_class, which in _by_width(seen, chosen)
    ]


def _by_width(
    seen: VisibleLines, chosen: NDArray[np.bool_]
) -> Iterator[tuple[tuple[float, float, float], NDArray[np.bool_]]]:
    """Yield each of `WIDTH_CLASSES_PX` and the mask (N,) of `chosen` lines of such a width."""
    for low, high, sampling in WIDTH_CLASSES_PX:
        yield (low, high, sampling), chosen & (seen.width_px >= low) & (seen.width_px < high)


def _matches_of(
    of_class: tuple[float, float, float],
    which: NDArray[np.intp],
    picture: PixelReader,
    channel: int,
    seen: VisibleLines,
    bend: Array,
    reach_px: float,
    relative_size: float,
) -> Matches:
    """Return the matches of the lines `which` (M,), all of one of `WIDTH_CLASSES_PX`."""
    _, high, sampling = of_class
    pieces = seen[which]
    half_filter = int(np.ceil((high * 0.85 + BESIDE_PX) / sampling))
    half_search = int(np.ceil(reach_px / sampling)) + 1
    reach = half_filter + half_search
    base = _beside_grid(pieces, sampling)
    samples = base[:, None] + sampling * np.arange(-reach, reach + 1, dtype=float)
    across = _profiles(picture, channel, pieces, bend[which], samples)
    offsets = sampling * np.arange(-half_filter, half_filter + 1, dtype=float)
    expected = expected_profiles(pieces.width_px, offsets)
    correlation = sliding_correlation(across, expected)
    # Length of line, in pixels of a 4K frame, over which a ridge has to go on to be one.
    along = _mean_along(correlation, pieces, 40.0 * relative_size)
    shifts = sampling * np.arange(-half_search, half_search + 1, dtype=float)
    free = np.zeros(correlation.shape, dtype=bool)
    return Matches(which, across, expected, offsets, correlation, along, free, shifts, base, sampling)


def _beside_grid(pieces: VisibleLines, sampling_px: float) -> Array:
    """Return the distance (M,) px along its normal from each piece of line to its nearest sampling place.

    Sampling places stand fast in the picture. Else what is read of a line would depend a little on where it was
    expected.
    """
    # Spacing of the fixed points of the picture from which sampling places are counted.
    grid_px = 16.0
    fixed = grid_px * np.round(pieces.pixel / grid_px)
    beside = np.sum((pieces.pixel - fixed) * pieces.normal, axis=1)
    return np.asarray(sampling_px * np.round(beside / sampling_px) - beside)


def _mean_along(correlation: Array, pieces: VisibleLines, length_px: float) -> Array:
    """Return correlations (M, S) averaged along each marking over about `length_px`, as many pieces to each side."""
    half = np.ceil(length_px / 2 / np.maximum(pieces.length_px, 1e-6)).astype(int)
    breaks = (np.diff(pieces.index) != 1) | (np.diff(pieces.points.marking) != 0)
    stretch = np.concatenate([[0], np.cumsum(breaks)])[: len(pieces)]
    first = np.searchsorted(stretch, stretch, side="left")
    last = np.searchsorted(stretch, stretch, side="right")
    at = np.arange(len(pieces))
    low, high = np.maximum(at - half, first), np.minimum(at + half + 1, last)
    total = np.concatenate([np.zeros((1, correlation.shape[1])), np.cumsum(without_nan(correlation), axis=0)])
    return np.asarray((total[high] - total[low]) / (high - low)[:, None])


def expected_profiles(width_px: Array, offsets_px: Array) -> Array:
    """Return zero-mean, unit-norm profiles (N, K) of lines `width_px` (N,) wide at `offsets_px` (K,) from their centre.

    A filter reaches a third of the width (and `BESIDE_PX`) beyond each edge and is zero farther out.
    """
    profile = blurred_line(width_px[:, None], LENS_BLUR_PX, offsets_px)
    inside = np.abs(offsets_px) <= filter_reach(width_px)[:, None]
    mean = np.sum(profile * inside, axis=1, keepdims=True) / np.sum(inside, axis=1, keepdims=True)
    profile = (profile - mean) * inside
    return profile / np.linalg.norm(profile, axis=1, keepdims=True)


def filter_reach(width_px: Array) -> Array:
    """Return the half length (N,) px of the filters of lines `width_px` (N,) wide."""
    return width_px / 2 + width_px / 3 + BESIDE_PX


def sliding_correlation(profiles: Array, filters: Array) -> Array:
    """Return the normalised correlation (N, S - K + 1) of profiles (N, S) with filters (N, K) at every shift.

    Mean and norm of a window are taken over the filter's support, so that far surroundings do not count. NaN where any
    value of a window is.
    """
    windows = np.lib.stride_tricks.sliding_window_view(profiles, filters.shape[1], axis=1)
    product = np.einsum("nsk,nk->ns", windows, filters)
    first, count = (filters != 0).argmax(axis=1), (filters != 0).sum(axis=1)
    values = without_nan(profiles)
    total, squares = (_window_sums(of, first, count, product.shape[1]) for of in (values, values**2))
    spread = np.sqrt(np.maximum(squares - total**2 / count[:, None], 1e-6))
    return product / np.maximum(spread, np.sqrt(count)[:, None])


def _window_sums(values: Array, first: NDArray[np.intp], count: NDArray[np.intp], shifts: int) -> Array:
    """Return sums (N, `shifts`) of `count` (N,) neighbours in rows (N, S), from `first` (N,) on, shift by shift."""
    up_to = np.zeros((len(values), values.shape[1] + 1))
    np.cumsum(values, axis=1, out=up_to[:, 1:])
    begin = first[:, None] + np.arange(shifts)
    end = begin + count[:, None]
    return np.asarray(np.take_along_axis(up_to, end, axis=1) - np.take_along_axis(up_to, begin, axis=1))


def _profiles(picture: PixelReader, channel: int, seen: VisibleLines, bend: Array, offsets: Array) -> Array:
    """Read the brightness (N, S) across the lines at `offsets` (N, S) px, averaged along them; NaN outside the picture.

    `bend` (N,): 1 / radius of the lines in the picture, in 1 / px, positive where they turn towards their normals.
    """
    along = np.stack([seen.normal[:, 1], -seen.normal[:, 0]], axis=1)
    shift = np.array(ALONG_PX)[:, None, None]
    on_line = (seen.pixel + shift * along + (bend[:, None] * shift**2 / 2) * seen.normal).astype(np.float32)
    # As exact as pictures are read: a float32 tells a 4000th of a pixel.
    column, row = (
        on_line[:, :, axis : axis + 1] + (offsets * seen.normal[:, axis : axis + 1]).astype(np.float32)
        for axis in (0, 1)
    )
    read = picture.read(channel, column.reshape(-1, offsets.shape[1]), row.reshape(-1, offsets.shape[1]))
    return np.asarray(read.reshape(column.shape).sum(axis=0, dtype=float) / len(ALONG_PX))


def _bend(seen: VisibleLines) -> Array:
    """Return 1 / radius (N,) of the lines in the picture (see `_profiles`), from the neighbours on the same marking."""
    rise, run = np.zeros(len(seen)), np.zeros(len(seen))
    together = (np.diff(seen.index) == 1) & (np.diff(seen.points.marking) == 0)
    step = np.diff(seen.pixel, axis=0)[together]
    here, there = np.flatnonzero(together), np.flatnonzero(together) + 1
    for at, sign in ((here, 1), (there, -1)):
        across = sign * np.sum(step * seen.normal[at], axis=1)
        rise[at] += across
        run[at] += np.sum(step**2, axis=1) - across**2
    return np.divide(2 * rise, run, out=np.zeros(len(seen)), where=run > 0)
