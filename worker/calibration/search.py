"""From stored poses to new ones: the evolution strategy over the levels of a preset."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from worker.calibration.camera import Array, Camera, Pose
from worker.calibration.evolution import EvolutionStrategy, exponential_decay
from worker.calibration.field import Field
from worker.calibration.groundobjective import GroundObjective
from worker.calibration.objective import GENES, Objective

MUTATION_RAD = 0.005
MUTATION_M = 0.1
DECAY = 0.95
PATIENCE, STALLED_BY = 6, 1e-5
"""Where a level has patience, it ends when its best loss fell by less than this in so many generations."""


class Losses(Protocol):
    """An objective ready to judge: `losses` (P,) of genomes (P, 6 N)."""

    def losses(self, genomes: Array) -> Array:
        """Lower is better."""


@dataclass(frozen=True)
class Level:
    """A stretch of generations with one objective, and the strength of mutation at its start.

    `patience`: generations without progress after which it ends before its time; None: it never does.
    """

    mutation: float
    objective: Callable[[Field, Sequence[Camera], Sequence[NDArray[np.float32]], float], Losses]
    patience: int | None = None


def _blurred(blur_px: float, mutation: float) -> Level:
    return Level(mutation, partial(Objective, blur_px=blur_px), PATIENCE)


COARSE_TO_FINE = (_blurred(48, 4), _blurred(16, 1.5), _blurred(6, 0.5), _blurred(2, 0.2), _blurred(0.8, 0.1))
"""Preset `esc`: each level pulls from about one blur away, and hands over within the next one's."""
ON_THE_GROUND = (Level(1.0, GroundObjective),)
"""Presets `paper` and `scpr`."""


@dataclass(frozen=True)
class Strategy:
    """The numbers of the paper's strategy: mu parents, lambda offspring, G generations in all, and the trade-off w."""

    parents: int
    offspring: int
    generations: int
    stitch_weight: float


@dataclass(frozen=True)
class Found:
    """Where the search ended."""

    cameras: list[Camera]
    loss: float
    generations: int


def search(
    pitch: Field,
    cameras: Sequence[Camera],
    responses: Sequence[NDArray[np.float32]],
    levels: Sequence[Level],
    strategy: Strategy,
    rng: np.random.Generator,
    on_generation: Callable[[int, float], None],
) -> Found:
    """Evolve the poses of all cameras together, level by level.

    `responses` (H, W): segmentations in 0..1. `on_generation(number, loss)` is called after each generation and may
    raise to stop.
    """
    decay = exponential_decay(DECAY)
    mutation = np.tile([MUTATION_RAD] * 3 + [MUTATION_M] * 3, len(cameras))
    evolution = EvolutionStrategy(strategy.parents, strategy.offspring, mutation, rng)
    candidates = evolution.first_parents(genome_of(cameras), levels[0].mutation)
    here = list(cameras)
    done = 0
    for level, generations in zip(levels, _shares(strategy.generations, len(levels)), strict=True):
        objective = level.objective(pitch, here, responses, strategy.stitch_weight)
        evolution.tell(candidates, objective.losses(candidates))
        best = [evolution.best_loss]
        for generation in range(generations):
            children = evolution.ask(level.mutation * decay(generation))
            evolution.tell(children, objective.losses(children))
            done += 1
            on_generation(done, evolution.best_loss)
            best.append(evolution.best_loss)
            if _nothing_moves(best, level.patience):
                break
        here = with_genome(cameras, evolution.best)
        loss = evolution.best_loss
        candidates = evolution.forget_losses()
    return Found(here, loss, done)


def _nothing_moves(best: Sequence[float], patience: int | None) -> bool:
    """Whether the last of the best losses is hardly below that of `patience` generations before."""
    return patience is not None and len(best) > patience and best[-1 - patience] - best[-1] < STALLED_BY


def genome_of(cameras: Sequence[Camera]) -> Array:
    """Poses as one vector (6 N,): per camera rotation vector, position."""
    return np.concatenate([[*camera.pose.rotation, *camera.pose.position] for camera in cameras])


def with_genome(cameras: Sequence[Camera], genome: Array) -> list[Camera]:
    """The cameras at the poses of a genome (6 N,)."""
    poses = genome.reshape(-1, GENES)
    return [camera.with_pose(Pose(pose[:3], pose[3:])) for camera, pose in zip(cameras, poses, strict=True)]


def _shares(total: int, parts: int) -> list[int]:
    """`total` in `parts` whole numbers as equal as possible, larger ones first."""
    return [total // parts + (index < total % parts) for index in range(parts)]
