"""Registration of two cameras by the line points that both have measured.

The same registration as that of two pictures of responses (`registration`), of their line centres seen from above:
small turns and moves of both cameras that bring the paint of the one onto that of the other. It costs a hundredth, and
does without the network. Each point is the same piece of line in both views: what is nearer to another line than to its
own cannot be registered, which is for the responses to do.
"""

from dataclasses import dataclass

import numpy as np

from worker.calibration.detection.line_measurement import Measurements
from worker.calibration.diagnostics.registration import (
    FINE_HALF_M,
    LEAST_SUPPORT_M,
    LOOSE_M,
    PIXEL_M,
    Registration,
    common_ground,
    forms_of_both,
)
from worker.calibration.diagnostics.seam import paint_apart
from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.field import Field
from worker.calibration.robust import huber_weights


@dataclass(frozen=True)
class MeasuredLines:
    """Camera and the line points `measured` in its frame."""

    camera: Camera
    measured: Measurements


def register_lines(pitch: Field, first: MeasuredLines, second: MeasuredLines) -> Registration | None:
    """Register the lines of two cameras around the field's centre, or the markings in common nearest to it.

    None where both have measured too little of the same lines to hold the views in the directions that they should.
    """
    ground = common_ground(pitch, first.camera, second.camera)
    centre = ground.centre
    if centre is None:
        return None
    lines = pitch.measured_points
    index, apart, sigma = paint_apart(lines, (first.camera, first.measured), (second.camera, second.measured))
    near = np.abs(lines.position[index, :2] - centre).max(axis=1) < FINE_HALF_M
    index, apart, sigma = index[near], apart[near], sigma[near]
    # The ends of a mark add nothing to its length.
    support_m = int(np.sum(~lines.end_to_end[index])) * lines.spacing
    if support_m < LEAST_SUPPORT_M:
        return None
    points = lines[index]
    forms = forms_of_both(first.camera, second.camera, points.position)
    at_centre = forms_of_both(first.camera, second.camera, pitch.lift(centre))
    moves, covariance = _moves(
        np.einsum("md,mdj->mj", points.normal[:, :2], forms), apart, sigma, lines.spacing, at_centre
    )

    variance, directions = np.linalg.eigh(at_centre @ covariance @ at_centre.T)
    directions_held = directions[:, variance < LOOSE_M**2][:, : ground.directions]
    if directions_held.shape[1] < ground.directions:
        return None
    dx, dy = directions_held @ directions_held.T @ at_centre @ moves / PIXEL_M
    return Registration(float(dx), float(dy), support_m, (first.camera.id, second.camera.id), centre, directions_held)


def _moves(jacobian: Array, apart: Array, sigma: Array, spacing_m: float, at_centre: Array) -> tuple[Array, Array]:
    """Return the turns and moves (12,) of both cameras that explain distances `apart` (M,) m, and their covariance.

    `jacobian` (M, 12): of those by the moves; `at_centre` (2, 12): of the displacement there. The prior shrinks with
    the displacement found, and the covariance is that of cameras with the full prior.
    """
    expected = np.linalg.inv(at_centre @ at_centre.T)
    # Length of line over which two views differ alike, by their lenses and by the ground: it counts as one point.
    alike = max(2.5 / spacing_m, 1.0)
    moves: Array = np.zeros(jacobian.shape[1])
    # Least part of the expected turns and moves that is expected, step by step (see `registration.FINE_STAGES`).
    for least in (1.0, 0.3, 0.1, 0.01):
        weight = huber_weights((apart - jacobian @ moves) / sigma) / (sigma**2 * alike)
        information = (jacobian * weight[:, None]).T @ jacobian
        found = at_centre @ moves
        prior = 1 / max(float(found @ expected @ found), least**2)
        moves = np.asarray(
            np.linalg.solve(information + prior * np.eye(len(moves)), jacobian.T @ (weight * apart)), float
        )
    return moves, np.asarray(np.linalg.inv(information + np.eye(len(moves))), dtype=float)
