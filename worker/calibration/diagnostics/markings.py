"""Report on each marking: the share of it that is found, and the offset of its paint from where the venue has it.

The pose follows all lines, so one that is elsewhere pulls it along and looks nearer than it is. How far the pose gives
way is known, and put back. Sigma has what makes the pieces of a line differ, how far the ground under all of it may
swell, and what the lens may have wrong; what moves all of a line by more is its offset: paint, a measure of the venue,
its crown.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.contrast import Channels
from worker.calibration.detection.line_measurement import Measurements, measure_lines
from worker.calibration.geometry.arrays import take_rows
from worker.calibration.geometry.camera import Array, Camera
from worker.calibration.geometry.derivatives import POSE_NUMBERS
from worker.calibration.geometry.field import Field, LinePoints
from worker.calibration.geometry.ground import Ground
from worker.calibration.geometry.lens import LENS_PARAMETERS
from worker.calibration.geometry.parameters import lens_parameters
from worker.calibration.refinement.estimate import POSE_SIGMA
from worker.calibration.refinement.least_squares import CLUSTER_POINTS, LEAST_NOISE
from worker.calibration.refinement.uncertainty import RefinedPose
from worker.calibration.robust import SURE, tukey_weights

Direction = Literal["outside", "inside", "right", "left", "far", "near"]
OPPOSITE: dict[Direction, Direction] = {"outside": "inside", "right": "left", "far": "near"}
FEWEST_MEASURED = 6
"""Fewest points of a marking, 25 cm apart, for an offset."""
MEASURED = ("index", "pixel", "normal", "px_per_metre", "px_per_metre_up", "length_px", "trust")
LEAST_OFF_M = 0.03
"""Offset from which a marking is elsewhere, if it is sure as well."""
USUAL_COUNTS = 1.0
"""Weight, in patches of line, of how patches usually differ beside those of the marking itself."""


@dataclass(frozen=True)
class MarkingReport:
    """Report on a marking as one camera sees it: `expected_m` in view, and the share 0..1 of that `found`.

    `offset_m` ± `sigma_m`: distance of its paint from where the venue has it, across it on the ground, on the side that
    `direction` names if positive and on the opposite one if negative. None where that cannot be told.
    """

    name: str
    expected_m: float
    found: float
    offset_m: float | None = None
    sigma_m: float | None = None
    direction: Direction | None = None

    @property
    def is_elsewhere(self) -> bool:
        """True if the paint surely is not where the venue has it."""
        if self.offset_m is None or self.sigma_m is None:
            return False
        return abs(self.offset_m) > max(LEAST_OFF_M, SURE * self.sigma_m)

    @property
    def side(self) -> Direction | None:
        """Side of its place on which the paint is."""
        if self.direction is None or self.offset_m is None or self.offset_m >= 0:
            return self.direction
        return OPPOSITE[self.direction]


def report_markings(
    pitch: Field, found: RefinedPose, channels: Channels, response: NDArray[np.float32]
) -> list[MarkingReport]:
    """Report on each marking of the `pitch` that a camera should see; dashes and rows are one marking.

    `channels` of its frame and `response` (H, W), where markings that are not in their places are looked for.
    """
    lines = pitch.measured_points
    names = pitch.whole_names()
    whole = {name: number for number, name in enumerate(dict.fromkeys(names))}
    group = np.array([whole[name] for name in names])
    offsets = {}
    # Least agreement of a pose for offsets: below it, what lies beside its lines is not their paint.
    if found.evidence.agreement >= 0.6:
        offsets = _offsets(lines, group, found, _farther_away(lines, group, found, channels, response))
    pieces = group[found.evidence.marking]
    reports = []
    for name, number in whole.items():
        its = pieces == number
        if not its.any():
            continue
        expected_m, share = float(its.sum() * lines.spacing), float(found.evidence.found[its].mean())
        if number not in offsets:
            reports.append(MarkingReport(name, expected_m, share))
            continue
        offset, sigma = offsets[number]
        direction, sign = direction_of(lines, np.flatnonzero((group[lines.marking] == number) & ~lines.end_to_end))
        reports.append(MarkingReport(name, expected_m, share, sign * offset, sigma, direction))
    return reports


def _farther_away(
    lines: LinePoints,
    group: NDArray[np.intp],
    found: RefinedPose,
    channels: Channels,
    response: NDArray[np.float32],
) -> Measurements | None:
    """Return the measurements of a camera, taken farther away for markings that are hardly found."""
    measured, evidence, camera = found.measured, found.evidence, found.camera
    if measured is None:
        return None
    pieces = group[evidence.marking]
    # A marking of which less is found is looked for farther away.
    lost = [n for n in np.unique(pieces) if evidence.found[pieces == n].mean() < 0.5]
    its = np.flatnonzero(np.isin(group[lines.marking], lost) & ~lines.end_to_end)
    if len(its) == 0:
        return measured
    farther = measure_lines(lines[its], camera, channels, response, 30.0 * camera.intrinsics.relative_size)
    farther = replace(farther, index=its[farther.index], misfit_px=measured.misfit_px)
    of_group = group[farther.points.marking]
    # Something that is seen here and there beside a marking is not it.
    whole = [n for n in lost if np.sum(of_group == n) >= 0.5 * np.sum(pieces == n)]
    elsewhere = ~np.isin(group[measured.points.marking], whole)
    return _together(lines, measured[elsewhere], farther[np.isin(of_group, whole)])


def _together(lines: LinePoints, one: Measurements, other: Measurements) -> Measurements:
    both = {name: np.concatenate([getattr(one, name), getattr(other, name)]) for name in MEASURED}
    return Measurements(points=lines[both["index"]], misfit_px=one.misfit_px, **both)


def _offsets(
    lines: LinePoints, group: NDArray[np.intp], found: RefinedPose, seen: Measurements | None
) -> dict[int, tuple[float, float]]:
    """Return offset and sigma in metres, along their normals, of the groups of markings for which they can be told.

    Markings that are elsewhere beyond doubt are let go one after the other, the surest first: what they did to the pose
    says nothing of the others. Where most of the rest is still further off than its sigmas say, no line can be better
    known (the ratio of Birge, 1932, by the median).
    """
    measured = None if seen is None else _Offsets.of(lines, group, found, seen)
    if measured is None:
        return {}
    means = measured.means()
    free: list[int] = []
    while True:
        offsets = _joint_offsets(means, free)
        off = {n: abs(offset) / sigma for n, (offset, sigma) in offsets.items() if n not in free}
        sure = {n: sigmas for n, sigmas in off.items() if sigmas > SURE and abs(offsets[n][0]) > LEAST_OFF_M}
        if not sure or len(free) >= len(offsets) / 3:
            break
        free.append(max(sure, key=lambda n: sure[n]))
    # The median absolute value of normal errors is 0.6745 sigma.
    worse = max(1.0, float(np.median(list(off.values()))) / 0.6745) if off else 1.0
    return {number: (offset, worse * sigma) for number, (offset, sigma) in offsets.items()}


def _joint_offsets(means: "_Means", free: Sequence[int]) -> dict[int, tuple[float, float]]:
    """Return offset and sigma of each group if it and the `free` ones may be elsewhere, and all others are in place."""
    offsets = {}
    for row, number in enumerate(means.group):
        rows = [row, *(means.group.index(other) for other in free if other != number)]
        remaining = np.eye(len(rows)) - means.carried[np.ix_(rows, rows)]
        # Least part of an offset that is left when the pose has given way to it: a line that the pose hangs on has
        # none.
        if np.linalg.svd(remaining, compute_uv=False)[-1] < 0.1:
            continue
        back = np.linalg.inv(remaining)[0]
        offset = float(back @ means.mean[rows])
        of_means = float(np.sqrt(back**2 @ means.variance[rows]))
        # Lens and ground give way as well, by how much is known roughly.
        offsets[number] = offset, float(np.hypot(of_means, 0.3 * (offset - means.mean[row])))
    return offsets


def direction_of(lines: LinePoints, its: NDArray[np.intp]) -> tuple[Direction, float]:
    """Return the name of the positive side of a marking (its line points), and the sign its normals have there.

    Lines that bound the field and those that bend have an outside; else it is right (x) or far (y).
    """
    normal, place = lines.normal[its, :2], lines.position[its, :2]
    mean = normal.mean(axis=0)
    # A straight marking has normals of one direction.
    if np.linalg.norm(mean) < 0.97:
        return "outside", float(np.sign(np.sum(normal * (place - place.mean(axis=0))))) or 1.0
    axis = int(np.argmax(np.abs(mean)))
    sign, at = float(np.sign(mean[axis])), float(place[:, axis].mean())
    # Distance from the outermost line of its direction up to which a line bounds the field.
    if abs(at) > np.abs(lines.position[:, axis]).max() - 0.3:
        return "outside", sign * float(np.sign(at))
    return ("right" if axis == 0 else "far"), sign


@dataclass(frozen=True)
class _Means:
    """Mean offsets of G groups of markings: `mean` (G,) m along their normals with its `variance` (G,).

    `carried` (G, G): how far the pose carries each along when another is one metre elsewhere.
    """

    group: list[int]
    mean: Array
    variance: Array
    carried: Array


@dataclass(frozen=True)
class _Offsets:
    """Measured points M of one camera: `group` of markings and `patch` of line of each.

    `offset` (M,) px along their normals, `scale` (M,) px per metre, `sigma` (M,) px; `jacobian` (M, 6) of the offset by
    the pose, and what the pose `gives` (M, 6): how it moves for an offset of one sigma there; `alike` (M, C): how far
    they seem to move across their lines, m, by one standard deviation of what moves many of them: parts of the ground
    and parameters of the lens.
    """

    group: NDArray[np.intp]
    patch: NDArray[np.intp]
    offset: Array
    scale: Array
    sigma: Array
    jacobian: Array
    gives: Array
    alike: Array

    @classmethod
    def of(
        cls, lines: LinePoints, group: NDArray[np.intp], found: RefinedPose, measured: Measurements
    ) -> "_Offsets | None":
        """Return the offsets of measurements, None where too few can be used."""
        camera = found.camera
        here = lines.position[measured.index]
        offset, jacobian = measured.offset(camera, here), -measured.jacobian(camera, here)
        known = np.isfinite(offset) & np.isfinite(jacobian).all(axis=1)
        if known.sum() < FEWEST_MEASURED:
            return None
        measured, offset, jacobian = measured[known], offset[known], jacobian[known]
        sigma = measured.sigma_px
        ground = Ground.under(lines)
        rises = _rises(ground, measured)
        # The pose has not followed markings that were painted anew.
        followed = ~np.isin(lines.marking[measured.index], found.repainted_markings)
        gives = _given_way(ground, rises, measured, jacobian, followed * tukey_weights(offset / sigma), found.uneven_m)
        swell = found.uneven_m * np.linalg.cholesky(np.linalg.inv(ground.precision))
        by_lens = _by_lens(camera, here[known], measured)
        # The pose follows what a lens has wrong: what of it is left moves lines.
        by_lens = by_lens - jacobian @ (gives @ (by_lens / sigma[:, None]))
        alike = np.concatenate([rises @ swell, by_lens], axis=1) / measured.px_per_metre[:, None]
        of_group = group[lines.marking[measured.index]]
        patch = np.unique(np.stack([of_group, measured.index // CLUSTER_POINTS]), axis=1, return_inverse=True)[1]
        every = cls(of_group, patch.ravel(), offset, measured.px_per_metre, sigma, jacobian, gives.T, alike)
        # The pose follows the ends of marks as well, but a marking is elsewhere across itself.
        return take_rows(every, ~measured.points.end_to_end)

    def means(self) -> _Means:
        """Return the mean offset of each group by its measurements."""
        numbers = [n for n in np.unique(self.group).tolist() if np.sum(self.group == n) >= FEWEST_MEASURED]
        usual, mean, variance, says = self._usual(), [], [], []
        for number in numbers:
            its = self.group == number
            middle, weight = self._mean(its)
            total = float(weight.sum())
            by_patch = _by_patch(self.patch[its], weight * (self.offset[its] / self.scale[its] - middle))
            further = len(by_patch) - 1
            own = float(np.sum(by_patch**2)) * (further + 1)
            spread = (own + USUAL_COUNTS * usual * total) / (further + USUAL_COUNTS)
            spread += LEAST_NOISE * float(np.sum(weight**2 * (self.sigma[its] / self.scale[its]) ** 2))
            alike = weight @ self.alike[its] / total
            mean.append(middle)
            variance.append(spread / total**2 + float(alike @ alike))
            says.append((weight / self.scale[its]) @ self.jacobian[its] / total)
        moves = [(self.scale / self.sigma)[self.group == n] @ self.gives[self.group == n] for n in numbers]
        carried = np.array(says).reshape(-1, POSE_NUMBERS) @ np.array(moves).reshape(-1, POSE_NUMBERS).T
        return _Means(numbers, np.array(mean), np.array(variance), carried)

    def _mean(self, its: NDArray[np.bool_]) -> tuple[float, Array]:
        """Return the robust mean of the points of a marking, m, and the weight of each of them."""
        metres, sigma_m = self.offset[its] / self.scale[its], self.sigma[its] / self.scale[its]
        mean = float(np.median(metres))
        weight = np.ones(len(metres))
        for _ in range(3):
            weight = tukey_weights((metres - mean) / sigma_m) / sigma_m**2
            mean = float(np.sum(weight * metres) / max(float(weight.sum()), 1e-12))
        return mean, weight

    def _usual(self) -> float:
        """Return how much more than single points the patches of a marking differ, over all markings of the camera."""
        squares, informed, spare = 0.0, 0, 0
        for number in np.unique(self.group):
            its = self.group == number
            mean, weight = self._mean(its)
            by_patch = _by_patch(self.patch[its], weight * (self.offset[its] / self.scale[its] - mean))
            weights = _by_patch(self.patch[its], weight)
            counted = weights > 0
            squares += float(np.sum(by_patch[counted] ** 2 / weights[counted]))
            informed += int(counted.sum())
            spare += 1
        together = float(np.bincount(self.patch).max())
        return max(squares / (informed - spare), 1.0) if informed > spare else together


def _rises(ground: Ground, measured: Measurements) -> Array:
    """Jacobian (M, K) of measured points along their normals, px, by the heights (m) of the ground's nodes."""
    heights = np.zeros((len(measured), len(ground)))
    row = np.arange(len(measured))[:, None]
    np.add.at(heights, (row, ground.node[measured.index]), ground.share[measured.index])
    return np.asarray(measured.px_per_metre_up[:, None] * heights)


