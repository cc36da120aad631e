"""What numbers are when nobody knows how far off they may be: the lines choose the scale of their errors.

Numbers are thought to be off by what is expected of them times the scale of their group: one for how far each camera
moved, one for each lens, one for each measure of the field. Scales are those that make the lines likeliest (type-II
maximum likelihood; MacKay, "Bayesian Interpolation", 1992). A zoom and a move along the view look alike to the lines of
a far camera; but a camera that moved would have moved in other directions too, and so one that has not has zoomed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain, product

import numpy as np
from numpy.typing import NDArray

from worker.calibration.scene.camera import Array

SWEEPS = 3


@dataclass(frozen=True)
class Group:
    """Numbers whose errors are of one scale: `which` (n,) of those asked for, `expected` (n,) errors at scale 1 around
    `mean` (n,), and the `scales` (S,) that may be theirs.
    """

    which: NDArray[np.intp]
    expected: Array
    mean: Array
    scales: Array


@dataclass(frozen=True)
class Posterior:
    """What the numbers (A,) are: their mean `value` and `covariance` (A, A), at prior information `certainty` (A,)."""

    value: Array
    covariance: Array
    certainty: Array


def posterior(information: Array, pull: Array, blocks: Sequence[Sequence[Group]]) -> Posterior:
    """What lines say of numbers of unknown scales: those of a block are chosen together, one block after the other.

    `information` (A, A) and `pull` (A,) of the lines: about changes of the numbers from where they stand.
    """
    mean = np.zeros(len(pull))
    certainty = np.empty(len(pull))
    for group in chain.from_iterable(blocks):
        mean[group.which] = group.mean
        certainty[group.which] = (group.expected * group.scales[0]) ** -2
    for _ in range(SWEEPS):
        before = certainty
        for block in blocks:
            tried = [_with_scales(certainty, block, scales) for scales in product(*(group.scales for group in block))]
            certainty = max(tried, key=lambda known: _log_evidence(information, pull, known, mean))
        if np.array_equal(certainty, before):
            break
    covariance = np.asarray(np.linalg.inv(information + np.diag(certainty)), dtype=float)
    return Posterior(covariance @ (pull + certainty * mean), covariance, certainty)


def _with_scales(certainty: Array, block: Sequence[Group], scales: Sequence[float]) -> Array:
    changed = certainty.copy()
    for group, scale in zip(block, scales, strict=True):
        changed[group.which] = (group.expected * scale) ** -2
    return changed


def _log_evidence(information: Array, pull: Array, certainty: Array, mean: Array) -> float:
    """How likely the lines are (log, but for a constant), whatever the numbers."""
    together = information + np.diag(certainty)
    drawn = pull + certainty * mean
    fit = float(drawn @ np.linalg.solve(together, drawn) - mean @ (certainty * mean))
    return 0.5 * (float(np.log(certainty).sum()) - float(np.linalg.slogdet(together)[1]) + fit)
