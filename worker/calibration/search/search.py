"""From stored poses to new ones: the evolution strategy over the levels of a preset."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.field import Field
from worker.calibration.search.evolution import EvolutionStrategy, exponential_decay
from worker.calibration.search.genome import GENES, from_swinging, genome_of, looked_at, swinging, with_genome
from worker.calibration.search.ground_objective import BROAD, NARROW, GroundObjective
from worker.calibration.search.objective import Objective

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

    `patience`: generations without progress after which it ends before its time; None: it never does. `alone`: each
    camera has a population of its own, and nothing is stitched. `swings`: a turn swings the camera about the ground
    that it looks at, and does not turn it where it stands.
    """

    mutation: float
    objective: Callable[[Field, Sequence[Camera], Sequence[NDArray[np.float32]], float], Losses]
    patience: int | None = None
    alone: bool = False
    swings: bool = False


def _blurred(blur_px: float, mutation: float, alone: bool) -> Level:
    return Level(mutation, partial(Objective, blur_px=blur_px), PATIENCE, alone)


COARSE_TO_FINE = (
    _blurred(48, 4, alone=True),
    _blurred(16, 1.5, alone=True),
    _blurred(6, 0.5, alone=False),
)
"""Preset `esc`: each level pulls from about one blur away, and hands over within the next one's reach, or the finish's.

Cameras are searched for one by one until they are near: six numbers are found faster than 6 N, and two cameras that are
both far off agree best about the wrong lines.
"""
ALONE_ON_THE_GROUND = (
    Level(3.0, partial(GroundObjective, blurs=BROAD), alone=True),
    Level(1.0, partial(GroundObjective, blurs=NARROW), alone=True, swings=True),
)
"""Preset `scpr`, with three times the mutation at first: with the paper's, cameras get half of the way from 2.1°."""
ON_THE_GROUND = (*ALONE_ON_THE_GROUND, Level(0.5, partial(GroundObjective, blurs=NARROW), swings=True))
"""Preset `paper`: the same, and then all cameras together."""


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
    on_level: Callable[[int, Array, list[Camera]], None] = lambda *_: None,
) -> Found:
    """Evolve the poses of all cameras together, level by level.

    `responses` (H, W): segmentations in 0..1. `on_generation(number, loss)` is called after each generation and may
    raise to stop; `on_level(level, population, best)` after each level, with the genomes (parents, 6 N) at its end.
    """
    decay = exponential_decay(DECAY)
    everyone = EvolutionStrategy(strategy.parents, strategy.offspring, _mutation(len(cameras)), rng)
    population = everyone.first_parents(genome_of(cameras), levels[0].mutation)
    here = list(cameras)
    done = 0
    shares = _shares(strategy.generations, len(levels))
    for at, (level, generations) in enumerate(zip(levels, shares, strict=True)):
        groups = _groups(pitch, here, responses, level, strategy, population, rng)
        best = [_mean_loss(groups)]
        for generation in range(generations):
            for group in groups:
                group.next_generation(level.mutation * decay(generation))
            done += 1
            best.append(_mean_loss(groups))
            on_generation(done, best[-1])
            if _nothing_moves(best, level.patience):
                break
        population = np.concatenate([group.population for group in groups], axis=1)
        here = with_genome(cameras, np.concatenate([group.best for group in groups]))
        on_level(at, population, here)
    return Found(here, best[-1], done)


@dataclass(frozen=True)
class _Group:
    """Cameras that are searched for together; `pivots` (N, 3): points that they swing about, None where they do not."""

    evolution: EvolutionStrategy
    objective: Losses
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
    level: Level,
    strategy: Strategy,
    population: Array,
    rng: np.random.Generator,
) -> list[_Group]:
    """One group per camera or one of all, each with its genes of the `population` (parents, 6 N), judged."""
    groups = []
    for members in [[i] for i in range(len(here))] if level.alone else [list(range(len(here)))]:
        cameras, seen = [here[i] for i in members], [responses[i] for i in members]
        group = _Group(
            EvolutionStrategy(strategy.parents, strategy.offspring, _mutation(len(members)), rng),
            level.objective(pitch, cameras, seen, strategy.stitch_weight),
            np.array([looked_at(camera) for camera in cameras]) if level.swings else None,
        )
        group.begin_with(population[:, GENES * members[0] : GENES * (members[-1] + 1)])
        groups.append(group)
    return groups


def _mutation(cameras: int) -> Array:
    return np.tile([MUTATION_RAD] * 3 + [MUTATION_M] * 3, cameras)


def _mean_loss(groups: Sequence[_Group]) -> float:
    return float(np.mean([group.evolution.best_loss for group in groups]))


def _nothing_moves(best: Sequence[float], patience: int | None) -> bool:
    """Whether the last of the best losses is hardly below that of `patience` generations before."""
    return patience is not None and len(best) > patience and best[-1 - patience] - best[-1] < STALLED_BY


def _shares(total: int, parts: int) -> list[int]:
    """`total` in `parts` whole numbers as equal as possible, larger ones first."""
    return [total // parts + (index < total % parts) for index in range(parts)]
