"""`Panorama.picture` at the speed of video: the same picture, of planes and into planes, by tables made once.

What is done in advance for a panorama, and done anew only when it changes: the view is cut into strips of rows, each
strip into stretches of columns that show one camera alone or a seam, each at one level of detail (halved frames where
the view is coarser than the frame); each stretch has its map as floats, by which OpenCV 5 samples exactly and fastest,
its share of the blend and what its lens takes from the corners. Where seams move, a stretch that is wholly of one
camera for a while is made of that one alone. Light is put on in blue, green and red at the resolution of chroma; what
that does to luma is looked up for grey, and the little that its colour adds is carried over.
"""

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.ground_view import footprint
from worker.calibration.stitching.panorama import BACKDROP, Contribution, Panorama
from worker.calibration.stitching.photometry import NEUTRAL, Light
from worker.video.yuv_planes import BLACK, FROM_PLANES, NO_COLOUR, TO_PLANES, Picture, Plane

# What is worked on at a time fits into a core's cache.
STRIP_ROWS, BLOCK_COLUMNS = 128, 64
LARGEST_LEVEL = 5
# Chroma of two rows lies between them, beside the left one of two columns.
CHROMA_ROW = 0.5
Planes = tuple[Plane, Plane, Plane]
Map = NDArray[np.float32]


@dataclass(frozen=True)
class Share:
    """Opacity of a camera over those drawn earlier, 0 to 1: of luma (H, W) and of each chroma (H/2, W/2)."""

    luma: NDArray[np.float32]
    chroma: NDArray[np.float32]


class Seams(Protocol):
    """Seams that move. `weights` (H, W) by camera: above 0 where it may be shown."""

    weights: Sequence[NDArray[np.float32]]

    @property
    def levels(self) -> Sequence[tuple[int, int]]:
        """Cameras and the levels of detail at which their frames are needed."""
        ...

    def move(self, panorama: Panorama) -> None:
        """Take the sampling maps of a panorama of which sources alone have moved."""
        ...

    def update(self, levels: "Sequence[Mapping[int, Planes]]", shares: Sequence[Share]) -> None:
        """Take the frames of a moment at each level of detail, and put the shares of it in place."""
        ...


