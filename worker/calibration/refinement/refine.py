"""Refinement: all cameras at once onto the measured lines, by a robust Gauss-Newton, with uncertainties.

Found with the poses: how the ground swells, and whatever number of lens or field is left free.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.contrast import Channels
from worker.calibration.detection.evidence import Evidence, evidence_of
from worker.calibration.detection.exclusions import left_out
from worker.calibration.detection.line_measurement import LineProfiles, Measurements
from worker.calibration.geometry.camera import Camera
from worker.calibration.geometry.field import Field, LinePoints
from worker.calibration.geometry.ground import Ground
from worker.calibration.geometry.parameters import Parameter, field_measures
from worker.calibration.geometry.visibility import VisibleLines
from worker.calibration.memory.camera_memory import CameraMemory, memories_of_field
from worker.calibration.memory.repainted_markings import find_repainted_markings
from worker.calibration.refinement.anderson_mixing import MixedSteps
from worker.calibration.refinement.diagnosis import is_sure
from worker.calibration.refinement.estimate import Estimate, GaussNewtonStep, gauss_newton_step
from worker.calibration.refinement.least_squares import misfit_px, rms_px
from worker.calibration.refinement.uncertainty import Deviation, RefinedPoses, estimate_uncertainty, rms_of_all
from worker.calibration.refinement.unknowns import Unknowns
from worker.calibration.robust import huber_weights, tukey_weights

SEARCH_PX = (14.0, 8.0, 5.0)
"""Half width of the search for lines round by round, in pixels of a 4K frame."""
EVALUATION_SEARCH_PX = 8.0
CLEARLY_MORE = 0.02
"""Growth of the share of lines that are found, by which one pose is better than another: more than the noise of a share
from one reading of a frame to the next."""
MOST_STEPS = 4
"""Most steps of a coarse round."""
NOT_LOOKED_AT: NDArray[np.float32] = np.zeros((1, 1), dtype=np.float32)
"""Response to a frame that the network was not run on: a marking nowhere."""


@dataclass(frozen=True)
class Observations:
    """Observations of the cameras: the `channels` of each frame and its `responses` (H, W), the segmentation 0..1."""

    channels: Sequence[Channels]
    responses: Sequence[NDArray[np.float32]]

    @classmethod
    def of_lines_alone(cls, channels: Sequence[Channels]) -> "Observations":
        """Return the observations of frames that the network has not looked at."""
        return cls(channels, [NOT_LOOKED_AT] * len(channels))

    def of(self, numbers: Sequence[int]) -> "Observations":
        """Return the observations of some of the cameras."""
        return Observations([self.channels[n] for n in numbers], [self.responses[n] for n in numbers])

    def reader(self) -> "LineReader":
        """Return a reader of the lines in them."""
        return LineReader(self)


class LineReader:
    """Reader of the lines of several cameras around any poses; it reads a frame again only where it has to."""

    def __init__(self, observations: Observations, read: Mapping[int, LineProfiles] = MappingProxyType({})) -> None:
        self._observations = observations
        self._read = dict(read)

    def of(self, numbers: Sequence[int]) -> "LineReader":
        """Return a reader for some of the cameras, with what has been read of them."""
        read = {at: self._read[n] for at, n in enumerate(numbers) if n in self._read}
        return LineReader(self._observations.of(numbers), read)

    def measure(self, lines: LinePoints, cameras: Sequence[Camera], search_px: float) -> list[Measurements]:
        """Measure the lines of each camera within `search_px` (of a 4K frame) of where its pose expects them."""
        measured = []
        for number, camera in enumerate(cameras):
            search = search_px * camera.intrinsics.relative_size
            profiles = self._read.get(number)
            if profiles is None or not profiles.cover(camera, lines, search):
                channels, response = self._observations.channels[number], self._observations.responses[number]
                # Length by which a reading of a frame reaches beyond the search, so that it is good for more than one
                # pose, and that of the last round for the evaluation of where it led.
                profiles = LineProfiles.read(lines, camera, channels, response, search + 4.0)
                self._read[number] = profiles
            measured.append(profiles.measure(camera, lines, search))
        return measured

    def evidence(self, pitch: Field, lines: LinePoints, cameras: Sequence[Camera]) -> list[Evidence]:
        """Return the evidence for the lines where the cameras put them."""
        return [
            evidence_of(lines, camera, channels, response, left_out(pitch, camera))
            for camera, channels, response in zip(
                cameras, self._observations.channels, self._observations.responses, strict=True
            )
        ]

    def read_anew(self) -> None:
        """Read every frame again when it is measured next."""
        self._read.clear()


def refine(
    pitch: Field,
    cameras: Sequence[Camera],
    observations: Observations,
    stitch_weight: float,
    free: Sequence[Parameter] = (),
    searches_px: Sequence[float] = SEARCH_PX,
    stored: Sequence[Camera] | None = None,
    memories: Sequence[CameraMemory | None] | None = None,
    reader: LineReader | None = None,
) -> RefinedPoses:
    """Measure the lines and move the cameras onto them, round by round with a narrower search.

    `stored`: where the cameras stood when that was last known, if not where they begin. `free`: numbers of lenses and
    field to be found along with the poses; pitch and cameras come back with them. `memories`: of the earlier nights of
    each camera. `reader`: of the `observations`, if they have been measured before. `stitch_weight` 0: each camera on
    a ground of its own; any other has no effect, since what cameras know of each other is weighed by its errors alone.
    """
    if stitch_weight == 0 and len(cameras) > 1 and not free:
        return _each_alone(pitch, cameras, observations, stored or cameras, memories)
    unknowns = Unknowns(len(cameras), free, Ground.under(pitch.measured_points))
    begun = Estimate.initial(pitch, cameras, unknowns)
    remembered = memories_of_field(memories or [None] * len(cameras), begun.lines)
    refiner = _Refiner(reader or observations.reader(), unknowns, _repainted_in_memory(remembered), cameras)
    caught = refiner.catch(begun, searches_px)
    repainted = _find_repainted(caught, remembered, refiner)
    if len(repainted) != len(refiner.repainted):
        # They have pulled the cameras away from all other markings.
        refiner = replace(refiner, repainted=repainted)
        caught = refiner.catch(begun, searches_px)
    last = refiner.settle(caught)
    uneven = last.unevenness(unknowns, unknowns.ground.ordinary)
    estimate = replace(last.to, uneven_m=uneven)
    # Judged by a wider search than the last round's, which could not see an error larger than itself.
    return _with_pose_shift_if_corrected(_assessed(estimate, stored or cameras, remembered, refiner), estimate, refiner)


def refine_coarsely(
    pitch: Field,
    cameras: Sequence[Camera],
    observations: Observations,
    free: Sequence[Parameter] = (),
    searches_px: Sequence[float] = SEARCH_PX,
) -> RefinedPoses:
    """Move the cameras onto the lines as each frame is read on the way there, once; arguments as for `refine`.

    Good to compare hypotheses. Where they end depends a little on where they begin, by less than their sigma.
    """
    refiner, caught = _catch(pitch, cameras, observations, free, searches_px)
    last = replace(refiner.around(caught), found=caught.cameras).follow(caught)
    uneven = last.unevenness(refiner.unknowns, refiner.unknowns.ground.ordinary)
    return _assessed(replace(last.to, uneven_m=uneven), cameras, [None] * len(cameras), refiner)


def catch_lines(
    pitch: Field,
    cameras: Sequence[Camera],
    observations: Observations,
    free: Sequence[Parameter],
    searches_px: Sequence[float],
) -> tuple[list[Camera], float]:
    """Return the cameras, moved to where they catch the lines, and the rms distance (px) of what they have caught.

    Good to begin a refinement; arguments as for `refine`.
    """
    refiner, caught = _catch(pitch, cameras, observations, free, searches_px)
    measured = refiner.measure(caught, SEARCH_PX[-1])
    residuals = [
        rms_px(caught.lines.position, camera, found) for camera, found in zip(caught.cameras, measured, strict=True)
    ]
    return caught.cameras, rms_of_all(residuals)


def _catch(
    pitch: Field,
    cameras: Sequence[Camera],
    observations: Observations,
    free: Sequence[Parameter],
    searches_px: Sequence[float],
) -> "tuple[_Refiner, Estimate]":
    """Return a refiner, and the estimate after its rounds that catch the lines."""
    unknowns = Unknowns(len(cameras), free, Ground.under(pitch.measured_points))
    refiner = _Refiner(observations.reader(), unknowns, np.empty(0, np.intp), cameras)
    return refiner, refiner.catch(Estimate.initial(pitch, cameras, unknowns), searches_px)


@dataclass(frozen=True)
class _Refiner:
    """Gauss-Newton refinement of cameras `found` near the lines that a `reader` measures.

    `repainted`: the numbers of the markings that are painted elsewhere and say nothing of any pose.
    """

    reader: LineReader
    unknowns: Unknowns
    repainted: NDArray[np.intp]
    found: Sequence[Camera]

    def measure(self, estimate: Estimate, search_px: float) -> list[Measurements]:
        """Measure the lines within `search_px` (of a 4K frame) of where the cameras expect them, on their ground."""
        return self.without_repainted(
            self.reader.measure(estimate.on_ground(self.unknowns), estimate.cameras, search_px)
        )

    def without_repainted(self, measured: Sequence[Measurements]) -> list[Measurements]:
        """Return the measurements without those of repainted markings."""
        if len(self.repainted) == 0:
            return list(measured)
        return [found[~np.isin(found.points.marking, self.repainted)] for found in measured]

    def around(self, estimate: Estimate) -> "_Refiner":
        """Return the refinement for the field of an estimate, which steps may have changed."""
        return replace(self, unknowns=self.unknowns.around(estimate.pitch))

    def catch(self, estimate: Estimate, searches_px: Sequence[float]) -> Estimate:
        """Return the estimate after rounds with a narrower and narrower search, which catch the lines."""
        for search in searches_px:
            this = self.around(estimate)
            measured = this.measure(estimate, search)
            # Huber's loss has one minimum, wherever one begins; Tukey's, which outliers do not move, has several. One
            # step towards the nearest of those drops the outliers and still ends in one place (Bickel, 1975).
            estimate = this.down_huber(estimate, measured)
            estimate = this.towards_tukey(estimate, measured).to
        return estimate

    def share_found(self, estimate: Estimate) -> float:
        """Return the share 0..1 of its lines that is found where the camera with the largest share expects them."""
        lines = estimate.on_ground(self.unknowns)
        measured = self.reader.measure(lines, estimate.cameras, SEARCH_PX[-1])
        share = max(measured_shares(lines, estimate.cameras, measured))
        # What is not measured may yet be seen, which takes longer to tell.
        return share if share > 0.5 else max(one.agreement for one in self.evidence(estimate, lines))

    def evidence(self, estimate: Estimate, lines: LinePoints) -> list[Evidence]:
        """Return the evidence for the `lines` of the field, on its ground, where the cameras put them."""
        return self.reader.evidence(estimate.pitch, lines[~lines.end_to_end], estimate.cameras)

    def settle(self, estimate: Estimate) -> GaussNewtonStep:
        """Return the step that leads to where the cameras stand still.

        What is read of a frame depends a little on where its pixels lie beside the lines. So the frames are read anew
        at the poses that the last reading led to, until that moves nothing: the end does not depend on the beginning.
        Poses that miss more lines than they find are no answer, and are left where a reading leads to no more lines.
        """
        moves, share = list[float](), self.share_found(estimate)
        self.reader.read_anew()
        for _ in range(6):
            last = replace(self.around(estimate), found=estimate.cameras).follow(estimate)
            moves.append(last.to.largest_move_m(estimate))
            estimate = last.to
            nearer = moves[-1] / moves[-2] if len(moves) > 1 else 1.0
            # Each reading moves the cameras by about the same part of what the one before did, and by no less than a
            # fifth of it: they have arrived where the next one would move them less than 0.1 mm.
            if moves[-1] * max(nearer, 0.2) < 1e-4:
                break
            if share <= 0.5:
                before, share = share, self.share_found(estimate)
                if share < before + CLEARLY_MORE:
                    break
            self.reader.read_anew()
        return last

    def follow(self, estimate: Estimate) -> GaussNewtonStep:
        """Return the last of the steps to the lines as the frames have been read."""
        mixed, lengths = MixedSteps(self.unknowns), list[float]()
        patience = 3
        for _ in range(12):
            # Half width of the search in the last rounds, which go on until the cameras stand still. Wide enough that
            # it is the robust weights which leave out a line point, and not the end of the search, which moves with the
            # cameras.
            last = self.towards_tukey(estimate, self.measure(estimate, 5.0))
            lengths.append(last.to.largest_move_m(estimate))
            # They end when cameras move less than this, or than such a part of the first step on the same reading, or
            # when so many steps were no shorter than one before: a line point that fits two shifts alike may go to and
            # fro.
            if lengths[-1] < max(5e-5, 0.1 * lengths[0]) or min(lengths[-patience:]) > min(
                lengths[:-patience], default=np.inf
            ):
                break
            estimate = mixed.step(estimate, last)
        return last

    def down_huber(self, estimate: Estimate, measured: Sequence[Measurements]) -> Estimate:
        """Minimise Huber's loss of the same measurements."""
        for _ in range(MOST_STEPS):
            before = estimate
            estimate = gauss_newton_step(
                estimate, self.found, with_misfit_noise(estimate, measured), self.unknowns, huber_weights
            ).to
            if estimate.largest_move_m(before) < 2e-4:
                break
        return estimate

    def towards_tukey(self, estimate: Estimate, measured: Sequence[Measurements]) -> GaussNewtonStep:
        """Take one step towards the minimum of Tukey's loss, and estimate the ground's unevenness there."""
        measured = with_misfit_noise(estimate, measured)
        made = gauss_newton_step(estimate, self.found, measured, self.unknowns, tukey_weights)
        uneven = made.unevenness(self.unknowns, self.unknowns.ground.even)
        # A lens or a field that is wrong bends lines as a swelling ground does: the more of it, the flatter the ground.
        uneven /= 1 + (max(found.misfit_px for found in measured) / 0.3) ** 2
        return replace(made, to=replace(made.to, uneven_m=min(uneven, self.unknowns.ground.most_m)))


