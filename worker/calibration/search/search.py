"""From stored poses to new ones: the evolution strategy over levels of blur, from coarse to fine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.field import Field
from worker.calibration.search.evolution import EvolutionStrategy, exponential_decay
from worker.calibration.search.genome import GENES, genome_of, with_genome
from worker.calibration.search.objective import Objective

MUTATION_RAD = 0.005
MUTATION_M = 0.1
DECAY = 0.95
PATIENCE, STALLED_BY = 6, 1e-5
"""A level ends before its time when its best loss fell by less than this in so many generations."""


@dataclass(frozen=True)
class Level:
    """A stretch of generations at one blur (px of a 4K frame), and the strength of mutation at its start.

    `alone`: each camera has a population of its own, and nothing is stitched.
    """

    blur_px: float
    mutation: float
    alone: bool


COARSE_TO_FINE = (Level(48, 4, alone=True), Level(16, 1.5, alone=True), Level(6, 0.5, alone=False))
"""Each level pulls from about one blur away, and hands over within the next one's reach, or the finish's.

Cameras are searched for one by one until they are near: six numbers are found faster than 6 N, and two cameras that are
both far off agree best about the wrong lines.
"""


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
    strategy: Strategy,
    rng: np.random.Generator,
    on_generation: Callable[[int, float], None],
    on_level: Callable[[int, Array, list[Camera]], None] = lambda *_: None,
) -> Found:
    """Evolve the poses of all cameras together, level by level.

    `responses` (H, W): segmentations in 0..1. `on_generation(number, loss)` is called after each generation and may
    raise to stop; `on_level(level, population, best)` after each level, with the genomes (parents, 6 N) at its end.
    """
    decay = exponential_decay(DECAY)
    everyone = EvolutionStrategy(strategy.parents, strategy.offspring, mutation_of(len(cameras)), rng)
    population = everyone.first_parents(genome_of(cameras), COARSE_TO_FINE[0].mutation)
    here = list(cameras)
    done = 0
    shares = shared_among(strategy.generations, len(COARSE_TO_FINE))
    for at, (level, generations) in enumerate(zip(COARSE_TO_FINE, shares, strict=True)):
        groups = _groups(pitch, here, responses, level, strategy, population, rng)
        best = [_mean_loss(groups)]
        for generation in range(generations):
            for group in groups:
                group.next_generation(level.mutation * decay(generation))
            done += 1
            best.append(_mean_loss(groups))
            on_generation(done, best[-1])
            if _nothing_moves(best):
                break
        population = np.concatenate([group.evolution.population for group in groups], axis=1)
        here = with_genome(cameras, np.concatenate([group.evolution.best for group in groups]))
        on_level(at, population, here)
    return Found(here, best[-1], done)


@dataclass(frozen=True)
class _Group:
    """Cameras that are searched for together."""

    evolution: EvolutionStrategy
    objective: Objective

    def next_generation(self, strength: float) -> None:
        """Children of the parents, and the best of both."""
        children = self.evolution.ask(strength)
        self.evolution.tell(children, self.objective.losses(children))


def _groups(
    pitch: Field,
    here: Sequence[Camera],
    responses: Sequence[NDArray[np.float32]],
    level: Level,
    strategy: Strategy,
    population: Array,
    rng: np.random.Generator,
) -> list[_Group]:
    """One group per camera or one of all, each with its genes of the `population` (parents, 6 N), judged."""
    groups = []
    for members in grouped(len(here), alone=level.alone):
        cameras, seen = [here[i] for i in members], [responses[i] for i in members]
        group = _Group(
            EvolutionStrategy(strategy.parents, strategy.offspring, mutation_of(len(members)), rng),
            Objective(pitch, cameras, seen, strategy.stitch_weight, level.blur_px),
        )
        genomes = genes_of(members, population)
        group.evolution.tell(genomes, group.objective.losses(genomes))
        groups.append(group)
    return groups


def grouped(cameras: int, *, alone: bool) -> list[list[int]]:
    """Return the numbers of the cameras that are searched for together: each `alone`, or all in one group."""
    return [[number] for number in range(cameras)] if alone else [list(range(cameras))]


def genes_of(members: Sequence[int], population: Array) -> Array:
    """Return the genes (parents, 6 M) of M neighbouring cameras in a population (parents, 6 N)."""
    return population[:, GENES * members[0] : GENES * (members[-1] + 1)]


def mutation_of(cameras: int) -> Array:
    """Return the standard deviations (6 N,) of a mutation of strength 1."""
    return np.tile([MUTATION_RAD] * 3 + [MUTATION_M] * 3, cameras)


def _mean_loss(groups: Sequence[_Group]) -> float:
    return float(np.mean([group.evolution.best_loss for group in groups]))


def _nothing_moves(best: Sequence[float]) -> bool:
    """True if the last of the best losses is hardly below that of `PATIENCE` generations before."""
    return len(best) > PATIENCE and best[-1 - PATIENCE] - best[-1] < STALLED_BY


def shared_among(total: int, parts: int) -> list[int]:
    """Return `total` in `parts` whole numbers as equal as possible, larger ones first."""
    return [total // parts + (index < total % parts) for index in range(parts)]
