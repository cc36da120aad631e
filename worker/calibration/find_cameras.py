"""The engine's other page: frames without poses in, cameras with verdicts out."""

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fields.template import TURF_M
from worker.calibration.calibrate import calibrate
from worker.calibration.detection.contrast import Channels
from worker.calibration.detection.exclusions import of_use
from worker.calibration.detection.frame_fusion import median, sways
from worker.calibration.detection.segmentation import Region, whole_frame
from worker.calibration.gate.quality import GATE, CameraResult
from worker.calibration.geometry.camera import Camera, Frame
from worker.calibration.geometry.field import Field
from worker.calibration.records import Calibration, Options, Progress, ProgressReporter, Segment, StageTimings
from worker.calibration.refinement.diagnosis import Suspicion
from worker.calibration.refinement.refine import Observations
from worker.calibration.refinement.uncertainty import FOCAL, Sigma
from worker.calibration.relocalisation.candidate import Candidate, FrameObservations
from worker.calibration.relocalisation.crown import find_crown
from worker.calibration.relocalisation.field_halves import choose_sides, side_of
from worker.calibration.relocalisation.field_map import FieldMap
from worker.calibration.relocalisation.field_paint import draw_field_paint
from worker.calibration.relocalisation.painted_numbers import place_by_numbers
from worker.calibration.relocalisation.relocalise import NotFound, Relocalisation, relocalise, twin, why_not_taken
from worker.calibration.relocalisation.rivals import tell_rivals_apart
from worker.calibration.relocalisation.shared_ground import SharedGround
from worker.calibration.relocalisation.sought import SoughtCamera, SoughtLens

OF_ONE_KIND = 0.03
"""By which part the focal lengths of cameras of one kind differ, one standard deviation."""
LENS_OFF = 0.05
"""By which part a focal length that was given may be off, one standard deviation, once lines contradict it."""
IN_ITS_PLACE = "the lens that the lines have is taken in its place"
Seen = tuple[Channels, NDArray[np.float32]]
"""Channels of a camera's frames, and the fused response (H, W) of the network in 0..1."""
SEGMENTED, SEARCHED = 0.05, 0.95
"""Share of the whole at which the frames are segmented, and the cameras found; to calibrate them is the rest. Of two
cameras of which nothing was known (66 core-seconds) they were 0.02 and 0.95."""
USUAL_CORE_S, USUAL_CORE_S_KNOWN_LENS = 7.5, 5.0
"""Core-seconds that the search of a camera takes, nothing known of it or its lens: means of 66 real frames each."""


@dataclass(frozen=True)
class FoundCamera:
    """Result of the search for one camera.

    `candidates`: cameras that may have taken its frame, the best first, for a person to choose from; a best one that is
    accepted is at the pose of a calibration that began with it. `refusal`: why the best one is not taken, None where it
    is; `remarks`: what was assumed. `assumed_side`: the side of a symmetric field that the best one stands on by an
    assumption about all cameras of the search; the second one then is its twin on the other side. None: not assumed.
    """

    id: str
    candidates: Sequence[Candidate]
    refusal: NotFound | None
    remarks: Sequence[str]
    assumed_side: str | None = None

    @property
    def accepted(self) -> bool:
        """True if a calibration can begin with the best candidate."""
        return self.refusal is None

    @property
    def was_calibrated(self) -> bool:
        """True if a calibration has begun with the best candidate, on the field as it was found."""
        return self.refusal is None or self.refusal.reason == "not-confirmed"


@dataclass(frozen=True)
class FoundCameras:
    """The cameras that were sought, on their `pitch`: as it was given, or with the ridge that was found for a flat one.

    `stitch_error_px`: between those that were accepted, None where none overlap.
    """

    pitch: Field
    cameras: Sequence[FoundCamera]
    stitch_error_px: float | None
    timings: StageTimings


