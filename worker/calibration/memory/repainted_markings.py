"""Repainted markings: told from a camera that moved and from a zoom.

Between two nights the wind moves a camera a little; somebody may have touched it, its focal length may have changed,
and single markings may lie elsewhere. What lens, ground and paint have wrong is the same in both nights and cancels, so
tenths of a pixel tell these apart: of the changes that may be, those are taken one by one that explain most of what is
left (orthogonal matching pursuit; Pati, Rezaiifar and Krishnaprasad, 1993).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.line_measurement import NOISE_PX, Measurements
from worker.calibration.geometry.arrays import Array
from worker.calibration.geometry.derivatives import POSE_NUMBERS
from worker.calibration.geometry.field import LinePoints
from worker.calibration.geometry.lens import LENS_PARAMETERS
from worker.calibration.memory.camera_memory import WIND, CameraMemory
from worker.calibration.memory.epoch import SAME_VIEW_PX, Epoch
from worker.calibration.robust import HUBER, robust_scale


def find_repainted_markings(memory: CameraMemory, measured: Measurements, lines: LinePoints) -> NDArray[np.intp]:
    """Return the markings whose paint lies elsewhere than in the first nights, where the lines are `measured` tonight.

    Markings that the memory already says are repainted stay among them: their true place is unknown.
    """
    known = np.array(memory.repainted_markings, dtype=np.intp)
    camera = memory.last.camera
    differ = _Differences.between(memory.last, measured, lines)
    if differ.usual_px > SAME_VIEW_PX * camera.intrinsics.relative_size:
        return known
    markings, counts = np.unique(differ.marking, return_counts=True)
    candidates = markings[counts >= 8]
    # A repainted marking has moved by more than 2.5 cm and half a pixel of a 4K frame.
    limit_px = 0.5 * camera.intrinsics.relative_size
    repainted = [
        number
        for number, metres in differ.explained_by(candidates).items()
        if abs(metres) > 0.025 and abs(metres) * np.median(differ.across[differ.marking == number]) > limit_px
    ]
    together = np.union1d(known, repainted).astype(np.intp)
    # If more markings have moved it is not the paint.
    believable = len(together) <= 0.34 * len(np.union1d(known, candidates))
    return together if believable else known


@dataclass(frozen=True)
class _Differences:
    """Differences (M,) px between tonight's lines and those of an epoch, seen from the epoch's camera.

    `marking` (M,); `jacobian` (M, 6) of the offset, px per rad and metre of the pose; `longer` (M,) px when the focal
    length doubles; `across` (M,) px per metre.
    """

    offset: Array
    marking: NDArray[np.intp]
    jacobian: Array
    longer: Array
    across: Array

    @classmethod
    def between(cls, last: Epoch, measured: Measurements, lines: LinePoints) -> "_Differences":
        """Return the differences at the line points that were measured well in the epoch and tonight."""
        # A mark that has moved across itself shows it at its sides, and one that is longer or shorter has not moved.
        measured = measured[~measured.points.end_to_end]
        index, tonight, before = np.intersect1d(measured.index, last.index, return_indices=True)
        measured, camera, positions = measured[tonight], last.camera, lines.position[index]
        offset = measured.offset(camera, positions) - last.offset[before]
        jacobian = measured.jacobian(camera, positions)
        focal = measured.lens_jacobian(camera, positions)[:, LENS_PARAMETERS.index("focal_length_px")]
        known = np.isfinite(offset) & np.isfinite(jacobian).all(axis=1) & np.isfinite(focal)
        longer = focal * camera.intrinsics.focal_length_px
        return cls(
            offset[known], lines.marking[index][known], jacobian[known], longer[known], measured.px_per_metre[known]
        )

    @property
    def usual_px(self) -> float:
        """Median distance of a line from its earlier place."""
        return float(np.median(np.abs(self.offset))) if len(self.offset) else np.inf

    def explained_by(self, candidates: NDArray[np.intp]) -> dict[int, float]:
        """Return the markings that have moved, in metres; camera and focal length may have changed too."""
        open_to: dict[int | str, Array] = {"zoomed": self.longer[:, None], "touched": self.jacobian}
        for marking in candidates.tolist():
            open_to[marking] = (self.across * (self.marking == marking))[:, None]
        sigma_px = self._sigma_px(list(open_to.values()))
        taken: dict[int | str, Array] = {}
        loss, change = self._fitted([], sigma_px)
        while open_to:
            tried = {name: self._fitted([*taken.values(), its], sigma_px) for name, its in open_to.items()}
            best = min(tried, key=lambda name: tried[name][0])
            # Half the sum of squares, in units of the expected errors, that a change has to explain to be accepted.
            if loss - tried[best][0] < 30.0:
                break
            loss, change = tried[best]
            taken[best] = open_to.pop(best)
        parts = np.split(change[POSE_NUMBERS:], np.cumsum([its.shape[1] for its in taken.values()])[:-1])
        # The offset of a line shrinks when the line is expected where it has moved to.
        return {name: -float(by[0]) for name, by in zip(taken, parts, strict=False) if isinstance(name, int)}

    def _sigma_px(self, columns: Sequence[Array]) -> float:
        """Return the standard deviation of a difference: of two measurements, or more if changes leave more."""
        usual = float(np.hypot(NOISE_PX, NOISE_PX))
        _, change = self._fitted(columns, usual)
        return usual * robust_scale((self.offset + np.concatenate([self.jacobian, *columns], axis=1) @ change) / usual)

    def _fitted(self, columns: Sequence[Array], sigma_px: float) -> tuple[float, Array]:
        """Return Huber's loss and the change (6 + n,) of pose and `columns` (M, n) that minimises it."""
        jacobian = np.concatenate([self.jacobian, *columns], axis=1) / sigma_px
        known = np.eye(POSE_NUMBERS, jacobian.shape[1]) / WIND[:, None]
        tiny = 1e-12
        scale = np.maximum(np.linalg.norm(jacobian, axis=0), tiny)
        offset, weight = self.offset / sigma_px, np.ones(len(self.offset))
        change = np.zeros(jacobian.shape[1])
        for _ in range(4):
            root = np.sqrt(weight)
            rows = np.concatenate([jacobian * root[:, None], known]) / scale
            change = np.linalg.lstsq(rows, np.append(-offset * root, np.zeros(POSE_NUMBERS)), rcond=1e-9)[0] / scale
            residual = np.abs(offset + jacobian @ change)
            weight = np.minimum(1.0, HUBER / np.maximum(residual, tiny))
        loss = np.sum(weight * (2 - weight) * residual**2) + np.sum((known @ change) ** 2)
        return float(loss) / 2, change
