"""A Kalman filter of one camera's pose that expects it to go on as it goes, and its smoother (Rauch, Tung, Striebel).

A state (12,) is a change (6,) of the pose beside a reference (see `scene.motion`) and how fast it changes, per second.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from worker.calibration.geometry.camera import Array
from worker.calibration.geometry.derivatives import POSE_NUMBERS

TURNING_RAD_S2, SHIFTING_M_S2 = np.radians(15.0), 1.0
"""Accelerations, one standard deviation: a mast in wind, 0.3 degrees at 0.5 Hz and a tenth of that at 3 Hz and more."""
FIRST_RAD_S, FIRST_M_S = np.radians(3.0), 0.2
"""How fast a camera may move when the clip begins."""
BACK_RAD, BACK_M = np.radians(0.3), 0.03
"""A mast comes back: with lines unseen for a second, it is about so near to its reference."""
GATE = 38.3
"""Squared innovations in standard deviations that six numbers pass by chance once in a million (chi-square)."""


@dataclass(frozen=True)
class PoseObservation:
    """What one frame says: `change` (6,) of the pose from its reference, and the `information` (6, 6) on it.

    Directions of which nothing is known have no information, whatever `change` says of them.
    """

    change: Array
    information: Array


@dataclass(frozen=True)
class State:
    """What is known at one moment: `mean` (12,), `covariance` (12, 12)."""

    mean: Array
    covariance: Array

    @classmethod
    def at_reference(cls, information: Array) -> State:
        """A camera that is where its reference is, as much as is known (6, 6) of that, and moves nobody knows how."""
        place = np.linalg.inv(information + np.diag(np.repeat([BACK_RAD, BACK_M], 3) ** -2.0))
        speed = np.diag(np.repeat([FIRST_RAD_S, FIRST_M_S], 3) ** 2)
        covariance = np.pad(place, (0, POSE_NUMBERS)) + np.pad(speed, (POSE_NUMBERS, 0))
        return cls(np.zeros(2 * POSE_NUMBERS), np.asarray(covariance, float))

    @property
    def change(self) -> Array:
        """Of the pose, (6,)."""
        return self.mean[:POSE_NUMBERS]

    @property
    def change_covariance(self) -> Array:
        """Of that, (6, 6)."""
        return self.covariance[:POSE_NUMBERS, :POSE_NUMBERS]

    def after(self, seconds: float) -> State:
        """What is to be expected later."""
        onward = _onward(seconds)
        return State(onward @ self.mean, onward @ self.covariance @ onward.T + _unforeseen(seconds))

    def drawn_back(self, seconds: float) -> State:
        """The same with what a mast is known to do for so long: next to nothing where lines are seen."""
        information = np.diag(np.repeat([BACK_RAD, BACK_M], 3) ** -2.0) * seconds
        return self.with_observed(PoseObservation(np.zeros(POSE_NUMBERS), information))

    def surprise(self, observed: PoseObservation) -> float:
        """Squared innovation in its own standard deviations: about as much as numbers were observed, if all is well."""
        away, root, known = self._weighed(observed)
        return float(away @ root @ np.linalg.solve(known, root.T @ away))

    def with_observed(self, observed: PoseObservation) -> State:
        """What is known when a frame has been seen as well. Joseph's form: a covariance that stays one."""
        away, root, known = self._weighed(observed)
        gain = np.linalg.solve(known, (self.covariance[:, :POSE_NUMBERS] @ root).T).T
        kept = np.eye(len(self.mean)) - np.pad(gain @ root.T, ((0, 0), (0, POSE_NUMBERS)))
        return State(self.mean + gain @ (root.T @ away), kept @ self.covariance @ kept.T + gain @ gain.T)

    def _weighed(self, observed: PoseObservation) -> tuple[Array, Array, Array]:
        """How far (6,) the frame is from what was expected, a root (6, 6) of its information, and the covariance (6, 6)
        of what is new when it is looked at through that root: nothing has to be inverted of which nothing is known.
        """
        values, vectors = np.linalg.eigh(observed.information)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        return observed.change - self.change, root, np.eye(POSE_NUMBERS) + root.T @ self.change_covariance @ root


@dataclass(frozen=True)
class FilterStep:
    """One moment of a filter: what was `known` once its frame had been seen. `seconds`: since the moment before."""

    seconds: float
    known: State


def smoothed(steps: Sequence[FilterStep]) -> list[State]:
    """What is known of each moment when all of them have been seen."""
    known = [steps[-1].known]
    for before, later in zip(reversed(steps[:-1]), reversed(steps[1:]), strict=True):
        onward, foretold = _onward(later.seconds), before.known.after(later.seconds)
        gain = np.linalg.solve(foretold.covariance, onward @ before.known.covariance).T
        kept = np.eye(len(gain)) - gain @ onward
        mean = before.known.mean + gain @ (known[-1].mean - foretold.mean)
        # As a sum of what can be no less than nothing.
        later_too = known[-1].covariance + _unforeseen(later.seconds)
        known.append(State(mean, kept @ before.known.covariance @ kept.T + gain @ later_too @ gain.T))
    return known[::-1]


def _onward(seconds: float) -> Array:
    onward = np.eye(2 * POSE_NUMBERS)
    onward[:POSE_NUMBERS, POSE_NUMBERS:] = seconds * np.eye(POSE_NUMBERS)
    return onward


def _unforeseen(seconds: float) -> Array:
    """Covariance (12, 12) of what accelerations that stay for the whole time and then change do to a state."""
    variance = np.diag(np.repeat([TURNING_RAD_S2, SHIFTING_M_S2], 3) ** 2)
    shape = np.array([[seconds**4 / 4, seconds**3 / 2], [seconds**3 / 2, seconds**2]])
    return np.kron(shape, variance)
