"""Poses proposed from nothing but a frame's lines and the field: the whole search, top to bottom."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Pose
from worker.calibration.geometry.lens import Intrinsics, Lens
from worker.calibration.geometry.rotation import rotation_vectors
from worker.calibration.relocalisation.agreement import agreement
from worker.calibration.relocalisation.climbing import climb
from worker.calibration.relocalisation.drawing import draw
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.hypotheses import Hypotheses
from worker.calibration.relocalisation.line_assignment import positions
from worker.calibration.relocalisation.line_view import LineView
from worker.calibration.relocalisation.rotation_voting import focal_lengths, vote

DIRECTIONS_KNOWN, DIRECTIONS_UNKNOWN = 24, 36
POSITIONS_KNOWN, POSITIONS_UNKNOWN = 220, 120
FIRST_TOLERANCE_PX, DRAWN_TOLERANCE_PX = 8.0, 10.0
CLIMBING_KNOWN, CLIMBING_UNKNOWN = 60, 160
CLEARLY_FOUND = 0.45
"""Agreement from which nothing is drawn at random: what was found from lines is better than any draw."""
DRAWN, CLIMBING_DRAWN = 20000, 120
BENDS = (0.0, -0.07)
"""Of unknown lenses: the radial term k1 at half the width of the frame, which tells lenses of one bend apart from
those of another whatever their focal length."""


@dataclass(frozen=True)
class Proposal:
    """A lens at a pose, and how well the lines agree with it both ways, 0..1."""

    lens: Lens
    pose: Pose
    agreement: float


def propose(
    field: FieldMap, response: NDArray[np.uint8], lenses: Sequence[Lens], is_known: bool, seed: int
) -> list[Proposal]:
    """Return cameras that may have seen `response` (height, width), 0..255, the best first.

    `lenses`: through which the frame may have been taken; `is_known`: their focal lengths are, or else all usual ones
    are tried.
    """
    rng = np.random.default_rng(seed)
    found = [one for lens in lenses for one in _through(field, LineView.of(response, lens), lens, is_known, rng)]
    return sorted(found, key=lambda one: -one.agreement)


def unknown_lenses(size: tuple[int, int]) -> list[Lens]:
    """Lenses of each bend for a frame (width, height) about whose lens nothing is known; focal length: the width."""
    width, height = size
    matrix = np.array([[width, 0.0, (width - 1) / 2], [0.0, width, (height - 1) / 2], [0.0, 0.0, 1.0]])
    # k1 counts in the square of the distance from the centre, in focal lengths.
    return [Intrinsics(matrix, np.array([4 * bend, 0.0, 0.0, 0.0]), size) for bend in BENDS]


def _through(field: FieldMap, view: LineView, lens: Lens, is_known: bool, rng: np.random.Generator) -> list[Proposal]:
    """The proposals for one lens: by lines first, by random draws only where lines do not suffice."""
    focal = focal_lengths(view, is_known)
    directions = vote(view, focal, DIRECTIONS_KNOWN if is_known else DIRECTIONS_UNKNOWN, rng)
    most = POSITIONS_KNOWN if is_known else POSITIONS_UNKNOWN
    by_lines = Hypotheses.joined([positions(field, view, one, most) for one in directions])
    start = _best(field, view, by_lines, FIRST_TOLERANCE_PX, CLIMBING_KNOWN if is_known else CLIMBING_UNKNOWN)
    found, scores = climb(field, view, start, not is_known, rng)
    if scores.max(initial=0.0) < CLEARLY_FOUND:
        drawn = draw(field, focal, DRAWN, rng)
        by_draws = _best(field, view, drawn, DRAWN_TOLERANCE_PX, CLIMBING_DRAWN)
        also, theirs = climb(field, view, Hypotheses.joined([by_draws, found]), not is_known, rng)
        found, scores = also, theirs
    return [
        Proposal(_zoomed(lens, focal / view.focal_px), Pose(rotation_vectors(rotation), position), float(score))
        for rotation, position, focal, score in zip(
            found.rotations, found.positions, found.focal_px, scores, strict=True
        )
    ]


def _best(field: FieldMap, view: LineView, cameras: Hypotheses, tolerance_px: float, most: int) -> Hypotheses:
    scores: Array = agreement(field, view, cameras, tolerance_px)
    return cameras[np.argsort(-scores)[:most]]


def _zoomed(lens: Lens, by: float) -> Lens:
    """The lens with a focal length so many times as long that bends the picture as it did."""
    if by == 1.0:
        return lens
    matrix = lens.matrix.copy()
    matrix[[0, 1], [0, 1]] *= by
    powers = np.array([2, 4, 1, 1, 6])[: len(lens.distortion)]
    return replace(lens, matrix=matrix, distortion=lens.distortion * by**powers)
