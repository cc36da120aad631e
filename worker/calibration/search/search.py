"""From stored poses to new ones: the evolution strategy over levels of blur, from coarse to fine."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.field import Field
from worker.calibration.search.evolution import EvolutionStrategy, exponential_decay
from worker.calibration.search.genome import genome_of, with_genome
from worker.calibration.search.objective import Objective

MUTATION_RAD = 0.005
MUTATION_M = 0.1
DECAY = 0.95
PATIENCE = 6
"""Least decrease of the best loss over `PATIENCE` generations for the search on a level to go on."""


@dataclass(frozen=True)
class Level:
    """Stretch of generations at one blur (px of a 4K frame), and the strength of mutation at its start."""

    blur_px: float
    mutation: float


COARSE_TO_FINE = (Level(48, 4), Level(16, 1.5), Level(6, 0.5))
"""Each level pulls from about one blur away, and hands over within the next one's reach, or the refinement's."""


@dataclass(frozen=True)
class Strategy:
    """Parameters of the paper's strategy: mu parents, lambda offspring, and G generations in all."""

    parents: int
    offspring: int
    generations: int


@dataclass(frozen=True)
class Found:
    """Result of the search: the best poses, the mean of their losses, and the number of generations."""

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
    """Evolve the pose of each camera level by level, all of them side by side and none of them knowing of another.

    Six numbers are found faster than 6 N, and two cameras that are both far off agree best about the wrong lines.
    `responses` (H, W): segmentations in 0..1. `on_generation(number, loss)` is called after each generation of all
    cameras and may raise to stop; `on_level(level, population, best)` after each level, with the genomes (parents, 6 N)
    at its end.
    """
    decay = exponential_decay(DECAY)
    searches = [
        _CameraSearch(pitch, camera, response, strategy, own)
        for camera, response, own in zip(cameras, responses, rng.spawn(len(cameras)), strict=True)
    ]
    shares = shared_among(strategy.generations, len(COARSE_TO_FINE))
    done = 0
    for at, (level, generations) in enumerate(zip(COARSE_TO_FINE, shares, strict=True)):
        for one in searches:
            one.begin(level)
        for generation in range(generations):
            moving = [one for one in searches if not one.has_stalled]
            if not moving:
                break
            for one in moving:
                one.next_generation(level.mutation * decay(generation))
            done += 1
            on_generation(done, _mean_loss(searches))
        on_level(at, np.concatenate([one.population for one in searches], axis=1), [one.camera for one in searches])
    return Found([one.camera for one in searches], _mean_loss(searches), done)


class _CameraSearch:
    """The search for one `camera`: the best of its `population` (parents, 6) so far."""

    def __init__(
        self,
        pitch: Field,
        camera: Camera,
        response: NDArray[np.float32],
        strategy: Strategy,
        rng: np.random.Generator,
    ) -> None:
        self.camera = camera
        self._pitch, self._response = pitch, response
        self._evolve = partial(EvolutionStrategy, strategy.parents, strategy.offspring, mutation_of(1), rng)
        self.population = self._evolve().first_parents(genome_of([camera]), COARSE_TO_FINE[0].mutation)
        self.best_losses = list[float]()

    def begin(self, level: Level) -> None:
        """Begin a level at the pose where the last one ended, with its population."""
        self._objective = Objective.build(self._pitch, self.camera, self._response, level.blur_px)
        self._evolution = self._evolve()
        self.best_losses.clear()
        self._judge(self.population)

    def next_generation(self, strength: float) -> None:
        """Judge the children of the population, and keep the best of both."""
        self._judge(self._evolution.ask(strength))

    @property
    def has_stalled(self) -> bool:
        """True if the last of the best losses is hardly below that of `PATIENCE` generations before."""
        best = self.best_losses
        return len(best) > PATIENCE and best[-1 - PATIENCE] - best[-1] < 1e-5

    def _judge(self, genomes: Array) -> None:
        self._evolution.tell(genomes, self._objective.losses(genomes))
        self.population = self._evolution.population
        self.best_losses.append(self._evolution.best_loss)
        (self.camera,) = with_genome([self.camera], self._evolution.best)


def _mean_loss(searches: Sequence[_CameraSearch]) -> float:
    return float(np.mean([one.best_losses[-1] for one in searches]))


def mutation_of(cameras: int) -> Array:
    """Return the standard deviations (6 N,) of a mutation of strength 1."""
    return np.tile([MUTATION_RAD] * 3 + [MUTATION_M] * 3, cameras)


def shared_among(total: int, parts: int) -> list[int]:
    """Return `total` in `parts` whole numbers as equal as possible, larger ones first."""
    return [total // parts + (index < total % parts) for index in range(parts)]