class Renderer:
    """Makes pictures of one panorama. `threads`: how many strips are made at a time; `seams`: if they move."""

    def __init__(self, panorama: Panorama, threads: int = 2, seams: Seams | None = None) -> None:
        width, height = panorama.size
        if width % 2 or height % 2:
            raise ValueError(f"a view of {width}x{height} pixels: video takes even numbers only")
        self._seams = seams
        weights = [part.weight for part in panorama.parts] if seams is None else seams.weights
        self._shares = _shares(weights)
        self._views = [_View.of(part) for part in panorama.parts]
        moves = np.any([one != part.weight for one, part in zip(weights, panorama.parts, strict=True)], axis=0)
        self._strips = [
            _strip(panorama, self._shares, moves, slice(top, min(top + STRIP_ROWS, height)))
            for top in range(0, height, STRIP_ROWS)
        ]
        self._levels = _levels_used(self._strips, len(panorama.parts), [] if seams is None else seams.levels)
        self._pool = ThreadPoolExecutor(threads)
        self._weights = [part.weight for part in panorama.parts]
        self.move(panorama)

    def fits(self, panorama: Panorama) -> bool:
        """Return True for a panorama of the same cameras and weights, for which `move` is enough."""
        return len(panorama.parts) == len(self._weights) and all(
            part.weight is weight for part, weight in zip(panorama.parts, self._weights, strict=True)
        )

    def move(self, panorama: Panorama) -> None:
        """Take the sampling maps of a panorama that `fits`; vignetting stays where it was in the view."""
        if self._seams is not None:
            self._seams.move(panorama)
        self._maps = list(
            self._pool.map(
                lambda strip: [
                    _maps(panorama.parts[stretch.camera], strip.rows, stretch) for stretch in strip.stretches
                ],
                self._strips,
            )
        )

    def render(self, pictures: Mapping[str, Picture], onto: Planes) -> None:
        """Make the view of one picture of each camera in planes (H, W), (H/2, W/2), (H/2, W/2)."""
        levels = list(
            self._pool.map(
                lambda view, used: _levels(pictures[view.camera].planes, used) if used else {},
                self._views,
                self._levels,
            )
        )
        if self._seams is not None:
            self._seams.update(levels, self._shares)
        for _ in self._pool.map(lambda strip, maps: self._make(strip, maps, levels, onto), self._strips, self._maps):
            pass

    def close(self) -> None:
        """End the threads."""
        self._pool.shutdown()

    def _make(
        self, strip: "_Strip", maps: "Sequence[_Maps]", levels: Sequence[Mapping[int, Planes]], onto: Planes
    ) -> None:
        rows, half_rows = strip.rows, _halved(strip.rows)
        here = onto[0][rows], onto[1][half_rows], onto[2][half_rows]
        if strip.unseen:
            here[0][:] = round(BLACK + BACKDROP * 219 / 255)
            here[1][:] = here[2][:] = NO_COLOUR
        for stretch, at in zip(strip.stretches, maps, strict=True):
            share = stretch.share
            if stretch.moves:
                least, most = (1, 1) if share is None else cv2.minMaxLoc(share[0])[:2]
                if most == 0 or any(cv2.minMaxLoc(above)[0] == 1 for above in stretch.above):
                    continue
                share = None if least == 1 else share
            columns, half_columns = stretch.columns, _halved(stretch.columns)
            target = here[0][:, columns], here[1][:, half_columns], here[2][:, half_columns]
            view = self._views[stretch.camera]
            source = levels[stretch.camera][stretch.level]
            if share is None and not view.lit:
                _sample(source, at, target)
                continue
            made: Sequence[Any] = [np.empty(plane.shape, np.uint8) for plane in target]
            _sample(source, at, made)
            if view.lit:
                made = _corrected(view, stretch, made)
            for plane, new, opacity in zip(target, made, share or 3 * (None,), strict=True):
                plane[:] = new if opacity is None else cv2.blendLinear(new, plane, opacity, 1 - opacity)


@dataclass(frozen=True)
class _View:
    """Photometric correction of a camera: look-up `tones` (256, 3) of blue, green and red, `luma` (256,) of grey."""

    camera: str
    lit: bool
    tones: Plane
    luma: Plane
    falloff: float

    @classmethod
    def of(cls, part: Contribution) -> "_View":
        light: Light = part.light
        tones = light.tones
        grey = np.clip((np.arange(256) - BLACK) * 255 / 219, 0, 255)
        bent = np.stack([np.interp(grey, np.arange(256), tones[:, colour]) for colour in range(3)], axis=-1)
        luma = bent @ TO_PLANES[0, :3] + BLACK
        return cls(
            part.camera, replace(light, reach=0.0) != NEUTRAL, _rounded(tones)[:, None], _rounded(luma), light.falloff
        )


@dataclass(frozen=True)
class _Stretch:
    """Columns of a strip that show one camera at one level of detail.

    `share`: how much it counts before what is already there, of luma and of each chroma; None: alone. `moves`: if that
    changes; `above` (h, w): opacities of luma of cameras that are drawn over it. `rise`: what its lens takes from the
    corners: of luma (h, w), of luma at the resolution of chroma (h/2, w/2) and of colours (h/2, w/2, 3), in 255ths of
    `steepest`.
    """

    camera: int
    level: int
    columns: slice
    share: tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]] | None
    moves: bool
    above: Sequence[NDArray[np.float32]]
    rise: tuple[Plane, Plane, Plane] | None
    steepest: float


@dataclass(frozen=True)
class _Strip:
    rows: slice
    unseen: bool
    stretches: Sequence[_Stretch]


@dataclass(frozen=True)
class _Maps:
    """Sampling maps of a stretch, for luma and for chroma."""

    luma: Map
    chroma: Map


# In advance


def _shares(weights: Sequence[NDArray[np.float32]]) -> list[Share]:
    """Return the opacities of cameras by their weights (H, W): each camera before all that were drawn earlier."""
    already = np.zeros_like(weights[0])
    found = []
    for weight in weights:
        already += weight
        share = np.where(weight > 0, weight / np.maximum(already, 1e-9), 0).astype(np.float32)
        share[share > 1 - 1e-6] = 1
        found.append(Share(share, ((share[::2, ::2] + share[1::2, ::2]) / 2).astype(np.float32)))
    return found