def measured_shares(lines: LinePoints, cameras: Sequence[Camera], measured: Sequence[Measurements]) -> list[float]:
    """Return the share 0..1 of the length of line that each camera expects, and was measured.

    Lines below a pixel count by their width.
    """
    shares = []
    for camera, found in zip(cameras, measured, strict=True):
        expected = VisibleLines.from_camera(lines, camera)
        weight = expected.length_px * np.minimum(expected.width_px, 1.0)
        shares.append(float(np.sum(weight[np.isin(expected.index, found.index)]) / max(np.sum(weight), 1e-12)))
    return shares


def _repainted_in_memory(remembered: Sequence[CameraMemory | None]) -> NDArray[np.intp]:
    """Return the markings that the memory of any camera says are painted elsewhere."""
    known = [memory.repainted_markings for memory in remembered if memory is not None]
    return np.unique(np.concatenate([np.empty(0), *known])).astype(np.intp)


def _find_repainted(
    estimate: Estimate, remembered: Sequence[CameraMemory | None], refiner: _Refiner
) -> NDArray[np.intp]:
    """Return the markings that lie elsewhere than the memory of any camera has them: all see the same paint."""
    if not any(remembered):
        return refiner.repainted
    measured = refiner.reader.measure(estimate.on_ground(refiner.unknowns), estimate.cameras, SEARCH_PX[0])
    found = [
        find_repainted_markings(memory, found, estimate.lines)
        for memory, found in zip(remembered, measured, strict=True)
        if memory is not None
    ]
    return np.unique(np.concatenate([refiner.repainted, *found]))


