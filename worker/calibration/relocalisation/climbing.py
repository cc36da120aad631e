"""Evolution strategy from many hypotheses to few: narrower tolerances, smaller steps, the best ones apart."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from worker.calibration.geometry.camera import Array
from worker.calibration.geometry.rotation import rotation_matrices
from worker.calibration.relocalisation.agreement import LOWEST_M, agreement
from worker.calibration.relocalisation.alignment import aligned
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.hypotheses import FARTHEST_BENT, Hypotheses, LensSteps
from worker.calibration.relocalisation.line_view import LineView

OFFSPRING = 12


@dataclass(frozen=True)
class ClimbingRound:
    """Generations at one tolerance (view px), with steps `scale` as wide as at first.

    Of those that come at most `survivors` climb in it, and go on from it.
    """

    tolerance_px: float
    generations: int
    scale: float
    survivors: int


LEVELS = (
    ClimbingRound(8.0, 8, 1.0, 40),
    ClimbingRound(5.0, 10, 0.5, 20),
    ClimbingRound(3.0, 10, 0.25, 12),
    ClimbingRound(2.0, 12, 0.1, 6),
)


def climb(
    field: FieldMap,
    view: LineView,
    start: Hypotheses,
    steps: LensSteps,
    rng: np.random.Generator,
    levels: Sequence[ClimbingRound] = LEVELS,
) -> tuple[Hypotheses, Array]:
    """Return the best hypotheses that lie apart, and their agreements at the last tolerance, best first."""
    cameras, scores = start, np.zeros(len(start))
    for level in levels:
        scores = agreement(field, view, cameras, level.tolerance_px)
        if len(cameras) > level.survivors:
            # Aligned, many turn out to be alike or hopeless, before they cost generations.
            cameras, scores = _best_apart(*aligned(field, view, cameras, scores, level.tolerance_px, steps), level)
        for generation in range(level.generations):
            scale = level.scale * 0.9**generation
            offspring = _mutated(cameras, scale, steps, rng)
            of_offspring = agreement(field, view, offspring, level.tolerance_px).reshape(len(cameras), OFFSPRING)
            best = of_offspring.argmax(axis=1)
            rows = np.arange(len(cameras))
            better = of_offspring[rows, best] > scores
            chosen = np.where(better, len(cameras) + rows * OFFSPRING + best, rows)
            cameras = Hypotheses.joined([cameras, offspring])[chosen]
            scores = np.maximum(scores, of_offspring[rows, best])
        cameras, scores = _best_apart(*aligned(field, view, cameras, scores, level.tolerance_px, steps), level)
    return cameras, scores


def _mutated(cameras: Hypotheses, scale: float, steps: LensSteps, rng: np.random.Generator) -> Hypotheses:
    """Return `OFFSPRING` of each camera: a turn, a step, and changes of focal length and bend, drawn independently."""
    count, half = len(cameras), OFFSPRING // 2
    forward = cameras.rotations[:, 2]
    reach = np.minimum(np.maximum(cameras.positions[:, 2], 1) / np.maximum(-forward[:, 2], 0.05), 120.0)
    turns = rng.normal(size=(count, OFFSPRING, 3)) * np.array([0.05, 0.05, 0.02]) * scale
    places = cameras.positions[:, None] + rng.normal(size=(count, OFFSPRING, 3)) * (0.06 * scale * reach)[:, None, None]
    focal = np.repeat(cameras.focal_px[:, None], OFFSPRING, axis=1)
    if steps.focal > 0:
        focal = focal * np.exp(steps.focal * scale * rng.normal(size=focal.shape))
        # A longer lens from farther back shows nearly the same.
        back = (focal / cameras.focal_px[:, None] - 1) * reach[:, None]
        places[:, :half] -= back[:, :half, None] * forward[:, None]
    places[..., 2] = np.maximum(places[..., 2], LOWEST_M)
    rotations = np.repeat(cameras.rotations[:, None], OFFSPRING, axis=1)
    aim = (cameras.positions + reach[:, None] * forward)[:, None] - places[:, :half]
    aim /= np.linalg.norm(aim, axis=-1, keepdims=True)
    bends = np.repeat(cameras.bends[:, None], OFFSPRING, axis=1)
    if steps.bend > 0:
        # Every other one keeps the bend: what was right before need not be found again.
        bends[:, ::2] += steps.bend * scale * rng.normal(size=bends[:, ::2].shape)
        bends = np.clip(bends, -FARTHEST_BENT, FARTHEST_BENT)
    towards = np.einsum("nij,nkj->nki", cameras.rotations, np.cross(forward[:, None], aim))
    turns[:, :half] *= 0.3
    rotations[:, :half] = rotation_matrices(-towards) @ rotations[:, :half]
    rotations = rotation_matrices(turns) @ rotations
    return Hypotheses(rotations.reshape(-1, 3, 3), places.reshape(-1, 3), focal.reshape(-1), bends.reshape(-1))


def _best_apart(cameras: Hypotheses, scores: Array, level: ClimbingRound) -> tuple[Hypotheses, Array]:
    """Return the best cameras no two of which are alike, and their scores."""
    kept = list[int]()
    for n in np.argsort(-scores):
        far = level.scale * (0.2 + 0.03 * float(np.linalg.norm(cameras.positions[n])))
        alike = (
            float(np.linalg.norm(cameras.positions[n] - cameras.positions[m])) < far
            and float(np.trace(cameras.rotations[n] @ cameras.rotations[m].T)) > 3 - (0.1 * level.scale) ** 2
            for m in kept
        )
        if not any(alike):
            kept.append(int(n))
        if len(kept) == level.survivors:
            break
    return cameras[np.array(kept, dtype=np.intp)], scores[kept]