def find_cameras(
    pitch: Field,
    sought: Sequence[SoughtCamera],
    known: Sequence[Camera],
    frames: Mapping[str, Sequence[Frame]],
    segment: Segment,
    seed: int,
    report: Callable[[Progress], None] = lambda _: None,
    stop: Callable[[], bool] = lambda: False,
) -> FoundCameras:
    """Find the cameras that took `frames[camera.id]`, BGR (height, width, 3), from the markings in them alone.

    `known`: cameras of the same field whose poses are known; those of them that have frames are calibrated with the
    others. Deterministic for a `seed`. Raises `Stopped` soon after `stop()` turns true.
    """
    progress = ProgressReporter(report, stop)
    markings = FieldMap.of(pitch)

    # Observe.
    responses: dict[str, list[NDArray[np.uint8]]] = {}
    with progress.timed("segmentation"):
        for number, one in enumerate(sought):
            progress.at_fraction("segmentation", SEGMENTED * number / len(sought))
            responses[one.id] = [segment(frame, whole_frame(one.size)) for frame in frames[one.id]]

    # Find each camera alone; who was found helps who was not. Then choose the halves of the field that they look at,
    # and of several poses the one from which the ground looks as another camera sees it.
    with progress.timed("evolution"):
        pace = _Pace(progress.timings)
        seen = {one.id: _seen(one, frames[one.id], responses[one.id]) for one in sought}
        alone = dict[str, Relocalisation]()
        for number, one in enumerate(sought):
            fraction = SEGMENTED + (SEARCHED - SEGMENTED) * number / len(sought)
            progress.at_fraction("evolution", fraction, remaining_s=pace.remaining_s(number, sought[number:]))
            in_one_paint = _InOnePaint(pitch, markings, one, frames[one.id][0], segment, seed)
            alone[one.id] = _find_alone(in_one_paint, seen[one.id])
            seen[one.id] = in_one_paint.seen or seen[one.id]
        for helped in _with_lenses_of_others(sought, alone):
            progress.at_fraction("evolution", SEARCHED)
            again = relocalise(pitch, markings, helped, *seen[helped.id], seed)
            alone[helped.id] = again if again.refusal is None else alone[helped.id]
        ground = SharedGround.of(pitch, {camera: its[0] for camera, its in frames.items()})
        placed = _on_their_sides(alone, sought, known, ground) if markings.is_symmetric else alone
        by_id = {one.id: one for one in sought}
        placed = tell_rivals_apart(pitch, markings, placed, by_id, known, ground)

    # Calibrate those that were found, as every later job will, until none has a given lens that its lines contradict:
    # the lens that the lines have takes its place, and tells more of the crown.
    remembered = _Remembered(segment, {id(frames[one][n]): r for one in placed for n, r in enumerate(responses[one])})
    beside = [camera for camera in known if camera.id in frames]
    options = Options(seed=seed, recover="never", found=frozenset(by_id))
    given, as_given, unfit = pitch, placed, dict[str, str]()
    with progress.timed("calibration"):
        while True:
            for camera, words in unfit.items():
                one = replace(by_id[camera], lenses=[SoughtLens.around(by_id[camera].lenses[0].lens, LENS_OFF)])
                as_given[camera] = _through_lens_of_lines(given, markings, one, as_given[camera], seen[camera], words)
                by_id[camera] = one
            if given.ridge is None and not known:
                pitch, placed = _on_its_crown(given, as_given, by_id, seen)
            unfit = _with_loose_lenses(by_id.values(), placed)
            if unfit:
                continue
            progress.at_fraction("refinement", SEARCHED)
            found = [one.candidates[0].camera for one in placed.values() if one.refusal is None]
            calibrated = calibrate(pitch, [*found, *beside], frames, remembered, options, stop=stop) if found else None
            unfit = {} if calibrated is None else _with_unfit_lenses(by_id.values(), calibrated)
            if not unfit:
                break
    judged = [_judged(camera, placed[camera], calibrated) for camera in by_id]
    is_side_assumed = markings.is_symmetric and not known and all(by_id[one.id].place.is_anywhere for one in found)
    return FoundCameras(
        pitch,
        [_with_twin(camera) if is_side_assumed and camera.accepted else camera for camera in judged],
        None if calibrated is None else calibrated.stitch_error_px,
        progress.timings,
    )


class _Pace:
    """The pace of a search: by the cameras that have been searched for, before the first of them by the core's share.

    `segmented`: the time that segmentation took, of the clock and of cores, which says how much of a core is to be had.
    """

    def __init__(self, segmented: StageTimings) -> None:
        seconds, core_seconds = segmented.seconds["segmentation"], segmented.core_seconds["segmentation"]
        # The search of a camera runs on one core.
        self._share = min(1.0, core_seconds / max(seconds, 1e-9)) or 1.0
        self._begun = time.monotonic()

    def remaining_s(self, done: int, waiting: Sequence[SoughtCamera]) -> float:
        """Return how long the cameras that wait will still take."""
        if done:
            return (time.monotonic() - self._begun) / done * len(waiting)
        usual = (USUAL_CORE_S if one.is_lens_sought else USUAL_CORE_S_KNOWN_LENS for one in waiting)
        return sum(usual) / self._share


class _Remembered:
    """A network that has been asked about some frames before."""

    def __init__(self, segment: Segment, responses: Mapping[int, NDArray[np.uint8]]) -> None:
        self._segment, self._responses = segment, responses

    def __call__(self, frame: Frame, regions: Sequence[Region]) -> NDArray[np.uint8]:
        """Return the network's response (H, W) to a frame."""
        known = self._responses.get(id(frame))
        return self._segment(frame, regions) if known is None else known


