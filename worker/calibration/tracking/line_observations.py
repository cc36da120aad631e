"""What the painted lines of one frame say of the pose of a camera that is almost where it is expected. No network.

Lens, paint and ground put each piece of line a little beside where the model has it, frame after frame by as much. That
is learned, piece by piece, while the clip runs: otherwise the pose would jump whenever a player hides some of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.contrast import Channels
from worker.calibration.detection.line_measurement import Measurements, measure_lines
from worker.calibration.geometry.camera import Array, Camera, Frame
from worker.calibration.geometry.derivatives import POSE_NUMBERS, change_between, moved, pixel_slopes
from worker.calibration.geometry.field import Field, LinePoints
from worker.calibration.geometry.visibility import VisibleLines
from worker.calibration.refinement.least_squares import CLUSTER_POINTS
from worker.calibration.robust import huber_weights, tukey_weights
from worker.calibration.tracking.learned_offsets import LearnedOffsets
from worker.calibration.tracking.motion_filter import PoseObservation

APART_PX = 12.0
"""Pieces of line are looked at about so far apart, in pixels of a 4K frame."""
COARSELY = 3
"""All rounds but the last look at every so many-th piece."""
FEWEST_PIECES, FEWEST_SHARE = 20, 0.3
"""With fewer pieces of line, or with less than this share of those that are usually found, a frame says nothing."""
SHOWN, AT_REFERENCE_PX = 0.5, 3.0
"""Of a marking so much has to be found near the reference, in pixels of a 4K frame, for it to be followed."""
NOVELTY = 0.05
"""By so much of the difference a frame changes how many are usual."""
BESIDE_PX = 1.0
"""How far a piece of line may lie beside its place for good, one standard deviation, in pixels of a 4K frame."""
NOISE_PX = 0.1
"""Least error of the measurement of a piece, in pixels of the frame."""
PICTURE_PX = 0.04
"""Error that all pieces of a frame have in common: what a codec and the grid of pixels do to every line alike."""
PRIOR_RAD, PRIOR_M = 0.03, 1.0
"""Holds the directions of which lines say nothing; much wider than anything that is followed."""
STEPS = 3


@dataclass(frozen=True)
class LineObservations:
    """Pieces of line as one frame shows them, M of them.

    `expected`: the camera they were looked for with; `piece` (M,): which of them; `offset` (M,) px: how far each is
    from where that camera expects it, and `slope` (M, 6): how that expectation moves with its pose.
    """

    expected: Camera
    piece: NDArray[np.intp]
    offset: Array
    slope: Array

    def __getitem__(self, chosen: NDArray[np.bool_]) -> LineObservations:
        return LineObservations(self.expected, self.piece[chosen], self.offset[chosen], self.slope[chosen])


class TrackedLines:
    """The lines that one camera is followed by; `reference`: the camera that changes are counted from.

    `first`: the frame that the reference was found in. Markings that it hardly shows are not looked for: they would
    be, in every frame, in every colour.
    """

    def __init__(self, pitch: Field, reference: Camera, first: Frame) -> None:
        self.reference = reference
        self._scale = reference.intrinsics.relative_size
        self._no_network = np.zeros(first.shape[:2], np.float32)
        lines = pitch.line_points()
        chosen = self._shown(lines, first)
        self._pieces = lines[chosen]
        self._some = np.arange(0, len(chosen), COARSELY)
        self._patch = chosen // CLUSTER_POINTS
        self._usual = 0.0
        self._beside = LearnedOffsets(len(chosen), BESIDE_PX * self._scale, NOISE_PX)

    def _shown(self, lines: LinePoints, first: Frame) -> NDArray[np.intp]:
        """Which of the line points: some of each marking that the first frame shows."""
        expected = VisibleLines.from_camera(lines, self.reference).thinned(APART_PX * self._scale).index
        found = self._measured(lines[expected], self.reference, Channels([first]), AT_REFERENCE_PX).index
        marking = lines.marking[expected]
        known, looked_for = (
            np.bincount(marking[found], minlength=len(lines)),
            np.bincount(marking, minlength=len(lines)),
        )
        return expected[(known >= SHOWN * looked_for)[marking]]

    def sighted(self, frame: Frame, expected: Camera, searches_px: Sequence[float]) -> LineObservations | None:
        """The pieces that a frame shows near where a camera expects them; None where they are too few.

        `searches_px`: how near, in pixels of a 4K frame, round by round from where the last one saw the camera. What
        is measured far from where it was expected is a little off, so the last round is a narrow one.
        """
        channels = Channels([frame])
        for search in searches_px[:-1]:
            seen = self._within(search, channels, expected, self._some)
            if seen is None:
                return None
            expected = moved(self.reference, self.observed(seen).change)
        return self._within(searches_px[-1], channels, expected, np.arange(len(self._pieces)))

    def _within(
        self, search_px: float, channels: Channels, expected: Camera, pieces: NDArray[np.intp]
    ) -> LineObservations | None:
        found = self._measured(self._pieces[pieces], expected, channels, search_px)
        points = found.points.position
        offset = np.sum((found.pixel - expected.project(points)) * found.normal, axis=1)
        slope = np.einsum("mij,mi->mj", pixel_slopes(expected, points), found.normal)
        good = np.isfinite(offset) & np.isfinite(slope).all(axis=1)
        if good.sum() < max(FEWEST_PIECES, FEWEST_SHARE * self._usual * len(pieces) / len(self._pieces)):
            return None
        return LineObservations(expected, pieces[found.index[good]], offset[good], slope[good])

    def _measured(self, lines: LinePoints, expected: Camera, channels: Channels, search_px: float) -> Measurements:
        return measure_lines(lines, expected, channels, self._no_network, search_px * self._scale)

    def observed(self, seen: LineObservations) -> PoseObservation:
        """What they say of the pose: robust least squares, with what pieces of one patch err together."""
        seen = self._known(seen)
        sigma = self._sigma(seen)
        rows, values = seen.slope / sigma[:, None], (seen.offset - self._beside.mean[seen.piece]) / sigma
        prior = np.diag(np.repeat([PRIOR_RAD, PRIOR_M], 3) ** -2.0)
        change = np.zeros(POSE_NUMBERS)
        for weigh in (*STEPS * [huber_weights], *STEPS * [tukey_weights]):
            weight = weigh(values - rows @ change)
            information = (rows * weight[:, None]).T @ rows
            change = np.asarray(np.linalg.solve(information + prior, rows.T @ (weight * values)), float)
        spread = self._spread(seen, rows * (weight * (values - rows @ change))[:, None])
        together = float(np.trace(np.linalg.solve(information + prior, spread))) / POSE_NUMBERS
        known = information / max(1.0, together)
        of_picture = np.diag(np.repeat([PICTURE_PX / seen.expected.intrinsics.focal_length_px, 0.0], 3) ** 2)
        return PoseObservation(
            change_between(self.reference, moved(seen.expected, change)),
            np.asarray(np.linalg.solve(np.eye(POSE_NUMBERS) + known @ of_picture, known), float),
        )

    def _known(self, seen: LineObservations) -> LineObservations:
        """The pieces that have been seen before, or all where those are too few.

        A whole line that a wrong lens puts at the end of what is looked at comes into it when the pose stirs, and would
        pull the pose by as much as it lies beside its place.
        """
        known = self._beside.are_known[seen.piece]
        return seen[known] if known.sum() >= FEWEST_PIECES else seen

    def learn(self, seen: LineObservations, now: Camera) -> None:
        """Keep how far beside their places the pieces lie when the camera is where it is `now` known to be."""
        left = seen.offset - seen.slope @ change_between(seen.expected, now)
        counted = tukey_weights((left - self._beside.mean[seen.piece]) / self._sigma(seen)) > 0
        which = seen.piece[counted]
        self._usual += (len(seen.piece) - self._usual) * (NOVELTY if self._usual else 1.0)
        self._beside.learn(which, left[counted])

    def forget(self, seconds: float) -> None:
        """Let what was learned of the pieces fade by the time that passes."""
        self._beside.forget(seconds)

    def _sigma(self, seen: LineObservations) -> Array:
        """Expected error (M,) in px of where the pieces are seen, and of what is known of where they lie."""
        return np.sqrt(NOISE_PX**2 + self._beside.variance[seen.piece])

    def _spread(self, seen: LineObservations, pulls: Array) -> Array:
        """How the sum of pulls (M, 6) varies, (6, 6), those of a patch taken as one."""
        patches, patch = np.unique(self._patch[seen.piece], return_inverse=True)
        sums = np.zeros((len(patches), POSE_NUMBERS))
        np.add.at(sums, patch, pulls)
        return sums.T @ sums
