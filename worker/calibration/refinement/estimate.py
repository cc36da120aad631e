"""Estimate of all unknowns, and its Gauss-Newton steps: cameras, field, and the ground under it.

A weak prior holds each camera near where it was when the lines were caught. Where lines tell something it changes
nothing. Where they do not (a lone touchline) it keeps the camera from running away along them, and the covariance says
how little is known.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from worker.calibration.detection.line_measurement import Measurements
from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.derivatives import POSE_NUMBERS, change_between, moved
from worker.calibration.geometry.field import Field, LinePoints
from worker.calibration.geometry.ground import Belief
from worker.calibration.refinement.least_squares import Rows, normal_equations, rows_of, weigh_rows
from worker.calibration.refinement.unknowns import Unknowns
from worker.calibration.robust import Weigh

POSE_SIGMA: Array = np.repeat([0.03, 1.0], 3)
"""Standard deviation (6,) of a camera's pose before any line is measured: rad and m per axis. It holds the directions
of which lines say nothing."""
TURN_M = 30.0
"""Distance at which a turn counts as the shift of what the camera sees."""


@dataclass(frozen=True)
class Estimate:
    """Current cameras and field of the refinement, parameter `values` (E,) in them, and `heights` (K,) of the ground.

    `uneven_m`: a standard deviation of the heights.
    """

    pitch: Field
    cameras: list[Camera]
    values: Array
    heights: Array
    uneven_m: float

    @classmethod
    def initial(cls, pitch: Field, cameras: Sequence[Camera], unknowns: Unknowns) -> "Estimate":
        """Return the estimate before any step."""
        return cls(
            pitch,
            list(cameras),
            np.zeros(len(unknowns.parameters)),
            np.zeros(len(unknowns.ground)),
            unknowns.ground.usual_m,
        )

    @property
    def lines(self) -> LinePoints:
        """Points of the field's lines that are measured, on its surface."""
        return self.pitch.measured_points

    def on_ground(self, unknowns: Unknowns) -> LinePoints:
        """Return the line points of the field, on its ground."""
        up = unknowns.ground.under_points(self.heights, np.arange(len(self.lines)))
        return replace(self.lines, position=self.lines.position + up[:, None] * [0.0, 0.0, 1.0])

    def moved(self, move: Array, unknowns: Unknowns) -> "Estimate":
        """Return the estimate after a step (U,)."""
        poses, values, heights = np.split(move, [POSE_NUMBERS * unknowns.views, unknowns.dense])
        pitch, cameras = self.pitch, self.cameras
        for parameter, by in zip(unknowns.parameters, values.tolist(), strict=True):
            cameras, pitch = parameter.applied(cameras, pitch, by)
        cameras = [
            moved(camera, change) for camera, change in zip(cameras, poses.reshape(-1, POSE_NUMBERS), strict=True)
        ]
        values, heights = self.values + values, self.heights + heights
        return replace(self, pitch=pitch, cameras=cameras, values=values, heights=heights)

    def largest_move_m(self, other: "Estimate") -> float:
        """Return the largest move (m) of a view between two estimates; turns as shifts at `TURN_M`."""
        changes = [change_between(a, b) for a, b in zip(self.cameras, other.cameras, strict=True)]
        return max(float(np.linalg.norm(c[3:]) + TURN_M * np.linalg.norm(c[:3])) for c in changes)

    def prior(self, unknowns: Unknowns) -> Array:
        """Return the information (U, U) on all unknowns before any line is measured."""
        information = np.zeros((len(unknowns), len(unknowns)))
        poses = POSE_NUMBERS * unknowns.views
        information[:poses, :poses] = self.weak_prior()
        information[poses : unknowns.dense, poses : unknowns.dense] = np.diag(
            [p.expected**-2 for p in unknowns.parameters]
        )
        information[unknowns.dense :, unknowns.dense :] = self.ground_precision(unknowns)
        return information

    def ground_precision(self, unknowns: Unknowns) -> Array:
        """Return the information (K, K) on the heights of the ground before any line is measured."""
        return np.asarray(unknowns.ground.precision / self.uneven_m**2, dtype=float)

    def weak_prior(self) -> Array:
        """Return the information (6 V, 6 V) on the poses before any line is measured."""
        return np.diag(np.tile(POSE_SIGMA**-2, len(self.cameras)))

    def change_from(self, found: Sequence[Camera]) -> Array:
        """Return the change (U,) of all unknowns from where they were `found` by the search or given."""
        changes = [change_between(before, now) for before, now in zip(found, self.cameras, strict=True)]
        return np.concatenate([*changes, self.values, self.heights])

    def rows(self, measured: Sequence[Measurements], unknowns: Unknowns) -> list[Rows]:
        """Return the rows of every view's measurements at its pose."""
        return rows_of(self.lines.position, self.cameras, measured, unknowns)


@dataclass(frozen=True)
class GaussNewtonStep:
    """Result of a Gauss-Newton step `to` an estimate: the `move` (U,), and the `covariance` (U, U) before it."""

    to: Estimate
    move: Array
    covariance: Array

    def unevenness(self, unknowns: Unknowns, before: Belief) -> float:
        """Return the standard deviation (m) of the ground that the heights speak for; `before`: the prior."""
        of_heights = self.covariance[unknowns.dense :, unknowns.dense :]
        return unknowns.ground.unevenness(self.to.heights, of_heights, self.to.uneven_m, before)


def gauss_newton_step(
    estimate: Estimate, found: Sequence[Camera], measured: Sequence[Measurements], unknowns: Unknowns, weigh: Weigh
) -> GaussNewtonStep:
    """Take one Gauss-Newton step for all unknowns; `found`: poses at which the weak prior is centred."""
    equations = normal_equations(weigh_rows(estimate.rows(measured, unknowns), estimate.heights, unknowns, weigh))
    prior = estimate.prior(unknowns)
    gradient = equations.gradient + prior @ estimate.change_from(found)
    covariance = np.asarray(np.linalg.inv(equations.information + prior), dtype=float)
    move = -covariance @ gradient
    return GaussNewtonStep(estimate.moved(move, unknowns), move, covariance)
