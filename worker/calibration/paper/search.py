"""Paper's search: the evolution strategy on the objective on the ground, from broad blurs to narrow ones."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.derivatives import POSE_NUMBERS
from worker.calibration.geometry.field import Field
from worker.calibration.paper.ground_objective import BROAD, NARROW, Blurs, GroundObjective
from worker.calibration.paper.swinging import from_swinging, looked_at, swinging
from worker.calibration.search.evolution import EvolutionStrategy, exponential_decay
from worker.calibration.search.genome import genome_of, with_genome
from worker.calibration.search.search import (
    DECAY,
    Found,
    Strategy,
    mutation_of,
    shared_among,
)


@dataclass(frozen=True)
class GroundLevel:
    """A stretch of generations with the same blurs, and the strength of mutation at its start.

    `alone`: each camera has a population of its own, and nothing is stitched. `swings`: a turn swings the camera about
    the ground that it looks at, and does not turn it where it stands.
    """

    blurs: Blurs
    mutation: float
    alone: bool
    swings: bool


ALONE_ON_THE_GROUND = (
    GroundLevel(BROAD, 3.0, alone=True, swings=False),
    GroundLevel(NARROW, 1.0, alone=True, swings=True),
)
"""Three times the mutation at first: with the paper's, cameras get half of the way from 2.1°."""
ON_THE_GROUND = (*ALONE_ON_THE_GROUND, GroundLevel(NARROW, 0.5, alone=False, swings=True))
"""Levels of `ALONE_ON_THE_GROUND`, and then all cameras together."""


def search_on_ground(
    pitch: Field,
    cameras: Sequence[Camera],
    responses: Sequence[NDArray[np.float32]],
    levels: Sequence[GroundLevel],
    strategy: Strategy,
    stitch_weight: float,
    rng: np.random.Generator,
    on_generation: Callable[[int, float], None],
    on_level: Callable[[int, Array, list[Camera]], None] = lambda *_: None,
) -> Found:
    """Evolve the poses of all cameras, level by level, through all generations; arguments as of `search`.

    `stitch_weight`: the paper's trade-off lambda between what cameras see of each other and of the field.
    """
    decay = exponential_decay(DECAY)
    everyone = EvolutionStrategy(strategy.parents, strategy.offspring, mutation_of(len(cameras)), rng)
    population = everyone.first_parents(genome_of(cameras), levels[0].mutation)
    here = list(cameras)
    done = 0
    for at, (level, generations) in enumerate(
        zip(levels, shared_among(strategy.generations, len(levels)), strict=True)
    ):
        groups = _groups(pitch, here, responses, level, strategy, stitch_weight, population, rng)
        for generation in range(generations):
            for group in groups:
                group.next_generation(level.mutation * decay(generation))
            done += 1
            on_generation(done, _mean_loss(groups))
        population = np.concatenate([group.population for group in groups], axis=1)
        here = with_genome(cameras, np.concatenate([group.best for group in groups]))
        on_level(at, population, here)
    return Found(here, _mean_loss(groups), done)


@dataclass(frozen=True)
class _Group:
    """Cameras that are searched for together; `pivots` (N, 3): points that they swing about, None where they do not."""

    evolution: EvolutionStrategy
    objective: GroundObjective
    pivots: Array | None

    @property
    def population(self) -> Array:
        """Genomes (parents, 6 N)."""
        return self._placed(self.evolution.population)

    @property
    def best(self) -> Array:
        """The best genome (6 N,)."""
        return self._placed(self.evolution.best)

    def begin_with(self, genomes: Array) -> None:
        """Judge the first parents (parents, 6 N)."""
        genes = genomes if self.pivots is None else swinging(genomes, self.pivots)
        self.evolution.tell(genes, self.objective.losses(genomes))

    def next_generation(self, strength: float) -> None:
        """Children of the parents, and the best of both."""
        children = self.evolution.ask(strength)
        self.evolution.tell(children, self.objective.losses(self._placed(children)))

    def _placed(self, genes: Array) -> Array:
        return genes if self.pivots is None else from_swinging(genes, self.pivots)


def _groups(
    pitch: Field,
    here: Sequence[Camera],
    responses: Sequence[NDArray[np.float32]],
    level: GroundLevel,
    strategy: Strategy,
    stitch_weight: float,
    population: Array,
    rng: np.random.Generator,
) -> list[_Group]:
    """One group per camera or one of all, each with its genes of the `population` (parents, 6 N), judged."""
    groups = []
    together = 1 if level.alone else len(here)
    for first in range(0, len(here), together):
        members = slice(first, first + together)
        cameras, seen = here[members], responses[members]
        group = _Group(
            EvolutionStrategy(strategy.parents, strategy.offspring, mutation_of(together), rng),
            GroundObjective(pitch, cameras, seen, stitch_weight, level.blurs),
            np.array([looked_at(camera) for camera in cameras]) if level.swings else None,
        )
        group.begin_with(population[:, POSE_NUMBERS * first : POSE_NUMBERS * (first + together)])
        groups.append(group)
    return groups


def _mean_loss(groups: Sequence[_Group]) -> float:
    return float(np.mean([group.evolution.best_loss for group in groups]))