def _strip(panorama: Panorama, shares: Sequence[Share], moves: NDArray[np.bool_], rows: slice) -> _Strip:
    stretches: list[_Stretch] = []
    for number, part in enumerate(panorama.parts):
        stretches += _stretches(number, part, rows, shares[number:], moves[rows])
    unseen = ~np.any([share.luma[rows] > 0 for share in shares], axis=0)
    return _Strip(rows, bool(unseen.any()), stretches)


def _stretches(
    number: int, part: Contribution, rows: slice, shares: Sequence[Share], moves: NDArray[np.bool_]
) -> list[_Stretch]:
    """Return the stretches of a strip where a camera counts, by its share and those of cameras drawn over it.

    Blocks are merged but where seams move (h, w): there each may be wholly of one camera for a while.
    """
    source, share = part.source[rows], shares[0].luma[rows]
    chroma = shares[0].chroma[_halved(rows)]
    kinds: list[tuple[slice, int, bool, int | None]] = []
    for left in range(0, share.shape[1], BLOCK_COLUMNS):
        block = slice(left, min(left + BLOCK_COLUMNS, share.shape[1]))
        counts = share[:, block] > 0
        if not counts.any() or any((above.luma[rows, block] == 1).all() for above in shares[1:]):
            kinds.append((block, -1, False, None))
            continue
        opaque = bool((share[:, block] == 1).all())
        kinds.append((block, median_level(source[:, block], counts), opaque, left if moves[:, block].any() else None))
    found = []
    for (level, opaque, moving), blocks in groupby(kinds, key=lambda kind: kind[1:]):
        if level >= 0:
            together = [block for block, *_ in blocks]
            columns = slice(together[0].start, together[-1].stop)
            own = None if opaque else (share[:, columns], *2 * (chroma[:, _halved(columns)],))
            above = [one.luma[rows, columns] for one in shares[1:]]
            rise = _rise(part, source[:, columns], _between(source[:, columns], own))
            found.append(_Stretch(number, level, columns, own, moving is not None, above, *rise))
    return found


def median_level(source: NDArray[np.float32], counts: NDArray[np.bool_]) -> int:
    """Return how often a frame is halved before it is sampled, as the view's resolution allows (see `sampled`)."""
    area = float(np.median(footprint(source[..., 0], source[..., 1])[counts]))
    return int(np.clip(np.floor(0.5 * np.log2(max(area, 1.0))), 0, LARGEST_LEVEL))


def _maps(part: Contribution, rows: slice, stretch: _Stretch) -> _Maps:
    source = part.source[rows, stretch.columns]
    chroma = (_between(source, stretch.share) - np.array([0, CHROMA_ROW], np.float32)) / np.float32(2)
    return _Maps(sampling_map(source, stretch.level), sampling_map(chroma, stretch.level))


def _between(source: NDArray[np.float32], share: Sequence[NDArray[np.float32]] | None) -> NDArray[np.float32]:
    """Return the sampling places of chroma, one for 2 x 2 pixels: left, between the upper and lower that are seen."""
    upper, lower = source[::2, ::2], source[1::2, ::2]
    between = (upper + lower) / np.float32(2)
    if share is None:
        return between
    seen = share[0][::2, ::2, None] > 0, share[0][1::2, ::2, None] > 0
    return np.where(seen[0] & ~seen[1], upper, np.where(seen[1] & ~seen[0], lower, between))


def sampling_map(source: NDArray[np.float32], level: int) -> Map:
    """Return the map (h, w, 2) to sample a plane that was halved `level` times at places (h, w, 2) of the whole one."""
    at = (source + np.float32(0.5)) / np.float32(1 << level) - np.float32(0.5) if level else source
    return np.ascontiguousarray(at)


