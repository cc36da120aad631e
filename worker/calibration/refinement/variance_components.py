"""Variance components: the lines choose the scale of errors that nobody knows.

Numbers are thought to be off by what is expected of them times the scale of their group: one for how far each camera
moved, one for each focal length, one for the rest of each lens, one for each measure of the field. Scales are those
that make the lines likeliest (type-II maximum likelihood; MacKay, "Bayesian Interpolation", 1992). A zoom and a move
along the view look alike to the lines of a far camera; but a camera that moved would have moved in other directions
too, and so one that has not has zoomed.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain, product

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array


@dataclass(frozen=True)
class Group:
    """Errors of one scale: `which` (n,) of all, `expected` (n,) sizes at scale 1 around `mean` (n,), and the
    possible `scales` (S,), or (S, n) where they differ within the group. `odds` (S,) of the scales before any line:
    with them a group has the mean of its variance in place of the likeliest scale."""

    which: NDArray[np.intp]
    expected: Array
    mean: Array
    scales: Array
    odds: Array | None = None

    def certainty(self, scale: Array | float) -> Array:
        """Return the prior information (n,) on the errors at one of the scales."""
        return np.asarray((self.expected * scale) ** -2)


@dataclass(frozen=True)
class Posterior:
    """Posterior of the errors (A,): their mean `value` and `covariance` (A, A).

    Prior: their `mean` (A,), and the information `certainty` (A,) on it.
    """

    value: Array
    covariance: Array
    certainty: Array
    mean: Array


def posterior(information: Array, information_vector: Array, blocks: Sequence[Sequence[Group]]) -> Posterior:
    """Return the posterior of errors of unknown scales; the scales of a block are chosen together, block after block.

    `information` (A, A) and `information_vector` (A,) of the lines: about changes of the errors from where they stand.
    """
    mean = np.zeros(len(information_vector))
    certainty = np.empty(len(information_vector))
    for group in chain.from_iterable(blocks):
        mean[group.which] = group.mean
        certainty[group.which] = group.certainty(group.scales[0])
    choices = [block for block in blocks if any(len(group.scales) > 1 for group in block)]
    for _ in range(3):
        before = certainty.copy()
        for block in choices:
            which = np.concatenate([group.which for group in block])
            certainty[which] = _likeliest(information, information_vector, certainty, mean, block, which)
        if np.array_equal(certainty, before):
            break
    covariance = np.asarray(np.linalg.inv(information + np.diag(certainty)), dtype=float)
    return Posterior(covariance @ (information_vector + certainty * mean), covariance, certainty, mean)


def _likeliest(
    information: Array,
    information_vector: Array,
    certainty: Array,
    mean: Array,
    block: Sequence[Group],
    which: NDArray[np.intp],
) -> Array:
    """Return the prior information (n,) on the errors of a block that makes the lines likeliest, all others fixed.

    Groups whose scales have odds get the mean of their variance over all scales: lines that tell little of a scale
    would else choose the least one as surely as lines that tell it.
    """
    rest = np.setdiff1d(np.arange(len(information_vector)), which)
    of_rest = information[np.ix_(rest, rest)] + np.diag(certainty[rest])
    coupling = information[np.ix_(rest, which)]
    effect = np.linalg.solve(of_rest, coupling) if len(rest) else np.zeros((0, len(which)))
    alone = information[np.ix_(which, which)] - coupling.T @ effect
    combined = information_vector[which] - effect.T @ (information_vector[rest] + certainty[rest] * mean[rest])
    choices = np.array([*product(*(range(len(group.scales)) for group in block))])
    of_scales = [np.stack([group.certainty(scale) for scale in group.scales]) for group in block]
    tried = np.concatenate([one[choices[:, column]] for column, one in enumerate(of_scales)], axis=1)
    evidence = _log_evidence(alone, combined, tried, mean[which])
    weighed = [(column, group.odds) for column, group in enumerate(block) if group.odds is not None]
    log_odds = sum((np.log(odds)[choices[:, column]] for column, odds in weighed), np.zeros(len(choices)))
    chosen = tried[np.argmax(evidence + log_odds)]
    share = np.exp(evidence + log_odds - np.max(evidence + log_odds))
    has_odds = np.repeat([group.odds is not None for group in block], [len(group.which) for group in block])
    mean_variance = share @ (1 / tried) / share.sum()
    return np.asarray(np.where(has_odds, 1 / mean_variance, chosen), dtype=float)


def _log_evidence(information: Array, information_vector: Array, certainty: Array, mean: Array) -> Array:
    """Return the log evidence (T,) of the lines, but for a constant, at each prior information (T, n) on the errors."""
    together = information + certainty[:, :, None] * np.eye(len(information_vector))
    combined = information_vector + certainty * mean
    fit = np.sum(combined * np.linalg.solve(together, combined[..., None])[..., 0], axis=1) - certainty @ mean**2
    return np.asarray(0.5 * (np.log(certainty).sum(axis=1) - np.linalg.slogdet(together)[1] + fit), dtype=float)
