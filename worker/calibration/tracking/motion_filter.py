"""Kalman filter of one camera's pose with constant velocity, and its smoother (Rauch, Tung, Striebel).

A state (12,) is a change (6,) of the pose beside a reference (see `geometry.derivatives`) and its velocity, per second.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from worker.calibration.geometry.camera import Array
from worker.calibration.geometry.derivatives import POSE_NUMBERS

BACK_RAD, BACK_M = np.radians(0.3), 0.03
"""Standard deviation of a mast around its reference, to which it comes back when lines are unseen for a second."""
GATE = 38.3
"""Squared innovation that six normal variables exceed by chance once in a million (chi-square)."""


@dataclass(frozen=True)
class PoseObservation:
    """Observation by one frame: `change` (6,) of the pose from its reference, and the `information` (6, 6) on it.

    Directions of which nothing is known have no information, whatever `change` says of them.
    """

    change: Array
    information: Array


@dataclass(frozen=True)
class State:
    """State at one moment: `mean` (12,), `covariance` (12, 12)."""

    mean: Array
    covariance: Array

    @classmethod
    def at_reference(cls, information: Array) -> "State":
        """Return the state of a camera at its reference, known to this information (6, 6), with unknown velocity."""
        place = np.linalg.inv(information + np.diag(np.repeat([BACK_RAD, BACK_M], 3) ** -2.0))
        # The velocity when the clip begins.
        speed = np.diag(np.repeat([np.radians(3.0), 0.2], 3) ** 2)
        covariance = np.pad(place, (0, POSE_NUMBERS)) + np.pad(speed, (POSE_NUMBERS, 0))
        return cls(np.zeros(2 * POSE_NUMBERS), np.asarray(covariance, float))

    @property
    def change(self) -> Array:
        """Change (6,) of the pose."""
        return self.mean[:POSE_NUMBERS]

    @property
    def change_covariance(self) -> Array:
        """Covariance (6, 6) of the change."""
        return self.covariance[:POSE_NUMBERS, :POSE_NUMBERS]

    def after(self, seconds: float) -> "State":
        """Return the state predicted so long after."""
        transition = _transition(seconds)
        return State(transition @ self.mean, transition @ self.covariance @ transition.T + _process_noise(seconds))

    def with_mast_prior(self, seconds: float) -> "State":
        """Return the state with the prior of a mast over so long a time: next to nothing where lines are seen."""
        information = np.diag(np.repeat([BACK_RAD, BACK_M], 3) ** -2.0) * seconds
        return self.with_observed(PoseObservation(np.zeros(POSE_NUMBERS), information))

    def squared_innovation(self, observed: PoseObservation) -> float:
        """Return the squared innovation in its standard deviations: about the number of observed directions."""
        innovation, root, innovation_covariance = self._innovation(observed)
        return float(innovation @ root @ np.linalg.solve(innovation_covariance, root.T @ innovation))

    def with_observed(self, observed: PoseObservation) -> "State":
        """Return the state updated by a frame, in Joseph's form: a covariance that stays one."""
        innovation, root, innovation_covariance = self._innovation(observed)
        gain = np.linalg.solve(innovation_covariance, (self.covariance[:, :POSE_NUMBERS] @ root).T).T
        remainder = np.eye(len(self.mean)) - np.pad(gain @ root.T, ((0, 0), (0, POSE_NUMBERS)))
        return State(
            self.mean + gain @ (root.T @ innovation), remainder @ self.covariance @ remainder.T + gain @ gain.T
        )

    def _innovation(self, observed: PoseObservation) -> tuple[Array, Array, Array]:
        """Return the innovation (6,), a root (6, 6) of the frame's information, and the covariance (6, 6) of the
        innovation through that root: no unknown direction has to be inverted."""
        values, vectors = np.linalg.eigh(observed.information)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        return observed.change - self.change, root, np.eye(POSE_NUMBERS) + root.T @ self.change_covariance @ root


@dataclass(frozen=True)
class FilterStep:
    """Moment of a filter: its `state` after the frame. `seconds`: since the moment before."""

    seconds: float
    state: State


def smoothed(steps: Sequence[FilterStep]) -> list[State]:
    """Return the state of each moment given all of them."""
    states = [steps[-1].state]
    for before, later in zip(reversed(steps[:-1]), reversed(steps[1:]), strict=True):
        transition, predicted = _transition(later.seconds), before.state.after(later.seconds)
        gain = np.linalg.solve(predicted.covariance, transition @ before.state.covariance).T
        remainder = np.eye(len(gain)) - gain @ transition
        mean = before.state.mean + gain @ (states[-1].mean - predicted.mean)
        # A sum of positive semidefinite matrices.
        later_covariance = states[-1].covariance + _process_noise(later.seconds)
        states.append(State(mean, remainder @ before.state.covariance @ remainder.T + gain @ later_covariance @ gain.T))
    return states[::-1]


def _transition(seconds: float) -> Array:
    transition = np.eye(2 * POSE_NUMBERS)
    transition[:POSE_NUMBERS, POSE_NUMBERS:] = seconds * np.eye(POSE_NUMBERS)
    return transition


def _process_noise(seconds: float) -> Array:
    """Return the covariance (12, 12) of a state by accelerations that are constant over the time."""
    # A mast in wind: 0.3 degrees at 0.5 Hz and a tenth of that at 3 Hz and more.
    variance = np.diag(np.repeat([np.radians(15.0), 1.0], 3) ** 2)
    shape = np.array([[seconds**4 / 4, seconds**3 / 2], [seconds**3 / 2, seconds**2]])
    return np.kron(shape, variance)
