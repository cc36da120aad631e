"""Evidence for expected lines: the share of them that is found, beside the share that chance would find.

Two witnesses see a piece of line: the network's response, and a ridge of the expected direction, width and polarity
that goes on along the line. The second needs no training and sees lines on any ground. What chance would find is read
off the same picture: the same pieces, looked for beside themselves.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.contrast import Channels
from worker.calibration.detection.line_matching import LEAST_ALONG, match_lines
from worker.calibration.detection.sampling import bilinear
from worker.calibration.geometry.arrays import Array, take_rows
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import LinePoints
from worker.calibration.geometry.visibility import VisibleLines

TOLERANCE_PX = 3.0
"""Distance from its expected place within which a line counts as found, in pixels of a 4K frame; 2 px at least."""
LEAST_ROOM = 0.5
"""Least share that chance leaves to be found: where it finds more than the other half, finding the rest says nothing
more."""
MARKING = 0.5
"""Probability from which the network sees a marking in a pixel."""


@dataclass(frozen=True)
class Evidence:
    """Evidence for M pieces of expected line of one camera.

    `index` (M,): which line points; `marking` (M,): which of the markings; `weight` (M,): px of line, less where it is
    thinner than a pixel; `found` (M,): whether it is seen where it is expected; `chance` (M,): how often, 0..1, a piece
    is seen as near to a place beside it.
    """

    index: NDArray[np.intp]
    marking: NDArray[np.intp]
    weight: Array
    found: NDArray[np.bool_]
    chance: Array

    @property
    def share(self) -> float:
        """Share of the expected length that is found, 0..1."""
        return _mean(self.found, self.weight)

    @property
    def by_chance(self) -> float:
        """Share of the expected length that chance would find anywhere, 0..1."""
        return _mean(self.chance, self.weight)

    @property
    def agreement(self) -> float:
        """Share found beyond chance: 1 where all lines are found, 0 where no more than anywhere (Cohen, 1960)."""
        return (self.share - self.by_chance) / max(1.0 - self.by_chance, LEAST_ROOM)

    def for_marking(self, marking: int) -> "Evidence":
        """Return the evidence for one marking."""
        return take_rows(self, self.marking == marking)

    def seen(self) -> NDArray[np.intp]:
        """Return the markings that are found clearly more often than chance would: what else fits them is no line."""
        return np.array(
            [marking for marking in np.unique(self.marking) if self.for_marking(marking).is_seen], dtype=np.intp
        )

    @property
    def is_seen(self) -> bool:
        """True if these pieces, of one marking, are found clearly more often than by chance."""
        # Least length of a marking for it to be seen: on less, chance is not rare enough.
        long_enough = self.weight.sum() >= 15.0
        # Share of a marking that has to be found beyond chance for it to be seen, 0..1.
        return bool(long_enough and self.share - self.by_chance >= 0.3)


def _mean(values: Array | NDArray[np.bool_], weight: Array) -> float:
    total = float(weight.sum())
    return float(np.sum(values * weight)) / total if total else 0.0


def evidence_of(
    lines: LinePoints,
    camera: Camera,
    channels: Channels,
    response: NDArray[np.float32],
    left_out: NDArray[np.bool_] | None = None,
) -> Evidence:
    """Return the evidence in a frame for `lines` where the pose of `camera` puts them.

    `channels` of the frame; `response` (H, W) the segmentation in 0..1; `left_out` (H, W): where chance has no try.
    """
    scale = camera.intrinsics.relative_size
    # Distance to each side in which chance is given its tries, in pixels of a 4K frame; 24 px at least.
    tolerance, reach = max(TOLERANCE_PX * scale, 2.0), max(40.0 * scale, 24.0)
    seen = VisibleLines.from_camera(lines, camera)
    parts = []
    for matches in match_lines(seen, channels, tolerance + reach, scale):
        pieces = seen[matches.which]
        where = pieces.pixel[:, None] + matches.shifts[None, :, None] * pieces.normal[:, None]
        network = bilinear(response, where) / (MARKING * np.minimum(pieces.width_px, 1.0))[:, None]
        strength = np.maximum(matches.along / LEAST_ALONG, network)
        near = np.abs(matches.shifts) <= tolerance
        away = np.abs(matches.shifts) > min(2 * tolerance + pieces.width_px.max(initial=0) / 2, reach)
        # As many shifts at a time as there are around the expected place, and all that there are beside a wide line.
        tries = min(int(near.sum()), int(away.sum()))
        hits = _any_of(strength[:, away] >= 1, tries)
        parts.append(
            Evidence(
                pieces.index,
                pieces.points.marking,
                pieces.length_px * np.minimum(pieces.width_px, 1.0),
                np.asarray((strength[:, near] >= 1).any(axis=1)),
                hits.mean(axis=1)
                if left_out is None
                else _mean_of_tries(hits, _any_of(_inside(left_out, where[:, away]), tries)),
            )
        )
    return Evidence(*(np.concatenate(column) for column in zip(*(vars(part).values() for part in parts), strict=True)))


def _any_of(hit: NDArray[np.bool_], count: int) -> NDArray[np.bool_]:
    """True (M, G) for groups of `count` neighbouring columns (M, S) in which any is hit."""
    groups = hit.shape[1] // count
    return np.asarray(hit[:, : groups * count].reshape(len(hit), groups, count).any(axis=2))


def _inside(area: NDArray[np.bool_], pixels: Array) -> NDArray[np.bool_]:
    """True for pixels (..., 2) in an area (H, W)."""
    height, width = area.shape
    column, row = (np.clip(np.rint(pixels[..., n]), 0, last - 1).astype(int) for n, last in ((0, width), (1, height)))
    return area[row, column]


def _mean_of_tries(hits: NDArray[np.bool_], not_tried: NDArray[np.bool_]) -> Array:
    """Return the hit rate (M,) over the tries (M, G) of a piece that count; the others' mean if none does."""
    tried = (~not_tried).sum(axis=1)
    usual = float((hits & ~not_tried).sum()) / max(int(tried.sum()), 1)
    return np.where(tried > 0, (hits & ~not_tried).sum(axis=1) / np.maximum(tried, 1), usual)