def _seen(sought: SoughtCamera, frames: Sequence[Frame], responses: Sequence[NDArray[np.uint8]]) -> Seen:
    """Return the channels of a camera's frames and the fused response (H, W) in 0..1, 0 where they are ignored."""
    swayed = sways(frames, sought.lenses[0].lens)
    return Channels(frames, swayed), of_use(sought.ignored, median(responses, swayed) / np.float32(255))


@dataclass
class _InOnePaint:
    """Search for a camera by the paint alone that is most likely the field's.

    `seen`: channels and response (H, W) of the frame in that paint, once the camera was found in it.
    """

    pitch: Field
    markings: FieldMap
    sought: SoughtCamera
    frame: Frame
    segment: Segment
    seed: int
    seen: Seen | None = None

    def relocalise(self, in_all: Relocalisation) -> Relocalisation | None:
        """Find the camera, or say why not; None unless its lines agree better with one paint than `in_all` colours."""
        painted = draw_field_paint(self.markings, self.sought, self.frame, self.segment, self.seed)
        if painted is None:
            return None
        seen = _seen(self.sought, [painted], [self.segment(painted, whole_frame(self.sought.size))])
        found = relocalise(self.pitch, self.markings, self.sought, *seen, self.seed)
        if _best_agreement(found) <= _best_agreement(in_all):
            return None
        self.seen = seen
        remark = "the lines of one colour alone were taken for the field's, others for those of other sports"
        return replace(found, remarks=[*found.remarks, remark])


def _find_alone(in_one_paint: _InOnePaint, seen: Seen) -> Relocalisation:
    """Find a camera by what is `seen` in its frame alone: by all of it, by the numbers on the field, in one paint."""
    pitch, markings, sought = in_one_paint.pitch, in_one_paint.markings, in_one_paint.sought
    by_numbers: Relocalisation | None = None

    def in_another_way(in_all: Relocalisation) -> Relocalisation | None:
        nonlocal by_numbers
        by_numbers = place_by_numbers(pitch, markings, in_all, sought, *seen)
        return by_numbers or in_one_paint.relocalise(in_all)

    found = relocalise(pitch, markings, sought, *seen, in_one_paint.seed, in_another_way=in_another_way)
    return by_numbers or place_by_numbers(pitch, markings, found, sought, *(in_one_paint.seen or seen)) or found


def _best_agreement(found: Relocalisation) -> float:
    return max((candidate.agreement for candidate in found.candidates), default=0.0)


def _with_lenses_of_others(
    sought: Sequence[SoughtCamera], alone: Mapping[str, Relocalisation]
) -> Iterator[SoughtCamera]:
    """Yield the cameras that were not found, each with the lenses found for others: often all are of one kind."""
    for one in sought:
        if not one.is_lens_sought or alone[one.id].refusal is None:
            continue
        lenses = [
            SoughtLens.around(alone[other.id].candidates[0].camera.intrinsics, OF_ONE_KIND)
            for other in sought
            if other.size == one.size and alone[other.id].refusal is None
        ]
        if lenses:
            yield replace(one, lenses=lenses, other_lenses=())


def _on_their_sides(
    alone: Mapping[str, Relocalisation],
    sought: Sequence[SoughtCamera],
    known: Sequence[Camera],
    ground: SharedGround,
) -> dict[str, Relocalisation]:
    """Return the results with each camera on its side of a symmetric field; refused where that is not clear."""
    best = [one.candidates[0].camera for one in alone.values() if one.refusal is None]
    sides = {one.camera.id: one for one in choose_sides(best, {one.id: one.place for one in sought}, known, ground)}
    placed = dict[str, Relocalisation]()
    for camera, found in alone.items():
        side = sides.get(camera)
        if side is None:
            placed[camera] = found
            continue
        first, *others = found.candidates
        if side.camera is not first.camera:
            first = replace(first, camera=side.camera)
        if side.decided:
            remarks = [*found.remarks, *([side.remark] if side.remark else [])]
            placed[camera] = replace(found, candidates=[first, *others], remarks=remarks)
            continue
        both = [first, replace(first, camera=twin(side.camera)), *others]
        placed[camera] = replace(found, candidates=both, refusal=NotFound("not-unique", side.remark or ""))
    return placed


def _on_its_crown(
    flat: Field,
    placed: dict[str, Relocalisation],
    sought: Mapping[str, SoughtCamera],
    seen: Mapping[str, Seen],
) -> tuple[Field, dict[str, Relocalisation]]:
    """Return the field with the ridge that fits the lines of the cameras found on it flat, and these cameras on it."""
    found = [camera for camera, one in placed.items() if one.refusal is None]
    # Floors, courts and ice are level to millimetres.
    if not found or flat.template.uneven < TURF_M:
        return flat, placed
    observations = Observations([seen[one][0] for one in found], [seen[one][1] for one in found])
    candidates = [placed[one].candidates[0] for one in found]
    crowned = find_crown(flat, [sought[one] for one in found], candidates, observations)
    if crowned is None:
        return flat, placed
    first = dict(zip(found, crowned.candidates, strict=True))
    return crowned.field, {
        camera: replace(one, candidates=[first[camera], *one.candidates[1:]]) if camera in first else one
        for camera, one in placed.items()
    }


