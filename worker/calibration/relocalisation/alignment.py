"""Alignment of hypotheses with the paint that is seen: Gauss-Newton steps of an iterated closest point, for all at
once.

Each point of a marking is drawn to the nearest paint, across its own line alone: along it nothing is measured. What the
lines leave open stays as it was, by how far a hypothesis may be off.
"""

import numpy as np
from numpy.typing import NDArray

from worker.calibration.geometry.camera import Array
from worker.calibration.geometry.rotation import rotation_matrices
from worker.calibration.relocalisation.agreement import HALF_WIDTH_PX, agreement
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.hypotheses import FARTHEST_BENT, Hypotheses, LensSteps
from worker.calibration.relocalisation.line_view import LineView


def aligned(
    field: FieldMap, view: LineView, cameras: Hypotheses, scores: Array, tolerance_px: float, lens: LensSteps
) -> tuple[Hypotheses, Array]:
    """Return each hypothesis (P,) moved onto the paint as long as its agreement grows, and the agreements."""
    for _ in range(3):
        moved = _stepped(field, view, cameras, tolerance_px, lens)
        of_moved = agreement(field, view, moved, tolerance_px)
        better = of_moved > scores
        if not better.any():
            break
        rows = np.arange(len(cameras))
        cameras = Hypotheses.joined([cameras, moved])[np.where(better, len(cameras) + rows, rows)]
        scores = np.maximum(scores, of_moved)
    return cameras, scores


def _stepped(field: FieldMap, view: LineView, cameras: Hypotheses, tolerance_px: float, lens: LensSteps) -> Hypotheses:
    """Return each hypothesis after one step: of rotation (3), place in its own axes (3), log focal length and bend."""
    focal = cameras.focal_px[:, None]
    ahead_of = np.einsum("pij,pnj->pni", cameras.rotations, field.points[None] - cameras.positions[:, None])
    places, ahead = view.surface.project((ahead_of[..., 0], ahead_of[..., 1], ahead_of[..., 2]), focal)
    seen = np.stack(places, axis=-1)
    outwards = (seen * seen).sum(axis=-1) / HALF_WIDTH_PX**2
    bent = seen * (1 + cameras.bends[:, None] * outwards)[..., None]

    to_paint, in_view = view.to_paint(bent)
    along = np.diff(bent, axis=1, append=bent[:, -1:])
    length = np.linalg.norm(along, axis=-1)
    counted = ahead & in_view & field.joined & (length > 1e-9)
    across = np.stack([-along[..., 1], along[..., 0]], axis=-1) / np.where(counted, length, 1.0)[..., None]
    off = (to_paint * across).sum(axis=-1)
    # Standard deviation of a point of paint measured across its line, view pixels: neighbours share errors.
    weights = np.where(counted, np.exp(-((to_paint**2).sum(axis=-1) / tolerance_px**2)), 0.0) / 2.0**2

    push = view.surface.pulls(ahead_of, across, focal)
    radial = (seen * across).sum(axis=-1)
    # A known lens parameter has a Jacobian of 0, and so stays exactly as it is.
    of_lens = np.stack([radial * (lens.focal > 0), radial * outwards * (lens.bend > 0)], axis=-1)
    jacobian = np.concatenate([np.cross(ahead_of, push), push, of_lens], axis=-1)
    reach = (np.abs(ahead_of[..., 2]) * counted).sum(axis=1) / np.maximum(counted.sum(axis=1), 1)
    # Without counted points nothing is measured, and the step is none.
    reach = np.where(reach > 0, reach, 1.0)
    spread = np.empty((len(cameras), 8))
    # Standard deviation of a hypothesis: of its turn, and of its place as a part of the distance to what it sees.
    spread[:, :3], spread[:, 3:6] = 0.05, 0.06 * reach[:, None]
    spread[:, 6:] = lens.focal or 1.0, lens.bend or 1.0
    weighted = jacobian * weights[..., None]
    information = np.swapaxes(jacobian, 1, 2) @ weighted + np.eye(8) / spread[:, None] ** 2
    step = np.linalg.solve(information, np.einsum("pnk,pn->pk", weighted, off)[..., None])[..., 0]
    return _moved(cameras, step)


def _moved(cameras: Hypotheses, step: Array) -> Hypotheses:
    turned = rotation_matrices(step[:, :3]) @ cameras.rotations
    positions = cameras.positions - np.einsum("pji,pj->pi", turned, step[:, 3:6])
    bends: NDArray[np.float64] = np.clip(cameras.bends + step[:, 7], -FARTHEST_BENT, FARTHEST_BENT)
    return Hypotheses(turned, positions, cameras.focal_px * np.exp(step[:, 6]), bends)
