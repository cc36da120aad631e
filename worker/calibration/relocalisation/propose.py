"""Proposals of poses from a frame's lines and the field alone: the whole search, top to bottom."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Pose
from worker.calibration.geometry.lens import Lens
from worker.calibration.geometry.rotation import rotation_vectors
from worker.calibration.relocalisation.agreement import agreement
from worker.calibration.relocalisation.climbing import LEVELS, ClimbingRound, climb
from worker.calibration.relocalisation.drawing import draw, draw_at
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.hypotheses import (
    FOCAL_SOUGHT,
    HALF_TURN,
    LENS_KNOWN,
    LENS_SOUGHT,
    Hypotheses,
    LensSteps,
)
from worker.calibration.relocalisation.line_assignment import positions
from worker.calibration.relocalisation.line_view import LineView
from worker.calibration.relocalisation.repeated_markings import slid_along_field
from worker.calibration.relocalisation.rotation_voting import Direction, focal_lengths, vote
from worker.calibration.relocalisation.sought import Place, SoughtCamera, SoughtLens

CAUGHT_PX = 8.0
"""Tolerance (view px) at which cameras that lines lead to are compared, before they have climbed."""


@dataclass(frozen=True)
class ProposedCamera:
    """Lens and pose, with their agreement with the lines both ways, 0..1."""

    lens: Lens
    pose: Pose
    agreement: float


def propose(field: FieldMap, response: NDArray[np.uint8], sought: SoughtCamera, seed: int) -> list[ProposedCamera]:
    """Return cameras that may have seen `response` (height, width), 0..255, the best first.

    On a field that looks the same turned by half a turn, one of each two cameras, at a place where it may stand.
    """
    rng = np.random.default_rng(seed)
    # Agreement of a pose found from lines, through its lens, that is better than any draw or another lens leads to.
    convincing = 0.45
    searches = list[_Search]()
    for lens, view in _views(response, sought):
        searches.append(_Search.by_lines(field, view, lens, sought.place, rng))
        if searches[-1].best >= convincing:
            break
    else:
        searches = [search.with_draws(rng) for search in searches]
    proposals = [one for search in searches for one in search.with_repeated_markings(rng).proposals()]
    return sorted(proposals, key=lambda one: -one.agreement)


def agreement_by_lines(field: FieldMap, response: NDArray[np.uint8], sought: SoughtCamera, seed: int) -> float:
    """Return the best agreement 0..1 of cameras that the lines of `response` (height, width) lead to, as they are."""
    rng = np.random.default_rng(seed)
    best = 0.0
    for lens, view in _views(response, sought):
        cameras = _by_lines(field, view, lens, sought.place, _directions(view, lens, rng))
        best = max(best, float(agreement(field, view, cameras, CAUGHT_PX).max(initial=0.0)))
    return best


def _views(response: NDArray[np.uint8], sought: SoughtCamera) -> Iterator[tuple[SoughtLens, LineView]]:
    """Yield the lenses that are possible with the view of the lines through each, if there are any."""
    for lens in sought.lenses:
        view = LineView.of(response, lens.lens, sought.roll_sigma_deg)
        if view.painted_px > 0:
            yield lens, view


@dataclass(frozen=True)
class _Search:
    """The search through one lens: cameras `found` so far that have climbed, and their agreements (P,)."""

    field: FieldMap
    view: LineView
    lens: SoughtLens
    place: Place
    found: Hypotheses
    scores: Array

    @classmethod
    def by_lines(
        cls, field: FieldMap, view: LineView, lens: SoughtLens, place: Place, rng: np.random.Generator
    ) -> "_Search":
        """Climb from cameras that lines lead to."""
        directions = _with_neighbours(_directions(view, lens, rng), rng)
        cameras = _by_lines(field, view, lens, place, directions)
        start = _best(field, view, cameras, CAUGHT_PX, 160)
        return cls(field, view, lens, place, *climb(field, view, start, _steps(lens), rng))

    @property
    def best(self) -> float:
        """Return the best agreement."""
        return float(self.scores.max(initial=0.0))

    def with_draws(self, rng: np.random.Generator) -> "_Search":
        """Climb from what was found and from cameras drawn at random."""
        drawn = _drawn(self.field, focal_lengths(self.view, self.lens), self.view.roll_sigma, self.place, rng)
        return self._climbed(_best(self.field, self.view, drawn, 10.0, 120), LEVELS, rng)

    def with_repeated_markings(self, rng: np.random.Generator) -> "_Search":
        """Climb from what was found and from what looks alike where markings are repeated."""
        slid = _at(self.place, self.field, slid_along_field(self.field, self.found))
        return self._climbed(_best(self.field, self.view, slid, LEVELS[-2].tolerance_px, 6), LEVELS[-2:], rng)

    def _climbed(self, more: Hypotheses, levels: Sequence[ClimbingRound], rng: np.random.Generator) -> "_Search":
        start = Hypotheses.joined([self.found, more])
        found, scores = climb(self.field, self.view, start, _steps(self.lens), rng, levels)
        return replace(self, found=found, scores=scores)

    def proposals(self) -> Iterator[ProposedCamera]:
        """Yield the cameras that were found."""
        found = self.found
        for rotation, position, focal, bend, score in zip(
            found.rotations, found.positions, found.focal_px, found.bends, self.scores, strict=True
        ):
            lens = _zoomed(_bent_more(self.lens.lens, bend), focal / self.view.focal_px)
            yield ProposedCamera(lens, Pose(rotation_vectors(rotation), position), float(score))


def _steps(lens: SoughtLens) -> LensSteps:
    if lens.is_known:
        return LENS_KNOWN
    return FOCAL_SOUGHT if lens.is_bend_known else LENS_SOUGHT


def _directions(view: LineView, lens: SoughtLens, rng: np.random.Generator) -> list[Direction]:
    return vote(view, focal_lengths(view, lens), 24 if lens.is_known else 36, rng)


def _by_lines(
    field: FieldMap, view: LineView, lens: SoughtLens, place: Place, directions: Sequence[Direction]
) -> Hypotheses:
    """Return the cameras that look in these directions and that assignments of lines to markings lead to."""
    most = 220 if lens.is_known else 120
    return _at(place, field, Hypotheses.joined([positions(field, view, one, most) for one in directions]))


def _drawn(field: FieldMap, focal: Array, roll_sigma: float, place: Place, rng: np.random.Generator) -> Hypotheses:
    """Draw cameras at random: where they are known to stand, or else from where fields are filmed."""
    if place.position is None:
        return _at(place, field, draw(field, focal, roll_sigma, 20000, rng))
    drawn = draw_at(field, focal, roll_sigma, place.position, place.radius_m, 6000, rng)
    return _at(place, field, drawn)


def _with_neighbours(directions: list[Direction], rng: np.random.Generator) -> list[Direction]:
    """Return the directions, and some around the best ones: votes of a noisy picture are off by a degree."""
    return directions + [
        replace(one, pan_tilt_roll=one.pan_tilt_roll + np.radians((1.5, 1.5, 0.5)) * rng.normal(size=3))
        for one in directions[:6]
        for _ in range(2)
    ]


def _at(place: Place, field: FieldMap, cameras: Hypotheses) -> Hypotheses:
    """Return the cameras that stand where they may, on a symmetric field after half a turn of it if needed."""
    if place.is_anywhere:
        return cameras
    here = place.allows(cameras.positions)
    if not field.is_symmetric:
        return cameras[here]
    turned = Hypotheses(cameras.rotations @ HALF_TURN, cameras.positions @ HALF_TURN, cameras.focal_px, cameras.bends)
    return Hypotheses.joined([cameras[here], turned[place.allows(turned.positions) & ~here]])


def _best(field: FieldMap, view: LineView, cameras: Hypotheses, tolerance_px: float, most: int) -> Hypotheses:
    if len(cameras) > 4 * most:
        # A quarter of the points tells which three quarters of them are hopeless.
        cameras = _first(cameras, agreement(field.thinned, view.thinned, cameras, tolerance_px), len(cameras) // 4)
    return _first(cameras, agreement(field, view, cameras, tolerance_px), most)


def _first(cameras: Hypotheses, scores: Array, most: int) -> Hypotheses:
    return cameras[np.argsort(-scores)[:most]]


def _bent_more(lens: Lens, bend: float) -> Lens:
    """Return the lens behind another one that bends by a part at half the width of the frame, up to fourth powers."""
    if bend == 0.0:
        return lens
    distortion = lens.distortion.copy()
    more = bend * (2 * lens.focal_length_px / lens.size[0]) ** 2
    distortion[:2] += [more, 3 * distortion[0] * more]
    return replace(lens, distortion=distortion)


def _zoomed(lens: Lens, by: float) -> Lens:
    """Return the lens with a focal length so many times as long that bends the picture as before."""
    if by == 1.0:
        return lens
    matrix = lens.matrix.copy()
    matrix[[0, 1], [0, 1]] *= by
    powers = np.array([2, 4, 1, 1, 6])[: len(lens.distortion)]
    return replace(lens, matrix=matrix, distortion=lens.distortion * by**powers)