def with_misfit_noise(estimate: Estimate, measured: Sequence[Measurements]) -> list[Measurements]:
    """Return the measurements with their misfit: the error that neither noise nor paint nor ground explains.

    Lens and field are never quite what they are said to be, by pixels alike near and far. Without it, a far line that a
    wrong lens displaces by ten of its small sigmas would outweigh all near ones.
    """
    return [
        replace(found, misfit_px=misfit_px(found.offset(camera, estimate.lines.position[found.index]), found))
        for camera, found in zip(estimate.cameras, measured, strict=True)
    ]


def evaluate_poses(
    pitch: Field,
    cameras: Sequence[Camera],
    observations: Observations,
    free: Sequence[Parameter] = (),
    stored: Sequence[Camera] | None = None,
    memories: Sequence[CameraMemory | None] | None = None,
) -> RefinedPoses:
    """Evaluate poses that are left as they are, with everything else; arguments as for `refine`."""
    unknowns = Unknowns(len(cameras), free, Ground.under(pitch.measured_points))
    estimate = Estimate.initial(pitch, cameras, unknowns)
    remembered = memories_of_field(memories or [None] * len(cameras), estimate.lines)
    refiner = _Refiner(observations.reader(), unknowns, _repainted_in_memory(remembered), cameras)
    refiner = replace(refiner, repainted=_find_repainted(estimate, remembered, refiner))
    return _assessed(estimate, stored or cameras, remembered, refiner)


