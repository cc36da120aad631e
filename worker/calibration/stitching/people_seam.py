"""Seams that go around people: where two cameras differ on the ground, all of a person is shown by one of them.

The maps of a view are those of the ground. What stands on it is shown by each camera elsewhere, its feet alone at one
place, so that a seam between the two cuts or doubles it. Shadows and lines lie on the ground: both cameras agree there.
A place near a seam is taken by people where the difference of its cameras is not what it was over the last seconds.
The hull of such places becomes one camera's: the cut then runs along its outline, where both show the ground. Labels of
hulls have a memory: a person keeps a camera until all of it is well beyond the seam, and changes in one moment.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import inside
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.ground_view import box, footprint
from worker.calibration.stitching.panorama import Contribution, Panorama, every_nth_pixel, every_pixel
from worker.calibration.stitching.views import StitchedView

Mask = NDArray[np.uint8]
Values = NDArray[np.float32]


@dataclass(frozen=True)
class SeamModel:
    """Differences of people from the ground beside a seam, and the ways of seams around them.

    `cell_px`: cell of the grid, in pixels of a view of `cell_columns`, and no finer than those of a frame. `reach`:
    distance from a seam, in widths of the view, up to which people are looked for: a near player with arms stretched.
    `frame_border`: what is nearer to the border of a frame, in its widths, is half outside of it. `margin`: cells over
    which one camera passes into the other beside people; `clear`: cells beyond the seam from which on a person changes
    the camera. `faint`, `outright`: differences that are of people, in mean differences, and at least, as the sum of
    three colours' levels; faint ones count where they hang together with more outright ones than noise makes,
    `speck_cells`. `astray`: cells by which two calibrated cameras may show a line apart. `noise_cells`: side of a
    square in which noise is alike, larger than anybody. `ground_s`, `standing_s`: seconds in which what stays becomes a
    part of the ground, where nobody is, and where somebody stands. `crowd`: share of a band above which it does not
    differ because of people: a light went on, or a camera changed its exposure.
    """

    cell_px: int = 2
    cell_columns: int = 1920
    reach: float = 0.2
    frame_border: float = 0.002
    margin: int = 3
    clear: int = 8
    faint: tuple[float, float] = (3.0, 6.0)
    outright: tuple[float, float] = (5.5, 12.0)
    speck_cells: int = 2
    astray: float = 0.125
    noise_cells: int = 41
    ground_s: float = 1.0
    standing_s: float = 30.0
    crowd: float = 0.6


MODEL = SeamModel()


@dataclass
class SeamBand:
    """Band of a view along the seam of two cameras, on a grid of cells, and its memory.

    `cameras`: their numbers; `cell_px`; `around`: rows and columns of cells in the view; `zone` (h, w): 1 in the band;
    `second` (h, w): 1 where the second camera is the better one; `pitch` (h, w): 1 on the field. `rate`: of moments, a
    second.
    """

    cameras: tuple[int, int]
    cell_px: int
    around: tuple[slice, slice]
    zone: Mask
    second: Mask
    pitch: Mask
    rate: float
    _ground: Values | None = field(default=None, init=False)
    _noise: Values = field(init=False)
    _hulls: Mask = field(init=False)
    _labels: Mask = field(init=False)
    _edge: Mask = field(init=False)
    _clearance: Values = field(init=False)

    def __post_init__(self) -> None:
        """Compute distances to the seam, and the edge of the band."""
        self._hulls, self._labels = np.zeros_like(self.zone), self.second.copy()
        self._edge = self.zone & np.asarray(cv2.dilate(1 - self.zone, _square(3)))
        seam = np.asarray(cv2.morphologyEx(self.second, cv2.MORPH_GRADIENT, _square(3)))
        self._clearance = np.asarray(cv2.distanceTransform(1 - seam, cv2.DIST_L2, 3), np.float32)

    @property
    def pixels(self) -> tuple[slice, slice]:
        """Rows and columns of the view."""
        rows, columns = (slice(self.cell_px * part.start, self.cell_px * part.stop) for part in self.around)
        return rows, columns

    def update(self, first: Values, second: Values) -> tuple[Values, Values]:
        """Take what both cameras show (h, w, 3) of a moment, evened out; return where people are, and who shows them.

        The first answer (h, w) is 1 in hulls of people, falling to 0 around them; the second is there how much the
        second camera counts.
        """
        difference = np.asarray(cv2.blur(first - second, (3, 3)), np.float32)
        if self._ground is None:
            self._begin(difference, np.minimum(_steepness(first), _steepness(second)))
        apart = self._apart(difference)
        faint, outright = (
            (self._is_apart(apart, least) & (self.zone > 0)).astype(np.uint8) for least in (MODEL.faint, MODEL.outright)
        )
        if np.count_nonzero(faint) > MODEL.crowd * np.count_nonzero(self.zone):
            self._ground, faint = difference, np.zeros_like(faint)
        # Who was seen outright a moment ago is still there.
        people = _people(faint, outright | (faint & self._hulls)) & self.zone
        hulls = _hulls(people) & self.zone
        self._learn(difference, apart, faint | hulls)
        self._labels, self._hulls = self._labelled(people, hulls), hulls
        return self._blended(hulls, self._labels)

    def _begin(self, difference: Values, steepness: Values) -> None:
        """Take for ground what stands beyond the field, and on it what a line shown a little apart makes.

        People may be on the field from the first on; a line is as steep in both cameras' pictures (h, w, 3).
        """
        on_pitch = (self.zone & self.pitch) > 0
        usual = np.median(difference[on_pitch], axis=0) if on_pitch.any() else 0.0
        self._ground = np.where(self.pitch[..., None] > 0, np.float32(usual), difference)
        apart = self._apart(difference)
        self._noise = np.full(self.zone.shape, np.median(apart[on_pitch]) if on_pitch.any() else 0.0, np.float32)
        reach = MODEL.astray * steepness * self._is_apart(apart, MODEL.faint)[..., None]
        self._ground += np.clip(difference - self._ground, -reach, reach)
        apart = self._apart(difference)
        # Noise differs from place to place: a cell is of many pixels of a frame, or of few. The second time nearly all
        # that is noise counts as such.
        for _ in range(2):
            calm = (on_pitch & ~self._is_apart(apart, MODEL.faint)).astype(np.float32)
            count, total = (cv2.blur(values, 2 * (MODEL.noise_cells,)) for values in (calm, calm * apart))
            self._noise = np.where(np.asarray(count) > 0.05, total / np.maximum(count, 0.05), self._noise)

    def _apart(self, difference: Values) -> Values:
        assert self._ground is not None
        return np.asarray(cv2.transform(cv2.absdiff(difference, self._ground), np.ones((1, 3))), np.float32)

    def _is_apart(self, apart: Values, least: tuple[float, float]) -> NDArray[np.bool_]:
        means, levels = least
        return np.asarray(apart > np.maximum(means * self._noise, levels))

    def _learn(self, difference: Values, apart: Values, taken: Mask) -> None:
        """Follow the ground, hardly where it is taken."""
        share = np.where(taken > 0, np.float32(1 / MODEL.standing_s), np.float32(1 / MODEL.ground_s)) / np.float32(
            self.rate
        )
        assert self._ground is not None
        self._ground += share[..., None] * (difference - self._ground)
        self._noise += np.where(taken > 0, np.float32(0), share) * (apart - self._noise)

    def _labelled(self, people: Mask, hulls: Mask) -> Mask:
        """Return the labels (h, w): 1 for the second camera, by the memory and by where each hull lies."""
        labels = self.second.copy()
        for here, own in _parts(hulls):
            labels[here][own] = self._label(here, own)
            edges = self.second[here][own & (self._edge[here] > 0)]
            if edges.size and edges.min() != edges.max():
                # A crowd from one side of the band to the other: each for himself, and between them as most are.
                crowd = np.zeros_like(hulls)
                crowd[here] = people[here] * own
                each = np.zeros_like(hulls)
                for there, one in _parts(crowd):
                    each[there][one] = self._label(there, one)
                labels[here][own] = 2 * np.count_nonzero(each) > np.count_nonzero(crowd)
                labels[crowd > 0] = each[crowd > 0]
        return labels

    def _label(self, here: tuple[slice, slice], own: NDArray[np.bool_]) -> int:
        """Return 1 if the second camera shows what fills cells (h, w) of some rows and columns."""
        second = self.second[here]
        edges = second[own & (self._edge[here] > 0)]
        if edges.size and edges.min() == edges.max():
            # What reaches beyond the band is shown there by the better camera.
            return int(edges[0])
        better = second[own].mean()
        if better in (0, 1) and self._clearance[here][own].min() > MODEL.clear:
            return int(better)
        before = own & (self._hulls[here] > 0)
        remembers = np.count_nonzero(before) > np.count_nonzero(own) / 8
        return int((self._labels[here][before].mean() if remembers else better) > 0.5)

    def _blended(self, hulls: Mask, labels: Mask) -> tuple[Values, Values]:
        size = 2 * (2 * MODEL.margin + 1,)
        people, second = (cv2.blur(mask.astype(np.float32), size) for mask in (hulls, hulls & labels))
        around = np.minimum(np.asarray(people) * 4, 1).astype(np.float32) * self.zone
        return around, np.asarray(second / np.maximum(people, np.float32(1e-6)), np.float32)


def shows_field(pitch: Field, view: StitchedView) -> NDArray[np.bool_]:
    """Return which pixels (H, W) of a view show the field."""
    ground = np.abs(view.behind(pitch, every_nth_pixel(view.size))[..., :2])
    on_pitch = (ground < [pitch.length / 2, pitch.width / 2]).all(axis=-1)
    return every_pixel(np.asarray(on_pitch), view.size) > 0.5


def seam_bands(
    made: Panorama, pitch: NDArray[np.bool_], rate: float, border: float = MODEL.frame_border
) -> list[SeamBand]:
    """Return the bands of the seams of a panorama.

    `pitch` (H, W): `shows_field`; `rate`: of moments, a second; `border`: of each frame, in its
    widths, that is not used.
    """
    cell = MODEL.cell_px * max(1, round(made.size[0] / MODEL.cell_columns), *map(_enlargement, made.parts))
    rows, columns = (extent // cell for extent in reversed(made.size))
    cells = slice(0, cell * rows, cell), slice(0, cell * columns, cell)
    owner, reach = made.owner[cells], MODEL.reach * made.size[0] / cell
    seen = [
        inside(part.source[cells], part.frame_size, border * part.frame_size[0]) | (part.weight[cells] > 0.99)
        for part in made.parts
    ]
    pairs = [pair for pair in combinations(range(len(made.parts)), 2) if _seam(owner, pair).any()]
    distances = [cv2.distanceTransform(1 - _seam(owner, pair), cv2.DIST_L2, 3) for pair in pairs]
    nearest = np.argmin(distances, axis=0) if pairs else owner
    found = []
    for number, (i, j) in enumerate(pairs):
        both = made.parts[i].weight[cells] + made.parts[j].weight[cells]
        zone = seen[i] & seen[j] & (both > 0.99) & (nearest == number) & (distances[number] < reach)
        if zone.any():
            # A cell more on each side, where there is one.
            top_to_bottom, left_to_right = (
                slice(max(part.start - 1, 0), min(part.stop + 1, extent))
                for part, extent in zip(box(zone), zone.shape, strict=True)
            )
            around = top_to_bottom, left_to_right
            in_band, second, on_pitch = (
                np.ascontiguousarray(mask[around], np.uint8) for mask in (zone, owner == j, pitch[cells])
            )
            found.append(SeamBand((i, j), cell, around, in_band, second, on_pitch, rate))
    return found


def _enlargement(part: Contribution) -> int:
    """Return the view's pixels in a row that one of the camera's frame fills."""
    areas = footprint(part.source[..., 0], part.source[..., 1])[part.weight > 0]
    return round(float(np.median(np.maximum(areas, 1e-6))) ** -0.5) if areas.size else 1


def opened(made: Panorama, bands: Sequence[SeamBand]) -> list[NDArray[np.float32]]:
    """Return the weights (H, W) of each camera, with halves for both cameras of each band."""
    weights = [part.weight.copy() for part in made.parts]
    for band in bands:
        zone = np.kron(band.zone, np.ones((band.cell_px, band.cell_px), np.uint8)) > 0
        for number in band.cameras:
            weights[number][band.pixels][zone] = 0.5
    return weights


def _seam(owner: NDArray[np.int8], pair: tuple[int, int]) -> Mask:
    """1 in cells (h, w) beside the seam of two cameras."""
    around = _square(3)
    first, second = (np.asarray(cv2.dilate((owner == number).astype(np.uint8), around), np.uint8) for number in pair)
    return first & second


def _people(faint: Mask, outright: Mask) -> Mask:
    """Return what differs and its blurred border (h, w), without specks."""
    beside = _square(3)
    grown = cv2.morphologyEx(cv2.dilate(faint, beside), cv2.MORPH_CLOSE, beside)
    _, numbers = cv2.connectedComponents(grown, connectivity=4)
    people = np.bincount(numbers[outright > 0], minlength=int(numbers.max()) + 1) > MODEL.speck_cells
    people[0] = False
    return people[numbers].astype(np.uint8)


def _hulls(people: Mask) -> Mask:
    """Return the convex hulls (h, w), each of what hangs together."""
    outlines, _ = cv2.findContours(people, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    hulls = np.zeros_like(people)
    for outline in outlines:
        cv2.fillConvexPoly(hulls, cv2.convexHull(outline), 1)
    return hulls


def _parts(mask: Mask) -> Iterator[tuple[tuple[slice, slice], NDArray[np.bool_]]]:
    """Yield the rows and columns of each part of a mask that hangs together, and its cells in them."""
    count, numbers, boxes, _ = cv2.connectedComponentsWithStats(mask, connectivity=4)
    for number in range(1, count):
        left, top, width, height, _ = boxes[number].tolist()
        here = slice(top, top + height), slice(left, left + width)
        yield here, numbers[here] == number


def blend_shares(people: Values, second: Values, static: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return how much the second camera counts in a band's pixels (H, W), by `SeamBand.update`; else as `static`."""
    size = static.shape[1], static.shape[0]
    fine, labels = (cv2.resize(part, size, interpolation=cv2.INTER_LINEAR) for part in (people, second))
    return np.asarray(static + np.asarray(fine) * (np.asarray(labels) - static), np.float32)


def _steepness(values: Values) -> Values:
    """Return by how much values (h, w, 3) differ from one of the cells around at most, evened out."""
    around = _square(3)
    rise, fall = cv2.subtract(cv2.dilate(values, around), values), cv2.subtract(values, cv2.erode(values, around))
    return np.asarray(cv2.blur(cv2.max(rise, fall), (3, 3)), np.float32)


def _square(side: int) -> Mask:
    """Return a square of ones (`side`, `side`)."""
    return np.ones((side, side), np.uint8)
