"""Proposals of poses from a frame's lines and the field alone: the whole search, top to bottom."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Pose
from worker.calibration.geometry.lens import Lens
from worker.calibration.geometry.rotation import rotation_vectors
from worker.calibration.relocalisation.agreement import agreement
from worker.calibration.relocalisation.climbing import LEVELS, climb
from worker.calibration.relocalisation.drawing import draw, draw_at
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.hypotheses import FOCAL_SOUGHT, HALF_TURN, LENS_KNOWN, LENS_SOUGHT, Hypotheses
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
    found = [
        proposal
        for lens in sought.lenses
        for proposal in _through(
            field, LineView.of(response, lens.lens, sought.roll_sigma_deg), lens, sought.place, rng
        )
    ]
    return sorted(found, key=lambda one: -one.agreement)


def agreement_by_lines(field: FieldMap, response: NDArray[np.uint8], sought: SoughtCamera, seed: int) -> float:
    """Return the best agreement 0..1 of cameras that the lines of `response` (height, width) lead to, as they are."""
    rng = np.random.default_rng(seed)
    best = 0.0
    for lens in sought.lenses:
        view = LineView.of(response, lens.lens, sought.roll_sigma_deg)
        if view.painted_px > 0:
            directions = vote(view, focal_lengths(view, lens), _most_directions(lens), rng)
            best = max(
                best,
                float(
                    agreement(field, view, _by_lines(field, view, lens, sought.place, directions), CAUGHT_PX).max(
                        initial=0.0
                    )
                ),
            )
    return best


def _most_directions(lens: SoughtLens) -> int:
    return 24 if lens.is_known else 36


def _by_lines(
    field: FieldMap, view: LineView, lens: SoughtLens, place: Place, directions: Sequence[Direction]
) -> Hypotheses:
    """Return the cameras that look in these directions and that assignments of lines to markings lead to."""
    most = 220 if lens.is_known else 120
    return _at(place, field, Hypotheses.joined([positions(field, view, one, most) for one in directions]))


def _through(
    field: FieldMap, view: LineView, lens: SoughtLens, place: Place, rng: np.random.Generator
) -> list[ProposedCamera]:
    """Return the proposals for one lens: by lines first, by random draws only where lines do not suffice."""
    if view.painted_px == 0:
        return []
    focal, known = focal_lengths(view, lens), lens.is_known
    steps = LENS_KNOWN if known else FOCAL_SOUGHT if lens.is_bend_known else LENS_SOUGHT
    directions = _with_neighbours(vote(view, focal, _most_directions(lens), rng), rng)
    by_lines = _by_lines(field, view, lens, place, directions)
    start = _best(field, view, by_lines, CAUGHT_PX, 60 if known else 160)
    found, scores = climb(field, view, start, steps, rng)
    # Agreement from which nothing is drawn at random: a pose found from lines is better than any draw.
    if scores.max(initial=0.0) < 0.45:
        drawn = _drawn(field, focal, view.roll_sigma, place, rng)
        by_draws = _best(field, view, drawn, 10.0, 120)
        found, scores = climb(field, view, Hypotheses.joined([by_draws, found]), steps, rng)
    slid = _best(field, view, _at(place, field, slid_along_field(field, found)), LEVELS[-2].tolerance_px, 6)
    found, scores = climb(field, view, Hypotheses.joined([found, slid]), steps, rng, LEVELS[-2:])
    return [
        ProposedCamera(
            _zoomed(_bent_more(lens.lens, bend), focal / view.focal_px),
            Pose(rotation_vectors(rotation), position),
            float(score),
        )
        for rotation, position, focal, bend, score in zip(
            found.rotations, found.positions, found.focal_px, found.bends, scores, strict=True
        )
    ]


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
        for _ in range(6)
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
    scores: Array = agreement(field, view, cameras, tolerance_px)
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