def _each_alone(
    pitch: Field,
    cameras: Sequence[Camera],
    observations: Observations,
    stored: Sequence[Camera],
    memories: Sequence[CameraMemory | None] | None,
) -> RefinedPoses:
    """Refine cameras that need not agree, each on a ground of its own."""
    ends = [
        refine(pitch, [camera], observations.of([n]), 0.0, stored=[stored[n]], memories=memories and [memories[n]])
        for n, camera in enumerate(cameras)
    ]
    deviations = [deviation for end in ends for deviation in end.deviations if deviation.camera is not None]
    return RefinedPoses(pitch, [end.each[0] for end in ends], deviations, [])


def _assessed(
    estimate: Estimate, stored: Sequence[Camera], remembered: Sequence[CameraMemory | None], refiner: _Refiner
) -> RefinedPoses:
    refiner = refiner.around(estimate)
    lines, reader = estimate.on_ground(refiner.unknowns), refiner.reader
    evidence = refiner.evidence(estimate, lines)
    everything = _of_seen(estimate.pitch, reader.measure(lines, estimate.cameras, EVALUATION_SEARCH_PX), evidence)
    measured = with_misfit_noise(estimate, refiner.without_repainted(everything))
    # A field that is wrong looks like a ground that swells a lot: judged, it has to be an ordinary ground.
    ordinary = replace(estimate, uneven_m=min(estimate.uneven_m, refiner.unknowns.ground.usual_m))
    refined = estimate_uncertainty(ordinary, stored, remembered, measured, evidence, refiner.unknowns)
    each = [
        replace(one, measured=its, repainted_markings=tuple(refiner.repainted.tolist()))
        for one, its in zip(refined.each, with_misfit_noise(estimate, everything), strict=True)
    ]
    return replace(refined, each=each)


