"""Errors that a calibration would have, by the lines that its cameras would see: of a plan, before any frame exists."""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from worker.calibration.detection.line_measurement import Measurements
from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.field import Field
from worker.calibration.geometry.ground import Ground
from worker.calibration.refinement.estimate import Estimate
from worker.calibration.refinement.information import expected_information
from worker.calibration.refinement.least_squares import FEWEST_MEASUREMENTS, Rows
from worker.calibration.refinement.priors import unknowns_of
from worker.calibration.refinement.uncertainty import Sigma
from worker.calibration.refinement.unknowns import Unknowns


@dataclass(frozen=True)
class ExpectedErrors:
    """Expected errors of C cameras: `information` (D, D) of the lines on the dense `unknowns`, and what is known before
    them, `pose_precision` (6 C, 6 C) and `variance` (E,) of the parameters of lenses and field.

    Errors are true values minus those that a calibration answers or is given.
    """

    unknowns: Unknowns
    information: Array
    pose_precision: Array
    variance: Array

    @property
    def _poses(self) -> int:
        return len(self.pose_precision)

    @cached_property
    def by_measurement(self) -> Array:
        """Covariance (6 C, 6 C) of poses whose lenses and field are known to the last digit."""
        poses = self._poses
        return np.asarray(np.linalg.inv(self.information[:poses, :poses] + self.pose_precision), dtype=float)

    @cached_property
    def response(self) -> Array:
        """Change (6 C, E) of the poses that least squares finds when parameters of lenses and field change."""
        return np.asarray(-self.by_measurement @ self.information[: self._poses, self._poses :], dtype=float)

    @cached_property
    def as_given(self) -> Array:
        """Covariance (D, D) of the poses that are answered for lenses and field as given, with the errors of those.

        The poses follow an error of lens or field as least squares does (docs/model.md, 5).
        """
        poses = self._poses
        follow = np.concatenate([self.response, np.eye(len(self.variance))])
        covariance = (follow * self.variance) @ follow.T
        covariance[:poses, :poses] += self.by_measurement
        return np.asarray(covariance, dtype=float)

    @cached_property
    def refined(self) -> Array:
        """Covariance (D, D) of poses, lenses and field that are solved for together."""
        prior = np.diag(np.concatenate([np.diag(self.pose_precision), 1 / self.variance]))
        return np.asarray(np.linalg.inv(self.information + prior), dtype=float)

    def sigma(self, camera: int, covariance: Array) -> Sigma:
        """Return the standard deviation of a camera's pose by a covariance (D, D) or (6 C, 6 C)."""
        own = self.unknowns.pose(camera)
        return Sigma.from_covariance(covariance[own, own])


class ErrorModel:
    """Errors that cameras at their poses, their lenses and their field may have."""

    def __init__(self, pitch: Field, cameras: Sequence[Camera]) -> None:
        solved = Unknowns(len(cameras), (), Ground.under(pitch.measured_points))
        self._estimate = Estimate.initial(pitch, cameras, solved)
        self.unknowns = unknowns_of(self._estimate, [None] * len(cameras), solved)
        self._rows = dict[int, tuple[Camera, Measurements, Rows]]()

    def at_poses(self, cameras: Sequence[Camera]) -> "ErrorModel":
        """Return the model of the same cameras at other poses, whose unknowns and ground are the same."""
        other = copy(self)
        other._estimate = replace(self._estimate, cameras=list(cameras))
        return other

    def expect(self, measured: Sequence[Measurements]) -> ExpectedErrors:
        """Return the errors expected of a calibration by lines `measured` where the poses of the cameras put them."""
        return ExpectedErrors(
            self.unknowns,
            expected_information(self._estimate, self._rows_of(measured), self.unknowns),
            self._estimate.weak_prior(),
            np.array([parameter.expected**2 for parameter in self.unknowns.parameters]),
        )

    def _rows_of(self, measured: Sequence[Measurements]) -> list[Rows]:
        """Return the rows of the views, those of the first time where neither camera nor measurements are others."""
        views = enumerate(zip(self._estimate.cameras, measured, strict=True))
        return [self._of_view(view, *its) for view, its in views if len(its[1]) >= FEWEST_MEASUREMENTS]

    def _of_view(self, view: int, camera: Camera, measured: Measurements) -> Rows:
        before = self._rows.get(view)
        if before is not None and before[0] is camera and before[1] is measured:
            return before[2]
        rows = Rows.of(self._estimate.lines.position, camera, view, measured, self.unknowns)
        self._rows.setdefault(view, (camera, measured, rows))
        return rows