def _with_loose_lenses(sought: Iterable[SoughtCamera], placed: Mapping[str, Relocalisation]) -> dict[str, str]:
    """Return the cameras that were found and whose given lens leaves open where they stand, and the words for it."""
    loose = {
        one.id: why_lens_loose(placed[one.id].candidates[0].sigma)
        for one in sought
        if not one.is_lens_sought and placed[one.id].refusal is None
    }
    return {camera: words for camera, words in loose.items() if words is not None}


def _with_unfit_lenses(sought: Iterable[SoughtCamera], calibrated: Calibration) -> dict[str, str]:
    """Return what speaks against the lens that was given, in words, of each camera of which anything does."""
    results = {result.camera.id: result for result in calibrated.cameras}
    unfit = {
        one.id: why_lens_unfit(results[one.id], calibrated.suspicions)
        for one in sought
        if not one.is_lens_sought and one.id in results
    }
    return {camera: words for camera, words in unfit.items() if words is not None}


def _through_lens_of_lines(
    pitch: Field,
    markings: FieldMap,
    sought: SoughtCamera,
    found: Relocalisation,
    seen: Seen,
    words: str,
) -> Relocalisation:
    """Return a camera that was found with the lens that its lines have, which is `sought` now; `words`: why it is."""
    first, *others = found.candidates
    settled = FrameObservations.of(pitch, *seen).settled(first.camera, sought)
    # It was told apart from the others before, and lies no farther from its lines now.
    refusal = why_not_taken(pitch, markings, sought, [settled])
    return replace(found, candidates=[settled, *others], refusal=refusal, remarks=[*found.remarks, words])


def _judged(camera: str, found: Relocalisation, calibrated: Calibration | None) -> FoundCamera:
    """Return the result for one camera, with the verdict of the calibration that began with it."""
    if found.refusal is not None or calibrated is None:
        return FoundCamera(camera, found.candidates, found.refusal, found.remarks)
    (result,) = (one for one in calibrated.cameras if one.camera.id == camera)
    if result.refusal is not None:
        refusal = NotFound("not-confirmed", result.refusal.words)
        return FoundCamera(camera, found.candidates, refusal, found.remarks)
    best, *others = found.candidates
    return FoundCamera(camera, [replace(best, camera=result.camera), *others], None, found.remarks)


def _with_twin(found: FoundCamera) -> FoundCamera:
    """Return the result with the twin of its best candidate behind it: the whole search may be off by half a turn."""
    best, *others = found.candidates
    both = [best, replace(best, camera=twin(best.camera))]
    return replace(found, candidates=[*both, *others], assumed_side=side_of(best.camera))


def why_lens_unfit(result: CameraResult, suspicions: Sequence[Suspicion]) -> str | None:
    """Return what speaks against a lens that was given for a camera found through it, in words; None if nothing.

    A job has a stored pose beside the lens. A search has nothing but the lines, and what it finds is stored.
    """
    if result.refusal is not None:
        return f"{result.refusal.words}: {IN_ITS_PLACE}" if result.refusal.reason == "residual" else None
    focal_px = result.camera.intrinsics.focal_length_px
    for one in suspicions:
        away_m = 0.0 if result.refined is None else result.camera.distance_m(result.refined.camera)
        if (one.camera, one.quantity) == (result.camera.id, FOCAL) and away_m > GATE.largest_zoomed_m:
            by = f"{abs(one.deviation) / focal_px:.2%} ± {one.sigma / focal_px:.2%}"
            return (
                f"the lines fit a focal length {by} {'longer' if one.deviation > 0 else 'shorter'} than that of the "
                f"lens that was given, which puts the camera {away_m:.2f} m from where it seems to be: {IN_ITS_PLACE}"
            )
    return why_lens_loose(result.sigma)


def why_lens_loose(sigma: Sigma | None) -> str | None:
    """Return in words that a given lens leaves open where its camera stands; None if the pose is as sure as it must."""
    if sigma is None or sigma.position_m <= GATE.largest_found_sigma_m:
        return None
    return (
        "how far off the lens may be that was given leaves open where the camera stands: "
        f"{sigma.position_m:.2f} m (at most {GATE.largest_found_sigma_m} allowed): {IN_ITS_PLACE}; say how "
        "well it is known (sigma), if it was measured"
    )