def _rise(
    part: Contribution, source: NDArray[np.float32], between: NDArray[np.float32]
) -> tuple[tuple[Plane, Plane, Plane] | None, float]:
    if part.light.falloff == 0:
        return None, 0.0
    luma, chroma = (part.light.rise(at, part.frame_size) - 1 for at in (source, between))
    steepest = float(max(np.abs(luma).max(), np.abs(chroma).max(), 1e-6))
    of_luma, of_chroma = (_rounded(255 * np.abs(change) / steepest) for change in (luma, chroma))
    return (of_luma, of_chroma, np.repeat(of_chroma[..., None], 3, axis=-1)), float(
        np.copysign(steepest, part.light.falloff)
    )


def _levels_used(strips: Sequence[_Strip], cameras: int, more: Sequence[tuple[int, int]]) -> list[list[int]]:
    used: list[set[int]] = [{level for number, level in more if number == camera} for camera in range(cameras)]
    for strip in strips:
        for stretch in strip.stretches:
            used[stretch.camera].add(stretch.level)
    return [sorted(levels) for levels in used]


def _rounded(values: NDArray[np.floating[Any]]) -> Plane:
    rounded: Plane = np.clip(np.rint(values), 0, 255).astype(np.uint8)
    return rounded


def _halved(extent: slice) -> slice:
    return slice(extent.start // 2, extent.stop // 2)


# For each picture


def _levels(planes: Planes, used: Sequence[int]) -> dict[int, Planes]:
    """Return the planes at each level of detail that is used."""
    found = {0: planes}
    for level in range(1, used[-1] + 1):
        luma, blue, red = (_shrunk(plane) for plane in found[level - 1])
        found[level] = luma, blue, red
    return found


def _shrunk(plane: Plane) -> Plane:
    height, width = plane.shape
    even = plane[: max(height // 2 * 2, 1), : max(width // 2 * 2, 1)]
    size = max(width // 2, 1), max(height // 2, 1)
    return np.asarray(cv2.resize(even, size, interpolation=cv2.INTER_AREA), np.uint8)


def _sample(source: Planes, maps: _Maps, target: Sequence[Plane]) -> None:
    for plane, at, onto in zip(source, (maps.luma, maps.chroma, maps.chroma), target, strict=True):
        sample_plane(plane, at, onto)


def sample_plane(plane: Plane, places: Map, onto: Plane | None = None) -> Any:
    """Return what a plane shows at places (h, w, 2) of it, made in `onto` (h, w) if there is one."""
    no_second_map: Any = None
    return cv2.remap(plane, places, no_second_map, cv2.INTER_LINEAR, onto, cv2.BORDER_REPLICATE)


def _corrected(view: _View, stretch: _Stretch, planes: Sequence[Any]) -> Sequence[Any]:
    """Return the planes with the camera's photometric correction."""
    luma, blue, red = planes
    coarse: Any = cv2.resize(luma, (blue.shape[1], blue.shape[0]), interpolation=cv2.INTER_AREA)
    colours: Any = cv2.LUT(cv2.transform(cv2.merge((coarse, blue, red)), FROM_PLANES), view.tones)
    luma, coarse = cv2.LUT(luma, view.luma), cv2.LUT(coarse, view.luma)
    if stretch.rise is not None:
        of_luma, of_coarse, of_colours = stretch.rise
        colours = _raised(colours, of_colours, stretch.steepest, 0)
        luma = _raised(luma, of_luma, stretch.steepest, BLACK)
        coarse = _raised(coarse, of_coarse, stretch.steepest, BLACK)
    evened, blue, red = cv2.split(cv2.transform(colours, TO_PLANES))
    # What its colour adds to the luma of a pixel, around 128 so that it fits into a byte.
    added = cv2.addWeighted(evened, 1, coarse, -1, NO_COLOUR)
    added = cv2.resize(added, (luma.shape[1], luma.shape[0]), interpolation=cv2.INTER_LINEAR)
    return cv2.addWeighted(luma, 1, added, 1, -NO_COLOUR), blue, red


def _raised(values: Any, part: Plane, steepest: float, black: Any) -> Any:
    """Return values with the vignetting of the lens removed from what is above `black`."""
    above = cv2.subtract(values, black) if black else values
    change = cv2.multiply(above, part, scale=abs(steepest) / 255)
    return cv2.add(values, change) if steepest > 0 else cv2.subtract(values, change)
