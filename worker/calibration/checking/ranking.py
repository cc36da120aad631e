"""Ranking of the readings of a file by the lines in the frames of its cameras, before anything is calibrated.

Cheap evidence first: a reading by which no camera films the field is none; the others are scored by their agreement
with the lines at a coarse tolerance, the best of these after climbing from there, as proposals of a search are.
"""

from collections.abc import Sequence

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


def rank_readings(pitch: Field, cameras: Sequence[Camera], views: Sequence[LineView], seed: int) -> list[Reading]:
    """Return the readings under which cameras agree best with their `views`, best first, none after the file's word.

    All cameras of a file are written in one convention: they are scored together.
    """
    field_map, half_sides = FieldMap.of(pitch), np.array([pitch.length, pitch.width]) / 2
    # On a symmetric field half a turn changes nothing: the file at its word would be tried once more.
    every = [one for one in readings() if not (field_map.is_symmetric and one.is_half_turn)]
    cost = COST_OF_A_CAUSE * np.array([len(reading.causes) for reading in every])
    meant = [poses_of(every, camera.pose, half_sides) for camera in cameras]
    poses = [[Pose(*one) for one in zip(*its, strict=True)] for its in meant]
    plausible = [filming_mask(rotation_matrices(rotations), positions) for rotations, positions in meant]
    filming = [
        np.array([maybe and _shows_lines(pitch, camera.with_pose(pose)) for maybe, pose in zip(*its, strict=True)])
        for camera, *its in zip(cameras, plausible, poses, strict=True)
    ]
    coarse = np.mean(
        [_coarse(field_map, *one) for one in zip(views, poses, filming, strict=True)],
        axis=0,
    )

    def climbed(n: int) -> float:
        return float(np.mean([_climbed(field_map, view, its[n], seed) for view, its in zip(views, poses, strict=True)]))

    tried = [int(n) for n in np.argsort(cost - coarse, kind="stable")[:CLIMBED] if coarse[n] > 0]
    # The file at its word, which is the first, is the measure of the others.
    scores = {n: climbed(n) - cost[n] for n in {*tried, 0} if coarse[n] > 0}
    at_its_word = scores.get(0, 0.0)
    best = sorted(scores, key=lambda n: -scores[n])
    return [every[n] for n in best if scores[n] + cost[n] >= LEAST_PROPOSED and scores[n] >= at_its_word]


def films_the_field(pitch: Field, camera: Camera) -> bool:
    """True if a camera films the field, and enough of its markings to be calibrated by."""
    return films_a_field(camera.pose) and _shows_lines(pitch, camera)


def _shows_lines(pitch: Field, camera: Camera) -> bool:
    lines = pitch.line_points()
    return int(inside(camera.project(lines.position), camera.intrinsics.size).sum()) >= FEWEST_VISIBLE_POINTS


def _coarse(field_map: FieldMap, view: LineView, poses: Sequence[Pose], filming: NDArray[np.bool_]) -> Array:
    """Return the agreement (P,) of each pose with a view, 0 for those that film no field."""
    found = np.zeros(len(poses))
    chosen = np.flatnonzero(filming)
    if len(chosen):
        found[chosen] = agreement(field_map, view, _hypotheses([poses[int(n)] for n in chosen], view), COARSE_PX)
    return found


def _climbed(field_map: FieldMap, view: LineView, pose: Pose, seed: int) -> float:
    """Return the agreement that is reached from a pose."""
    _, scores = climb(field_map, view, _hypotheses([pose], view), LENS_KNOWN, np.random.default_rng(seed))
    return float(scores.max(initial=0.0))


def _hypotheses(poses: Sequence[Pose], view: LineView) -> Hypotheses:
    rotations, positions = np.stack([pose.matrix for pose in poses]), np.stack([pose.position for pose in poses])
    return Hypotheses.unbent(rotations, positions, np.full(len(poses), view.focal_px))
