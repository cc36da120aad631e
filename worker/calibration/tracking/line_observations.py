"""Observation of a camera's pose by the painted lines of one frame, near where it is expected. No network.

Lens, paint and ground put each piece of line a little beside where the model has it, frame after frame by as much. That
is learned, piece by piece, while the clip runs: otherwise the pose would jump whenever a player hides some of them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.contrast import Channels, PixelReader
from worker.calibration.detection.line_matching import known_contrasts
from worker.calibration.detection.line_measurement import LineProfiles
from worker.calibration.geometry.arrays import Array, take_rows
from worker.calibration.geometry.camera import Camera, Frame
from worker.calibration.geometry.derivatives import POSE_NUMBERS, change_between, moved, pixel_jacobian
from worker.calibration.geometry.field import Field, LinePoints
from worker.calibration.geometry.visibility import VisibleLines
from worker.calibration.refinement.estimate import POSE_SIGMA
from worker.calibration.refinement.least_squares import CLUSTER_POINTS
from worker.calibration.robust import huber_weights, tukey_weights
from worker.calibration.tracking.learned_offsets import LearnedOffsets
from worker.calibration.tracking.motion_filter import PoseObservation

FEW, LEARNING = 200, 25
"""Number of pieces that are looked at after `LEARNING` looks at all of them."""
FEWEST_PIECES = 20
"""Fewest pieces of line for a frame to count."""
AT_REFERENCE_PX = 3.0
"""Half width of the search for markings near the reference, in pixels of a 4K frame."""
NOISE_PX = 0.1
"""Least error of the measurement of a piece, in pixels of the frame."""
PRIOR = np.diag(POSE_SIGMA**-2)


@dataclass(frozen=True)
class LineObservations:
    """Pieces of line in one frame, M of them.

    `expected`: the camera they were looked for with; `piece` (M,): which of them; `offset` (M,) px: of each from where
    that camera expects it, and `jacobian` (M, 6): Jacobian of that expectation by its pose; `share`: of those that were
    looked for.
    """

    expected: Camera
    piece: NDArray[np.intp]
    offset: Array
    jacobian: Array
    share: float

    def __getitem__(self, chosen: NDArray[np.bool_]) -> "LineObservations":
        return take_rows(self, chosen)


@dataclass(frozen=True)
class Sighting:
    """Pieces that were `seen`, and the observation of the pose by them.

    `misfit`: the median distance from where the observed pose has them, in expected errors: what no pose explains.
    """

    seen: LineObservations
    observed: PoseObservation
    misfit: float


@dataclass(frozen=True)
class _ReadPieces:
    """Pieces (M,), their lines and what a picture shows across them."""

    pieces: NDArray[np.intp]
    lines: LinePoints
    profiles: LineProfiles


class TrackedLines:
    """Lines by which one camera is followed; `reference`: the camera from which changes are counted.

    `first`: the frame that the reference was found in. Markings that it hardly shows are not looked for, and the
    channel in which each of the others stands out is looked up in it: later pictures are read in that one alone.
    """

    def __init__(self, pitch: Field, reference: Camera, first: Frame) -> None:
        self.reference = reference
        self._scale = reference.intrinsics.relative_size
        lines, channels = pitch.line_points(), Channels([first])
        # Approximate distance between pieces of line, in pixels of a 4K frame.
        expected = VisibleLines.from_camera(lines, reference).thinned(12.0 * self._scale).index
        visible = VisibleLines.from_camera(lines[expected], reference)
        self._contrasts = known_contrasts(visible, channels, AT_REFERENCE_PX * self._scale, self._scale)
        chosen = self._shown(lines, expected, channels)
        self._pieces = lines[chosen]
        self._all = np.arange(len(chosen))
        self._few: NDArray[np.intp] | None = None
        self._looks = 0
        self._patch = chosen // CLUSTER_POINTS
        self._usual = self._usual_misfit = 0.0
        # Standard deviation of a piece of line's lasting offset from its place, in pixels of a 4K frame.
        self._beside = LearnedOffsets(len(chosen), self._scale, NOISE_PX)

    def _shown(self, lines: LinePoints, expected: NDArray[np.intp], channels: Channels) -> NDArray[np.intp]:
        """Return the line points on markings of which the first frame shows enough."""
        reach_px = AT_REFERENCE_PX * self._scale
        profiles = LineProfiles.read_known(lines[expected], self.reference, channels, self._contrasts, reach_px)
        found = profiles.measure(self.reference, lines[expected], reach_px).index
        marking = lines.marking[expected]
        known, looked_for = (
            np.bincount(marking[found], minlength=len(lines)),
            np.bincount(marking, minlength=len(lines)),
        )
        return expected[(known >= 0.5 * looked_for)[marking]]

    def sighted(self, picture: PixelReader, expected: Camera) -> Sighting | None:
        """Measure lines near where the camera `expected` puts them; None where too few are found.

        For a camera that has been seen for a while a few telling pieces are looked at, all of them from time to time:
        those that were hidden come back.
        """
        return self._near(picture, expected, self._next_pieces())

    def searched(self, picture: PixelReader, expected: Camera) -> Sighting | None:
        """Measure lines in ever narrower searches, for a camera whose pose is hardly known; None as `sighted`."""
        pieces = self._next_pieces()
        for search in (28.0, 14.0):
            sighting = self._within(search, self._read(picture, expected, pieces[::3], search), expected)
            if sighting is None:
                return None
            expected = moved(self.reference, sighting.observed.change)
        return self._near(picture, expected, pieces)

    def fits(self, sighting: Sighting, anew: bool) -> bool:
        """True if the pieces lie about as near as usual to where the observed pose has them.

        With another lens than the reference's, or another marking taken for one, each pose leaves some of them off.
        `anew`: True if the camera was refused in the look before; then it has to be nearer.
        """
        # Limits of the median residual: in multiples of the usual one, the same for a camera that was refused in the
        # look before, and the least usual one in expected errors. Five times it is after a zoom by 0.5 %; twice in
        # noise of 25 grey levels, in JPEGs of quality 8 and out of focus by two pixels, all of a sudden; players and
        # shadows do not reach a median.
        most = 2.0 if anew else 3.0
        return sighting.misfit <= most * max(0.3, self._usual_misfit)

    def _next_pieces(self) -> NDArray[np.intp]:
        """Return the pieces for the next picture: all, or a few that were chosen once all had been learned."""
        self._looks += 1
        if self._looks <= LEARNING or self._looks % 50 == 0:
            self._few = None
            return self._all
        if self._few is None:
            self._few = self._telling()
        return self._few

    def _near(self, picture: PixelReader, expected: Camera, pieces: NDArray[np.intp]) -> Sighting | None:
        """Look for pieces once, and once more from where the camera is found if they are not nearby.

        What is measured far from where it was expected is a little off.
        """
        # Half widths of the search, in pixels of a 4K frame: at first, and again from where the camera is then found.
        search_px = 8.0
        read = self._read(picture, expected, pieces, search_px)
        sighting = self._within(search_px, read, expected)
        if sighting is None:
            return None
        if np.median(np.abs(sighting.seen.offset)) < 2.0 * self._scale:
            return sighting
        found = moved(self.reference, sighting.observed.change)
        near_px = 3.0
        if not read.profiles.cover(found, read.lines, near_px * self._scale):
            read = self._read(picture, found, pieces, near_px)
        return self._within(near_px, read, found)

    def _read(self, picture: PixelReader, expected: Camera, pieces: NDArray[np.intp], reach_px: float) -> _ReadPieces:
        lines = self._pieces[pieces]
        profiles = LineProfiles.read_known(lines, expected, picture, self._contrasts, reach_px * self._scale)
        return _ReadPieces(pieces, lines, profiles)

    def _within(self, search_px: float, read: _ReadPieces, expected: Camera) -> Sighting | None:
        if not read.profiles.any:
            return None
        found = read.profiles.measure(expected, read.lines, search_px * self._scale)
        points = found.points.position
        # The measured offset falls as the expected place moves.
        offset, jacobian = found.offset(expected, points), -found.jacobian(expected, points)
        good = np.isfinite(offset) & np.isfinite(jacobian).all(axis=1)
        share = good.sum() / len(read.pieces)
        if good.sum() < FEWEST_PIECES or share < 0.3 * self._usual:
            return None
        seen = LineObservations(expected, read.pieces[found.index[good]], offset[good], jacobian[good], share)
        return self.explained(seen)

    def _telling(self) -> NDArray[np.intp]:
        """Return the few pieces that are looked at: of those that are seen at least half as often as others."""
        often = np.flatnonzero(self._beside.are_seen_as_often(0.5))
        seen = VisibleLines.from_camera(self._pieces[often], self.reference)
        jacobian = np.einsum("mij,mi->mj", pixel_jacobian(self.reference, seen.points.position), seen.normal) / NOISE_PX
        usable = np.flatnonzero(np.isfinite(jacobian).all(axis=1))
        pieces = often[seen.index[usable]]
        return pieces[most_telling(jacobian[usable], self._patch[pieces], PRIOR, FEW)]

    def explained(self, every: LineObservations) -> Sighting:
        """Return the observation of the pose by pieces: robust least squares, with the errors that a patch shares."""
        seen = self._known(every)
        sigma = self._sigma(seen)
        rows, values = seen.jacobian / sigma[:, None], (seen.offset - self._beside.mean[seen.piece]) / sigma
        change = np.zeros(POSE_NUMBERS)
        for weigh in (*3 * [huber_weights], *3 * [tukey_weights]):
            weight = weigh(values - rows @ change)
            information = (rows * weight[:, None]).T @ rows
            change = np.asarray(np.linalg.solve(information + PRIOR, rows.T @ (weight * values)), float)
        residual = values - rows @ change
        spread = self._spread(seen, rows * (weight * residual)[:, None])
        together = float(np.trace(np.linalg.solve(information + PRIOR, spread))) / POSE_NUMBERS
        known = information / max(1.0, together)
        # Error that all pieces of a frame have in common: what a codec and the grid of pixels do to every line alike.
        of_picture = np.diag(np.repeat([0.04 / seen.expected.intrinsics.focal_length_px, 0.0], 3) ** 2)
        observed = PoseObservation(
            change_between(self.reference, moved(seen.expected, change)),
            np.asarray(np.linalg.solve(np.eye(POSE_NUMBERS) + known @ of_picture, known), float),
        )
        return Sighting(every, observed, float(np.median(np.abs(residual))))

    def _known(self, seen: LineObservations) -> LineObservations:
        """Return the pieces that have been seen before, or all where those are too few.

        A whole line that a wrong lens puts at the end of what is looked at comes into it when the pose stirs, and would
        pull the pose by as much as it lies beside its place.
        """
        known = self._beside.are_known[seen.piece]
        return seen[known] if known.sum() >= FEWEST_PIECES else seen

    def learn(self, sighting: Sighting, now: Camera) -> None:
        """Keep the offsets of the pieces from their places when the camera is where it is `now` known to be."""
        seen = sighting.seen
        residual = seen.offset - seen.jacobian @ change_between(seen.expected, now)
        counted = tukey_weights((residual - self._beside.mean[seen.piece]) / self._sigma(seen)) > 0
        which = seen.piece[counted]
        # Weight of a new frame in the usual share of pieces found, and in the usual misfit.
        novelty = 0.05 if self._usual else 1.0
        self._usual += (seen.share - self._usual) * novelty
        self._usual_misfit += (sighting.misfit - self._usual_misfit) * novelty
        self._beside.learn(which, residual[counted])

    def forget(self, seconds: float) -> None:
        """Let what was learned of the pieces fade by the time that passes."""
        self._beside.forget(seconds)

    def _sigma(self, seen: LineObservations) -> Array:
        """Return the standard deviation (M,) in px of the pieces' measurements and of their learned places."""
        return np.sqrt(NOISE_PX**2 + self._beside.variance[seen.piece])

    def _spread(self, seen: LineObservations, gradients: Array) -> Array:
        """Return the covariance (6, 6) of the sum of gradients (M, 6), those of a patch taken as one."""
        patches, patch = np.unique(self._patch[seen.piece], return_inverse=True)
        sums = np.zeros((len(patches), POSE_NUMBERS))
        np.add.at(sums, patch, gradients)
        return sums.T @ sums


def most_telling(jacobian: Array, patch: NDArray[np.intp], prior: Array, count: int) -> NDArray[np.intp]:
    """Return indices, rising, of up to `count` of N pieces that leave least open of a pose (D-optimal, greedily).

    `jacobian` (N, 6): how far each moves, in its own standard deviation, per unit of the pose; `patch` (N,): pieces of
    one err together, so each further one of a patch counts for less; `prior` (6, 6): information without any piece.
    """
    covariance = np.asarray(np.linalg.inv(prior), float)
    share = np.ones(len(jacobian))
    chosen: list[int] = []
    for _ in range(min(count, len(jacobian))):
        reach = jacobian @ covariance
        gain = share**2 * np.einsum("nj,nj->n", reach, jacobian)
        gain[chosen] = -np.inf
        best = int(np.argmax(gain))
        covariance -= np.outer(reach[best], reach[best]) * share[best] ** 2 / (1 + gain[best])
        chosen.append(best)
        alike = np.flatnonzero(patch == patch[best])
        share[alike] = 1 / (1 + np.count_nonzero(np.isin(chosen, alike)))
    return np.sort(np.array(chosen, dtype=np.intp))
