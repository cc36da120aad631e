"""The strategy, on tiny populations and a bowl."""

import numpy as np
import pytest

from worker.calibration.search.evolution import EvolutionStrategy, blend, exponential_decay


def strategy(parents=4, offspring=8, genes=3, seed=0):
    return EvolutionStrategy(parents, offspring, np.full(genes, 0.1), np.random.default_rng(seed))


def bowl(genomes):
    return np.sum((genomes - 0.5) ** 2, axis=1)


def test_the_best_of_parents_and_children_survive():
    evolution = strategy(parents=2)
    evolution.tell(np.array([[3.0] * 3, [1.0] * 3]), np.array([3.0, 1.0]))
    evolution.tell(np.array([[2.0] * 3, [4.0] * 3]), np.array([2.0, 4.0]))
    np.testing.assert_array_equal(evolution.population[:, 0], [1.0, 2.0])
    assert evolution.best_loss == 1.0


def test_an_elder_survives_a_child_that_is_no_better():
    evolution = strategy(parents=1)
    evolution.tell(np.array([[1.0] * 3]), np.array([5.0]))
    evolution.tell(np.array([[2.0] * 3]), np.array([5.0]))
    assert evolution.best[0] == 1.0


def test_the_best_loss_never_gets_worse():
    evolution = strategy()
    first = evolution.first_parents(np.zeros(3))
    evolution.tell(first, bowl(first))
    history = []
    for generation in range(30):
        children = evolution.ask(exponential_decay()(generation))
        evolution.tell(children, bowl(children))
        history.append(evolution.best_loss)
    assert history == sorted(history, reverse=True)
    assert history[-1] < 0.01


def test_the_first_parents_include_the_stored_pose_itself():
    np.testing.assert_array_equal(strategy().first_parents(np.array([1.0, 2.0, 3.0]))[0], [1.0, 2.0, 3.0])


def test_a_blend_lies_between_its_parents_gene_by_gene():
    rng = np.random.default_rng(0)
    low, high = np.zeros((50, 3)), np.ones((50, 3))
    children = blend(low, high, rng)
    assert ((children >= 0) & (children <= 1)).all()
    assert not np.allclose(children[:, 0], children[:, 1])


def test_the_mutation_has_the_strength_it_is_asked_for():
    evolution = EvolutionStrategy(1, 4000, np.array([0.1, 0.0]), np.random.default_rng(0))
    evolution.tell(np.zeros((1, 2)), np.zeros(1))
    spread = evolution.ask(0.5).std(axis=0)
    assert spread[0] == pytest.approx(0.05, rel=0.05)
    assert spread[1] == 0


def test_the_decay_is_the_papers():
    assert exponential_decay(0.95)(100) == pytest.approx(0.95**100)


def test_the_same_seed_asks_the_same():
    asked = []
    for _ in range(2):
        evolution = strategy(seed=7)
        evolution.tell(evolution.first_parents(np.zeros(3)), np.arange(4.0))
        asked.append(evolution.ask(1.0))
    np.testing.assert_array_equal(*asked)
