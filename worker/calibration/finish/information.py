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
    misfit_px,
    normal_equations,
    weighted,
)
from worker.calibration.finish.robust import tukey_slopes, tukey_weights
from worker.calibration.finish.unknowns import Unknowns
from worker.calibration.memory.camera_memory import CameraMemory
from worker.calibration.scene.camera import Array
from worker.calibration.scene.motion import POSE_NUMBERS
from worker.calibration.scene.parameters import LENS_NUMBERS, LensParameter, lens_numbers
from worker.calibration.see.line_measurement import Measurements

LEAST_HELD, TINY = 1e-9, 1e-300
"""Directions of which the lines say less than this part of what they say of single numbers are said nothing of."""


@dataclass(frozen=True)
class Information:
    """What lines say of the dense unknowns (D,), whatever the ground: `known` (D, D) and `pull` (D,).

    `repeated`: covariance of tonight's poses, and of what was solved for with them, by tonight's measurement alone.
    """

    known: Array
    pull: Array
    repeated: Array


def ask(
    here: Estimate,
    measured: Sequence[Measurements],
    memories: Sequence[CameraMemory | None],
    unknowns: Unknowns,
) -> Information:
    """Ask the lines of tonight (`measured`) and those that are remembered."""
    remembered, rows = _remembered(here, measured, memories, unknowns), here.rows(measured, unknowns)
    dense = unknowns.dense
    together = [*rows, *remembered]
    level = weighted(together, here.heights, unknowns, tukey_weights)
    equations = normal_equations(level)
    steep = weighted(together, here.heights, unknowns, tukey_slopes)
    bread, gradient = normal_equations(steep).information, equations.gradient
    spread = error_of_measurement(level, equations.information)
    repeated = _repeated(here, rows, unknowns) if remembered else _sandwich(here, bread, spread, len(here.cameras))

    # Whatever the ground: its heights are eliminated.
    even = unknowns.ground.precision / here.uneven_m**2
    effect = np.linalg.solve(bread[dense:, dense:] + even, bread[dense:, :dense])
    information = bread[:dense, :dense] - bread[:dense, dense:] @ effect
    pull = effect.T @ (gradient[dense:] + even @ here.heights) - gradient[:dense]
    spread[dense:, dense:] += even
    reduced = np.concatenate([np.eye(dense), -effect.T], axis=1)
    believed = _believed(information, reduced @ spread @ reduced.T)
    return Information(believed, believed @ np.linalg.pinv(information, hermitian=True) @ pull, repeated)


def _remembered(
    here: Estimate,
    measured: Sequence[Measurements],
    memories: Sequence[CameraMemory | None],
    unknowns: Unknowns,
) -> list[Rows]:
    """The rows of all epochs, in the order of their views."""
    rows, view = [], len(here.cameras)
    for camera, memory, found in zip(here.cameras, memories, measured, strict=True):
        if memory is None:
            continue
        repainted = memory.repainted(camera, found, here.lines)
        for epoch in memory.epochs:
            its = epoch.measurements(here.lines)
            its = its[~np.isin(its.points.marking, repainted)]
            its = replace(its, misfit_px=misfit_px(here.lines.position, epoch.camera, its))
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


def _repeated(here: Estimate, rows: Sequence[Rows], unknowns: Unknowns) -> Array:
    """The sandwich of tonight's rows alone."""
    level = weighted(rows, here.heights, unknowns, tukey_weights)
    equations = normal_equations(level)
    steep = normal_equations(weighted(rows, here.heights, unknowns, tukey_slopes))
    return _sandwich(here, steep.information, error_of_measurement(level, equations.information), len(here.cameras))


def _sandwich(here: Estimate, bread: Array, spread: Array, cameras: int) -> Array:
    """Covariance of the poses of tonight and of the numbers in the estimate by the measurement alone.

    By how the pull of the residuals varies, between how the pull changes with the unknowns: Huber's sandwich.
    """
    poses = POSE_NUMBERS * cameras
    weak = here.weak_prior()
    part = np.linalg.inv(bread[:poses, :poses] + weak)
    return np.asarray(part @ (spread[:poses, :poses] + weak) @ part, dtype=float)


def _believed(information: Array, spread: Array) -> Array:
    """The `information` (A, A) that is left when the pull varies by `spread` (A, A) and not by as much as that.

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
    return np.asarray(back @ np.linalg.solve(variance, back.T))
