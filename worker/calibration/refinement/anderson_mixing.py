"""Anderson mixing of steps (1965; Walker and Ni, 2011).

Weights, the unevenness of the ground and what is matched follow the poses only one step behind, so Gauss-Newton alone
comes nearer by a quarter a step. What the last steps left over says where that leads.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from worker.calibration.geometry.arrays import Array
from worker.calibration.geometry.derivatives import POSE_NUMBERS
from worker.calibration.refinement.estimate import TURN_M, Estimate, GaussNewtonStep
from worker.calibration.refinement.unknowns import Unknowns


class MixedSteps:
    """Steps towards a fixed point, each mixed with the ones before."""

    def __init__(self, unknowns: Unknowns) -> None:
        self._unknowns = unknowns
        self._poses = POSE_NUMBERS * unknowns.views
        self._scale = np.tile([TURN_M] * 3 + [1.0] * 3, unknowns.views)
        self._plain: list[Array] = []
        self._taken: list[Array] = []

    def step(self, estimate: Estimate, made: GaussNewtonStep) -> Estimate:
        """Return the next estimate after `estimate`, whose plain step was `made`."""
        move = self._mixed(made.move)
        self._plain.append(made.move)
        self._taken.append(move)
        return replace(estimate.moved(move, self._unknowns), uneven_m=made.to.uneven_m)

    def _mixed(self, plain: Array) -> Array:
        last = min(3, len(self._plain))
        if last == 0:
            return plain
        steps = [*self._plain[-last:], plain]
        changes = np.stack([b - a for a, b in pairwise(steps)], axis=1)
        taken = np.stack(self._taken[-last:], axis=1)
        # Relative singular value below which changes between steps are taken to be alike.
        share = np.linalg.lstsq(self._in_metres(changes), self._in_metres(plain), rcond=1e-3)[0]
        mixed: Array = plain - (taken + changes) @ share
        # Longest mixed step, in multiples of the plain one.
        longest = 4.0 * np.linalg.norm(self._in_metres(plain))
        return mixed if np.linalg.norm(self._in_metres(mixed)) <= longest else plain

    def _in_metres(self, moves: Array) -> Array:
        """Return the poses' part (6 V, ...) of moves (U, ...) in metres: turns as shifts at `TURN_M`."""
        return np.asarray((moves[: self._poses].T * self._scale).T)
