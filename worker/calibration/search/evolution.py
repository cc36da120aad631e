"""The elitist (mu + lambda) evolution strategy of the paper, section III, as ask and tell.

A genome is 6 numbers per camera: rotation vector (rad) and position (m). Nothing here knows what a genome means: the
mutation has one strength per gene, and whole populations are arrays (individuals, genes).
"""

from collections.abc import Callable

import numpy as np

from worker.calibration.geometry.camera import Array

Schedule = Callable[[int], float]


def exponential_decay(factor: float = 0.95) -> Schedule:
    """Return the schedule factor^g of the mutation strength in generation g: the paper's s_decay."""
    return lambda generation: factor**generation


def blend(first: Array, second: Array, rng: np.random.Generator) -> Array:
    """Return children between two parents (n, genes) each, gene by gene with a share drawn from U(0, 1)."""
    share = rng.uniform(size=first.shape)
    return share * first + (1 - share) * second


class EvolutionStrategy:
    """Evolution strategy: ask for children, tell their losses; the best `parents` of parents and children go on.

    `mutation` (genes,) is the standard deviation of a child's mutation at schedule strength 1.
    """

    def __init__(self, parents: int, offspring: int, mutation: Array, rng: np.random.Generator) -> None:
        self.parents = parents
        self.offspring = offspring
        self.mutation = mutation
        self.rng = rng
        self.population = np.empty((0, len(mutation)))
        self.losses = np.empty(0)

    def first_parents(self, centre: Array, strength: float = 1.0) -> Array:
        """Return the first generation (parents, genes): `centre` (genes,), and mutated copies of it."""
        genomes = centre + strength * self.mutation * self.rng.normal(size=(self.parents, len(centre)))
        genomes[0] = centre
        return genomes

    def ask(self, strength: float) -> Array:
        """Return children (offspring, genes) of the present population, mutated with `strength`."""
        drawn = self.rng.integers(len(self.population), size=(2, self.offspring))
        children = blend(self.population[drawn[0]], self.population[drawn[1]], self.rng)
        return children + strength * self.mutation * self.rng.normal(size=children.shape)

    def tell(self, genomes: Array, losses: Array) -> None:
        """Take in evaluated genomes; the lowest losses of old and new survive, elders first where they are equal."""
        everyone = np.concatenate([self.population, genomes])
        all_losses = np.concatenate([self.losses, losses])
        survivors = np.argsort(all_losses, kind="stable")[: self.parents]
        self.population, self.losses = everyone[survivors], all_losses[survivors]

    @property
    def best(self) -> Array:
        """Genome (genes,) of lowest loss so far."""
        return self.population[0]

    @property
    def best_loss(self) -> float:
        """Lowest loss so far."""
        return float(self.losses[0])
