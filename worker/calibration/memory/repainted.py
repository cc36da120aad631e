"""Markings that have been painted anew, elsewhere: told from a camera that moved and from a zoom.

Between two nights a pose changes, a focal length may, and single markings may. What lens, ground and paint have wrong
is the same in both and cancels, so tenths of a pixel tell the three apart: of the changes that may be, those are taken
one by one that explain most of what is left (orthogonal matching pursuit; Pati, Rezaiifar and Krishnaprasad, 1993).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from worker.calibration.memory.camera_memory import CameraMemory
from worker.calibration.memory.epoch import Epoch
from worker.calibration.robust import HUBER, robust_scale
from worker.calibration.scene.camera import Array, Camera
from worker.calibration.scene.field import LinePoints
from worker.calibration.scene.motion import POSE_NUMBERS
from worker.calibration.scene.parameters import lens_parameters
from worker.calibration.see.line_measurement import NOISE_PX, Measurements

LEAST_M, LEAST_PX = 0.025, 0.5
"""A marking that has moved by more than both, pixels of a 4K frame, has been painted anew ..."""
FEWEST_POINTS, MOST_MARKINGS = 8, 0.34
"""... if so many of its points were measured in both nights, and no larger part of all markings has: else it is not
the paint."""
LEAST_GAIN = 30.0
"""Half the sum of squares, in units of the expected errors, that a change has to explain to be one."""
ROUNDS = 4
HELD, TINY = 1e-9, 1e-12


def painted_anew(memory: CameraMemory, camera: Camera, measured: Measurements, lines: LinePoints) -> NDArray[np.intp]:
    """The markings whose paint lies elsewhere than in the first nights, where `camera` has `measured` the lines tonight.

    Those that the memory says so of stay among them: nobody knows better where they are supposed to lie.
    """
    known = np.array(memory.aside, dtype=np.intp)
    if not memory.last.looks_like(camera, lines):
        return known
    differ = _Differences.between(memory.last, camera, measured, lines)
    markings, counts = np.unique(differ.marking, return_counts=True)
    candidates = markings[counts >= FEWEST_POINTS]
    limit_px = LEAST_PX * camera.intrinsics.relative_size
    anew = [
        number
        for number, metres in differ.explained_by(candidates).items()
        if abs(metres) > LEAST_M and abs(metres) * np.median(differ.across[differ.marking == number]) > limit_px
    ]
    believable = len(anew) <= MOST_MARKINGS * len(candidates)
    return np.union1d(known, anew if believable else []).astype(np.intp)


@dataclass(frozen=True)
class _Differences:
    """How far (M,) px the lines of tonight are beside those of an epoch, each measured from where its camera puts it.

    `marking` (M,); `slopes` (M, 6) px per rad and metre of the pose; `longer` (M,) px by which the lines move when the
    focal length doubles; `across` (M,) px per metre.
    """

    offset: Array
    marking: NDArray[np.intp]
    slopes: Array
    longer: Array
    across: Array

    @classmethod
    def between(cls, last: Epoch, camera: Camera, measured: Measurements, lines: LinePoints) -> _Differences:
        """Of the line points that were measured well in both."""
        index, tonight, before = np.intersect1d(measured.index, last.index, return_indices=True)
        measured = measured[tonight]
        positions = lines.position[index]
        (focal,) = (p for p in lens_parameters([camera]) if p.name == "focal_length_px")
        ahead, behind = (focal.changed(camera, sign * focal.step).project(positions) for sign in (1, -1))
        by_px = -np.sum((ahead - behind) * measured.normal, axis=1) / (2 * focal.step)
        offset = measured.offset(camera, positions) - last.offset[before]
        slopes = measured.slopes(camera, positions)
        known = np.isfinite(offset) & np.isfinite(slopes).all(axis=1) & np.isfinite(by_px)
        longer = by_px * camera.intrinsics.focal_length_px
        across = measured.px_per_metre
        return cls(offset[known], lines.marking[index][known], slopes[known], longer[known], across[known])

    def explained_by(self, candidates: NDArray[np.intp]) -> dict[int, float]:
        """Which markings have moved, and by how many metres, where pose and focal length may have changed as well."""
        open_to: dict[int | None, Array] = {None: self.longer[:, None]}
        for marking in candidates.tolist():
            open_to[marking] = (self.across * (self.marking == marking))[:, None]
        sigma_px = self._sigma_px([self.slopes, *open_to.values()])
        columns, taken = [self.slopes], list[int | None]()
        loss, change = self._fitted(columns, sigma_px)
        while open_to:
            tried = {name: self._fitted([*columns, column], sigma_px) for name, column in open_to.items()}
            best = min(tried, key=lambda name: tried[name][0])
            if loss - tried[best][0] < LEAST_GAIN:
                break
            loss, change = tried[best]
            columns.append(open_to.pop(best))
            taken.append(best)
        moved = zip(taken, change[POSE_NUMBERS:].tolist(), strict=True)
        # The offset of a line shrinks when the line is expected where it has moved to.
        return {name: -by for name, by in moved if name is not None}

    def _sigma_px(self, columns: Sequence[Array]) -> float:
        """Error of a difference: of two measurements, or more where even all changes together leave more."""
        usual = float(np.hypot(NOISE_PX, NOISE_PX))
        _, change = self._fitted(columns, usual)
        return usual * robust_scale((self.offset + np.concatenate(columns, axis=1) @ change) / usual)

    def _fitted(self, columns: Sequence[Array], sigma_px: float) -> tuple[float, Array]:
        """Huber's loss where the change (n,) of columns (M, n) makes it least, and that change."""
        jacobian, offset = np.concatenate(columns, axis=1) / sigma_px, self.offset / sigma_px
        scale = np.maximum(np.linalg.norm(jacobian, axis=0), TINY)
        change, weight = np.zeros(jacobian.shape[1]), np.ones(len(offset))
        for _ in range(ROUNDS):
            root = np.sqrt(weight)
            change = np.linalg.lstsq(jacobian / scale * root[:, None], -offset * root, rcond=HELD)[0] / scale
            left = np.abs(offset + jacobian @ change)
            weight = np.minimum(1.0, HUBER / np.maximum(left, TINY))
        return float(np.sum(weight * (2 - weight) * left**2) / 2), change
