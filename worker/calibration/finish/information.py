"""What the lines say of poses, lenses and field: tonight's, and those that are remembered.

Every epoch of a memory is one more view, with the mean of what it measured; it shares lens, ground and paint with the
view of tonight, so that what they have in common is known once and not twice (docs/model.md, 4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from worker.calibration.finish.estimate import Estimate
from worker.calibration.finish.least_squares import (
    FEWEST_MEASUREMENTS,
    Rows,
    error_of_measurement,
    normal_equations,
    weighted,
)
from worker.calibration.finish.unknowns import Unknowns
from worker.calibration.memory.camera_memory import CameraMemory
from worker.calibration.robust import tukey_slopes, tukey_weights
from worker.calibration.scene.camera import Array
from worker.calibration.scene.lens import LENS_NUMBERS
from worker.calibration.scene.motion import POSE_NUMBERS
from worker.calibration.scene.parameters import LensParameter, lens_numbers
from worker.calibration.see.line_measurement import Measurements

LEAST_HELD, TINY = 1e-9, 1e-300
"""Directions of which the lines say less than this part of what they say of single numbers are said nothing of."""


@dataclass(frozen=True)
class Information:
    """What lines say of changes of the dense unknowns (D,), whatever the ground: `known` (D, D) and `pull` (D,).

    `level` (K,) and `tilt` (K, D): the heights of the ground are `level - tilt @ changes`. `repeated`: covariance of
    tonight's poses by tonight's measurement alone.
    """

    known: Array
    pull: Array
    level: Array
    tilt: Array
    repeated: Array

    def heights(self, changes: Array) -> Array:
        """The likeliest heights (K,) of the ground after changes (D,)."""
        return self.level - self.tilt @ changes


class Lines:
    """The lines of tonight, and those that are remembered, beside an estimate of everything."""

    def __init__(
        self,
        here: Estimate,
        measured: Sequence[Measurements],
        memories: Sequence[CameraMemory | None],
        unknowns: Unknowns,
    ) -> None:
        self._here, self._unknowns = here, unknowns
        self._tonight = here.rows(measured, unknowns)
        self._remembered = _remembered(here, memories, unknowns)

    def ask(self) -> Information:
        """What they say, weighed by how far they are from the estimate."""
        return self._asked(np.zeros(self._unknowns.dense), self._here.heights)

    def ask_at(self, changes: Array, heights: Array) -> Information:
        """What they say, weighed by how far they are from it after changes (D,), on a ground of `heights` (K,).

        An error of a lens that is known by now is no error of the measurements.
        """
        return self._asked(changes, heights)

    def _asked(self, changes: Array, heights: Array) -> Information:
        unknowns, dense = self._unknowns, self._unknowns.dense
        tonight = [rows.shifted(changes, heights, unknowns) for rows in self._tonight]
        together = [*tonight, *(rows.shifted(changes, heights, unknowns) for rows in self._remembered)]
        flat = weighted(together, heights, unknowns, tukey_weights)
        equations = normal_equations(flat)
        steep = weighted(together, heights, unknowns, tukey_slopes)
        bread, gradient = normal_equations(steep).information, equations.gradient
        spread = error_of_measurement(flat, equations.information)
        alone = self._remembered and _bread_and_spread(tonight, heights, unknowns)
        repeated = _sandwich(self._here, *(alone or (bread, spread)))

        # Whatever the ground: its heights are eliminated.
        even = unknowns.ground.precision / self._here.uneven_m**2
        of_heights = bread[dense:, dense:] + even
        effect: Array = np.asarray(np.linalg.solve(of_heights, bread[dense:, :dense]), dtype=float)
        towards = gradient[dense:] + even @ heights
        information = bread[:dense, :dense] - bread[:dense, dense:] @ effect
        pull = effect.T @ towards - gradient[:dense]
        spread[dense:, dense:] += even
        reduced = np.concatenate([np.eye(dense), -effect.T], axis=1)
        believed, drawn = _believed(information, pull, reduced @ spread @ reduced.T)
        risen = heights - np.asarray(np.linalg.solve(of_heights, towards), dtype=float)
        return Information(believed, drawn + believed @ changes, risen + effect @ changes, effect, repeated)


def _remembered(here: Estimate, memories: Sequence[CameraMemory | None], unknowns: Unknowns) -> list[Rows]:
    """The rows of all epochs, in the order of their views."""
    rows, view = [], len(here.cameras)
    for camera, memory in zip(here.cameras, memories, strict=True):
        for epoch in () if memory is None else memory.epochs:
            its = epoch.measurements(here.lines)
            if camera.ignored is not None:
                its = its[camera.sees(its.pixel)]
            # An epoch has the lens of its time: what that differs by from tonight's is no error.
            differs = lens_numbers(camera.intrinsics) - lens_numbers(epoch.camera.intrinsics)
            if len(its) >= FEWEST_MEASUREMENTS:
                made = Rows.of(here.lines.position, epoch.camera, view, its, unknowns)
                rows.append(replace(made, offset=made.offset + _by_lens(made, unknowns, view, differs)))
            view += 1
    return rows


def _by_lens(rows: Rows, unknowns: Unknowns, view: int, differs: Array) -> Array:
    """How much (M,) px the offsets of a view change when `LENS_NUMBERS` (6,) of its lens do."""
    changed = np.zeros(len(rows.offset))
    owner = unknowns.lenses[view][0] if unknowns.lenses else view
    for column, (_, parameter) in enumerate(unknowns.parameters_of(view), POSE_NUMBERS):
        if isinstance(parameter, LensParameter) and parameter.camera == owner:
            changed += rows.jacobian[:, column] * differs[LENS_NUMBERS.index(parameter.name)]
    return changed


def _bread_and_spread(rows: Sequence[Rows], heights: Array, unknowns: Unknowns) -> tuple[Array, Array]:
    level = weighted(rows, heights, unknowns, tukey_weights)
    equations = normal_equations(level)
    steep = normal_equations(weighted(rows, heights, unknowns, tukey_slopes))
    return steep.information, error_of_measurement(level, equations.information)


def _sandwich(here: Estimate, bread: Array, spread: Array) -> Array:
    """Covariance (6 C, 6 C) of the poses of tonight by the measurement alone.

    By how the pull of the residuals varies, between how the pull changes with the unknowns: Huber's sandwich.
    """
    weak = here.weak_prior()
    poses = len(weak)
    part = np.linalg.inv(bread[:poses, :poses] + weak)
    return np.asarray(part @ (spread[:poses, :poses] + weak) @ part, dtype=float)


def _believed(information: Array, pull: Array, spread: Array) -> tuple[Array, Array]:
    """The `information` (A, A) that is left when the `pull` (A,) varies by `spread` (A, A) and not by as much as that,
    and the pull to the same place that goes with it.

    Few patches of line say little of how it varies in any one direction, so it is drawn to what it does on average.
    """
    scale = np.sqrt(np.maximum(np.diag(information), TINY))
    values, vectors = np.linalg.eigh(information / np.outer(scale, scale))
    held = values > LEAST_HELD
    directions, root = vectors[:, held], np.sqrt(values[held])
    whitening = directions / root / scale[:, None]
    variance = whitening.T @ spread @ whitening
    usual = np.trace(variance) / max(len(variance), 1)
    variance = (variance + usual * np.eye(len(variance))) / 2
    back = directions * root * scale[:, None]
    believed = np.asarray(back @ np.linalg.solve(variance, back.T))
    return believed, believed @ (whitening @ (whitening.T @ pull))
