"""The whole method on one page: frames and stored poses in, new poses and what they are worth out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import cv2
import numpy as np

from worker.calibration.finish.diagnosis import suspicions
from worker.calibration.finish.refinement import Sight, assess, refine
from worker.calibration.finish.uncertainty import Finished
from worker.calibration.judge.quality import (
    CameraResult,
    Gate,
    Movement,
    believable,
    markings_iou,
    rejection,
    ridge_rejection,
)
from worker.calibration.judge.registration import Response, pairs_in_common, stitch_error_px
from worker.calibration.records import (
    Answer,
    Calibration,
    CalibrationError,
    Journey,
    Options,
    Preset,
    Progress,
    Segment,
)
from worker.calibration.scene.camera import Camera, Frame
from worker.calibration.scene.field import Field
from worker.calibration.scene.parameters import Parameter, free_focal_lengths, free_ridge
from worker.calibration.scene.visibility import SeenLines
from worker.calibration.search.search import (
    ALONE_ON_THE_GROUND,
    COARSE_TO_FINE,
    ON_THE_GROUND,
    Found,
    Level,
    Strategy,
    search,
)
from worker.calibration.see.contrast import Channels
from worker.calibration.see.evidence import evidence_of
from worker.calibration.see.ridge_response import ridge_response
from worker.calibration.see.sampling import median
from worker.calibration.see.segmentation import reachable_regions
from worker.calibration.see.view import UsualView, ViewCondition, look_at

CAPTURE_RAD = 0.1
"""How far a line may be from where the stored pose expects it: 4 degrees of rotation and 0.3 m at 15 m."""
FEWEST_VISIBLE_POINTS = 60
"""Line points (25 cm apart) a stored pose has to see; less cannot fix a pose."""
NOTHING_USUAL: Mapping[str, UsualView] = MappingProxyType({})


@dataclass(frozen=True)
class Method:
    """What a preset does: the levels of its search, the shape of the ground, and how it ends.

    `power`: of the network's responses in the search, so that what it half believes (the edge of a shadow, a board)
    hardly pulls; `ridges`: whether they are followed where what the network sees leads nowhere.
    """

    levels: Sequence[Level]
    flat: bool
    power: int
    ridges: bool
    finish: Callable[..., Finished]


METHODS: Mapping[Preset, Method] = {
    "esc": Method(COARSE_TO_FINE, flat=False, power=3, ridges=True, finish=refine),
    "paper": Method(ON_THE_GROUND, flat=False, power=1, ridges=False, finish=assess),
    "scpr": Method(ALONE_ON_THE_GROUND, flat=True, power=1, ridges=False, finish=assess),
}
"""`esc`: the default. `paper`: the paper to the letter. `scpr`: its predecessor, flat and without a stitch term."""


def calibrate(
    pitch: Field,
    cameras: Sequence[Camera],
    frames: Mapping[str, Sequence[Frame]],
    segment: Segment,
    options: Options,
    report: Callable[[Progress], None] = lambda _: None,
    stop: Callable[[], bool] = lambda: False,
    usual: Mapping[str, UsualView] = NOTHING_USUAL,
) -> Calibration:
    """Find the poses of all cameras at once.

    `cameras` carry their stored poses; `frames[camera.id]` are one or more BGR frames (height, width, 3) of the size of
    the intrinsics; `usual[camera.id]`: what the last accepted job saw there. Deterministic for `options.seed`, whatever
    the number of the network's threads. Raises `CalibrationError` when a stored pose sees no markings, `Stopped` soon
    after `stop()` turns true.
    """
    method = METHODS[options.preset]
    pitch = pitch.flat() if options.flat or method.flat else pitch
    journey = Journey(report, stop)
    seen = look(pitch, cameras, frames, segment, journey, usual)
    end = settle(method, pitch, cameras, seen, options, journey)
    with journey.measuring("quality"):
        journey.at("refinement", 0.6)
        answer = judge(pitch, cameras, seen, end.finished, journey)
        stitch_before = _registered_px(pitch, cameras, seen.sight.responses)
        journey.at("refinement", 1.0)
    return Calibration(
        **vars(answer),
        stitch_error_before_px=stitch_before,
        loss=end.found.loss,
        generations=end.found.generations,
        suspicions=suspicions(believable(end.finished.deviations, answer.cameras, Gate())),
    )


@dataclass(frozen=True)
class Seen:
    """What the cameras see: `views`, whether their frames can be used, and the `sight` of the search and the finish."""

    views: Sequence[ViewCondition]
    sight: Sight

    @property
    def usable(self) -> bool:
        """Whether all frames can be."""
        return all(view.usable for view in self.views)


def look(
    pitch: Field,
    cameras: Sequence[Camera],
    frames: Mapping[str, Sequence[Frame]],
    segment: Segment,
    journey: Journey,
    usual: Mapping[str, UsualView] = NOTHING_USUAL,
) -> Seen:
    """Look at the frames, and for markings in them. Raises `CalibrationError`."""
    require_markings_in_view(pitch, cameras)
    with journey.measuring("view"):
        views = [view_of(frames[camera.id], pitch, camera, usual.get(camera.id)) for camera in cameras]
    with journey.measuring("segmentation"):
        responses = segment_all(pitch, cameras, frames, segment, journey)
    return Seen(views, Sight([Channels(frames[camera.id]) for camera in cameras], responses))


@dataclass(frozen=True)
class End:
    """Where search and finish ended."""

    found: Found
    finished: Finished

    @property
    def agreement(self) -> float:
        """Of the camera whose frame is explained least."""
        return min(camera.evidence.agreement for camera in self.finished.each)


def settle(
    method: Method, pitch: Field, cameras: Sequence[Camera], seen: Seen, options: Options, journey: Journey
) -> End:
    """Search for all cameras from their stored poses, and finish.

    What cannot be seen is not searched for: the stored poses are judged as they are, beside what is wrong. Where the
    poses that the network leads to do not explain the frames, ridges are followed in its place, and the better is kept.
    """
    free = _free(options, pitch, cameras)
    if not seen.usable:
        with journey.measuring("refinement"):
            stored = assess(pitch, cameras, seen.sight, options.stitch_weight, free)
        return End(Found(list(cameras), np.inf, 0), stored)

    def settled_by(responses: Sequence[Response]) -> End:
        with journey.measuring("evolution"):
            strategy = Strategy(options.parents, options.offspring, options.generations, options.stitch_weight)
            rng = np.random.default_rng(options.seed)
            on_generation = journey.evolution(options.generations)
            found = search(pitch, cameras, responses, method.levels, strategy, rng, on_generation)
        with journey.measuring("refinement"):
            journey.at("refinement", 0.0)
            finished = method.finish(pitch, found.cameras, seen.sight, options.stitch_weight, free, stored=cameras)
            return End(found, finished)

    responses: list[Response] = [
        np.asarray(cv2.pow(response, method.power), dtype=np.float32) for response in seen.sight.responses
    ]
    first = settled_by(responses)
    lost = [camera.evidence.agreement < Gate().least_agreement for camera in first.finished.each]
    if not (method.ridges and any(lost)):
        return first
    with journey.measuring("segmentation"):
        for number, is_lost in enumerate(lost):
            if is_lost:
                responses[number] = _ridges(pitch, cameras[number], seen.sight.channels[number])
    return max(first, settled_by(responses), key=lambda end: end.agreement)


def _ridges(pitch: Field, camera: Camera, channels: Channels) -> Response:
    """What streaks say (H, W) of where the markings are, wherever the network would look for them."""
    lines = SeenLines.from_camera(pitch.line_points(), camera)
    return ridge_response(channels, lines, CAPTURE_RAD * camera.intrinsics.matrix[0, 0])


def judge(pitch: Field, stored: Sequence[Camera], seen: Seen, finished: Finished, journey: Journey) -> Answer:
    """What the finished cameras are worth beside the `stored` ones on the `pitch` they were stored for."""
    lines = pitch.line_points()
    results = [
        CameraResult(
            **vars(after),
            view=view,
            iou=markings_iou(finished.pitch, after.camera, response),
            evidence_before=evidence_of(lines, before, channels, response),
            moved=Movement.between(pitch, before, after.camera),
        )
        for before, after, view, channels, response in zip(
            stored, finished.each, seen.views, seen.sight.channels, seen.sight.responses, strict=True
        )
    ]
    stitch = _stitch_error_px(finished.pitch, finished.cameras, seen.sight)
    rejected = rejection(results, pairs_in_common(finished.pitch, finished.cameras), stitch, Gate())
    rejected = rejected or ridge_rejection(finished.pitch, Gate())
    return Answer(finished.pitch, results, rejected, stitch, journey.seconds)


def _stitch_error_px(pitch: Field, cameras: Sequence[Camera], sight: Sight) -> float | None:
    """By what the network sees, or by ridges where that brings no cameras together that share markings."""
    error = _registered_px(pitch, cameras, sight.responses)
    if error is not None or not pairs_in_common(pitch, cameras):
        return error
    ridges = [_ridges(pitch, camera, channels) for camera, channels in zip(cameras, sight.channels, strict=True)]
    return _registered_px(pitch, cameras, ridges)


def _registered_px(pitch: Field, cameras: Sequence[Camera], responses: Sequence[Response]) -> float | None:
    by_id = {camera.id: response for camera, response in zip(cameras, responses, strict=True)}
    return stitch_error_px(pitch, cameras, by_id)


def require_markings_in_view(pitch: Field, cameras: Sequence[Camera]) -> None:
    """Raise for a stored pose from which no pitch can be seen: nothing that follows could find it."""
    lines = pitch.line_points()
    for camera in cameras:
        visible = len(SeenLines.from_camera(lines, camera))
        if visible < FEWEST_VISIBLE_POINTS:
            raise CalibrationError(
                camera.id,
                "no-markings-in-view",
                f"the stored pose of camera {camera.id} sees {visible * lines.spacing:.0f} m of markings, at least "
                f"{FEWEST_VISIBLE_POINTS * lines.spacing:.0f} m are needed; store a first pose that looks at the pitch",
            )


def segment_all(
    pitch: Field,
    cameras: Sequence[Camera],
    frames: Mapping[str, Sequence[Frame]],
    segment: Segment,
    journey: Journey,
) -> list[Response]:
    """The fused segmentation (H, W) of each camera, where its markings can be."""
    total = sum(len(frames[camera.id]) for camera in cameras)
    done = 0
    responses = []
    for camera in cameras:
        regions = reachable_regions(pitch, camera, CAPTURE_RAD * camera.intrinsics.matrix[0, 0])
        seen = []
        for frame in frames[camera.id]:
            journey.at("segmentation", done / total)
            seen.append(segment(frame, regions))
            done += 1
        responses.append(median(seen) / np.float32(255))
    return responses


def _free(options: Options, pitch: Field, cameras: Sequence[Camera]) -> list[Parameter]:
    """What is to be found along with the poses."""
    lengths = free_focal_lengths(cameras) if options.fit_focal_length else []
    return [*lengths, *(free_ridge(pitch) if options.fit_ridge else [])]


def view_of(frames: Sequence[Frame], pitch: Field, camera: Camera, usual: UsualView | None) -> ViewCondition:
    """The view of the first frame that can be used, or what is wrong with the first."""
    first = look_at(frames[0], pitch, camera, usual)
    later = (look_at(frame, pitch, camera, usual) for frame in frames[1:])
    return first if first.usable else next((view for view in later if view.usable), first)