def _with_pose_shift_if_corrected(refined: RefinedPoses, estimate: Estimate, refiner: _Refiner) -> RefinedPoses:
    """Return the poses, with the move of the cameras for each parameter of the field that the lines contradict."""
    measured = refiner.without_repainted([one.measured for one in refined.each if one.measured is not None])
    deviations = [
        replace(one, moves_m=_moves_m(one, estimate, measured, refiner)) if one.camera is None and is_sure(one) else one
        for one in refined.deviations
    ]
    return replace(refined, deviations=deviations)


def _moves_m(
    wrong: Deviation, estimate: Estimate, measured: Sequence[Measurements], refiner: _Refiner
) -> dict[str, float]:
    """Return the move (m) of each camera, by id, on the same measurements with a measure of the field corrected.

    Nothing for a number that no field can have otherwise.
    """
    measure = next((one for one in field_measures(estimate.pitch) if one.name == wrong.name), None)
    if measure is None:
        return {}
    _, pitch = measure.applied(estimate.cameras, estimate.pitch, wrong.value)
    there = replace(estimate, pitch=pitch)
    refiner = refiner.around(there)
    there = refiner.down_huber(there, measured)
    for _ in range(MOST_STEPS):
        there = refiner.towards_tukey(there, measured).to
    moved = zip(estimate.cameras, there.cameras, strict=True)
    return {before.id: before.distance_m(after) for before, after in moved}


def _of_seen(pitch: Field, measured: Sequence[Measurements], evidence: Sequence[Evidence]) -> list[Measurements]:
    """Return the measurements of markings that are seen: ridges found where a line should be and is not fix no pose.

    Dashes and rows are one marking.
    """
    whole = np.unique(pitch.whole_names(), return_inverse=True)[1]
    return [
        found[np.isin(whole[found.points.marking], replace(seen, marking=whole[seen.marking]).seen())]
        for found, seen in zip(measured, evidence, strict=True)
    ]
