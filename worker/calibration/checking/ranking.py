"""Ranking of the readings of a file by the lines in the frames of its cameras, before anything is calibrated.

Cheap evidence first: a reading by which no camera films the field is none; the others are scored by their agreement
with the lines at a coarse tolerance, the best of these after climbing from there, as proposals of a search are.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from worker.calibration.checking.readings import Reading, poses_of, readings
from worker.calibration.geometry.arrays import Array
from worker.calibration.geometry.camera import Camera, Pose, inside
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.plausible_pose import filming_mask, films_a_field
from worker.calibration.geometry.rotation import rotation_matrices
from worker.calibration.observe import FEWEST_VISIBLE_POINTS
from worker.calibration.recovery import LEAST_PROPOSED
from worker.calibration.relocalisation.agreement import agreement
from worker.calibration.relocalisation.climbing import climb
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.hypotheses import LENS_KNOWN, Hypotheses
from worker.calibration.relocalisation.line_view import LineView

COARSE_PX = 16.0
"""Tolerance in view pixels, 480 a frame: 2 degrees and a half of a usual lens, for a camera that was turned since."""
CLIMBED = 12
"""Readings that are climbed from."""
COST_OF_A_CAUSE = 0.02
"""Agreement that each cause of a reading costs: of two that fit alike the simpler one is meant."""


def rank_readings(
    pitch: Field, cameras: Sequence[Camera], sights: Iterable[Sequence[LineView]], seed: int
) -> list[Reading]:
    """Return the readings under which cameras agree best with their lines, best first, none after the file's word.

    All cameras of a file are written in one convention: they are scored together. `sights`: the views of all of them in
    all colours, or in each of several paints, of which one is the field's: a reading is worth its best.
    """
    field_map, half_sides = FieldMap.of(pitch), np.array([pitch.length, pitch.width]) / 2
    # On a symmetric field half a turn changes nothing: the simpler reading of the same would be tried once more.
    every = [one for one in readings() if not (field_map.is_symmetric and one.is_half_turn)]
    meant = [_Meant.of(pitch, camera, every, half_sides) for camera in cameras]
    cost = COST_OF_A_CAUSE * np.array([len(reading.causes) for reading in every])
    scores: dict[int, float] = {}
    for views in sights:
        for number, score in _scores(field_map, meant, views, cost, seed):
            scores[number] = max(score, scores.get(number, 0.0))
    return [every[number] for number in sorted(scores, key=lambda number: -scores[number])]


def _scores(
    field_map: FieldMap, meant: Sequence["_Meant"], views: Sequence[LineView], cost: Array, seed: int
) -> list[tuple[int, float]]:
    """Return the numbers of the readings that explain `views` of the cameras, with their agreement less the cost."""
    coarse = np.mean([_coarse(field_map, view, its) for view, its in zip(views, meant, strict=True)], axis=0)

    def climbed(n: int) -> float:
        its = [_climbed(field_map, view, one.poses[n], seed) for view, one in zip(views, meant, strict=True)]
        return float(np.mean(its))

    tried = [int(n) for n in np.argsort(cost - coarse, kind="stable")[:CLIMBED] if coarse[n] > 0]
    # The file at its word, which is the first, is the measure of the others.
    scores = {n: climbed(n) - float(cost[n]) for n in {*tried, 0} if coarse[n] > 0}
    at_its_word = scores.get(0, 0.0)
    return [(n, its) for n, its in scores.items() if its + cost[n] >= LEAST_PROPOSED and its >= at_its_word]


@dataclass(frozen=True)
class _Meant:
    """The poses of a camera by every reading; `filming` (P,): which of them show the field and enough of its lines."""

    poses: Sequence[Pose]
    filming: NDArray[np.bool_]

    @classmethod
    def of(cls, pitch: Field, camera: Camera, every: Sequence[Reading], half_sides: Array) -> "_Meant":
        rotations, positions = poses_of(every, camera.pose, half_sides)
        poses = [Pose(*one) for one in zip(rotations, positions, strict=True)]
        plausible = filming_mask(rotation_matrices(rotations), positions)
        filming = [
            maybe and _shows_lines(pitch, camera.with_pose(pose)) for maybe, pose in zip(plausible, poses, strict=True)
        ]
        return cls(poses, np.array(filming))


def films_the_field(pitch: Field, camera: Camera) -> bool:
    """True if a camera films the field, and enough of its markings to be calibrated by."""
    return films_a_field(camera.pose) and _shows_lines(pitch, camera)


def _shows_lines(pitch: Field, camera: Camera) -> bool:
    lines = pitch.line_points()
    return int(inside(camera.project(lines.position), camera.intrinsics.size).sum()) >= FEWEST_VISIBLE_POINTS


def _coarse(field_map: FieldMap, view: LineView, meant: _Meant) -> Array:
    """Return the agreement (P,) of each pose with a view, 0 for those that film no field."""
    found = np.zeros(len(meant.poses))
    chosen = np.flatnonzero(meant.filming)
    if len(chosen):
        found[chosen] = agreement(field_map, view, _hypotheses([meant.poses[int(n)] for n in chosen], view), COARSE_PX)
    return found


def _climbed(field_map: FieldMap, view: LineView, pose: Pose, seed: int) -> float:
    """Return the agreement that is reached from a pose."""
    _, scores = climb(field_map, view, _hypotheses([pose], view), LENS_KNOWN, np.random.default_rng(seed))
    return float(scores.max(initial=0.0))


def _hypotheses(poses: Sequence[Pose], view: LineView) -> Hypotheses:
    rotations, positions = np.stack([pose.matrix for pose in poses]), np.stack([pose.position for pose in poses])
    return Hypotheses.unbent(rotations, positions, np.full(len(poses), view.focal_px))