def _by_lens(camera: Camera, points: Array, measured: Measurements) -> Array:
    """Return the moves (M, P), px along their normals, of points (M, 3) by one sigma of each lens parameter."""
    known = lens_parameters([camera])
    jacobian = measured.lens_jacobian(camera, points)[:, [LENS_PARAMETERS.index(one.name) for one in known]]
    return np.nan_to_num(-jacobian * [one.expected for one in known])


def _given_way(
    ground: Ground, rises: Array, measured: Measurements, jacobian: Array, weight: Array, uneven_m: float
) -> Array:
    """Return the moves of the pose (6, M) for an offset of one sigma at each point, where the ground yields too.

    `jacobian` (M, 6) of the offsets by the pose; `weight` (M,) that the refinement gave them.
    """
    by_sigma = np.concatenate([jacobian, rises], axis=1) / measured.sigma_px[:, None]
    weighted = by_sigma * weight[:, None]
    information = weighted.T @ by_sigma
    information[:POSE_NUMBERS, :POSE_NUMBERS] += np.diag(POSE_SIGMA**-2)
    information[POSE_NUMBERS:, POSE_NUMBERS:] += ground.precision / uneven_m**2
    return np.asarray(np.linalg.solve(information, weighted.T)[:POSE_NUMBERS])


def _by_patch(patch: NDArray[np.intp], values: Array) -> Array:
    """Return sums of values (M,) by patch."""
    return np.asarray(np.bincount(np.unique(patch, return_inverse=True)[1], values), dtype=float)


def in_words(seen: MarkingReport) -> str:
    """Return `far touchline: 62 % found, 10 +- 1 cm outside`, in the letters that OpenCV can draw."""
    words = f"{seen.name}: {seen.found:.0%} found"
    if seen.offset_m is None or seen.sigma_m is None:
        return words
    places = 0 if seen.sigma_m >= 0.01 else 1
    offset, sigma = 100 * abs(seen.offset_m), 100 * seen.sigma_m
    return f"{words}, {offset:.{places}f} +- {sigma:.{places}f} cm {seen.side}"
