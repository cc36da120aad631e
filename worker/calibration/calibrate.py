"""The whole method on one page: frames and stored poses in, new poses and what they are worth out."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from worker.calibration.finish.diagnosis import Suspicion, suspicions
from worker.calibration.finish.refinement import Refined, Sight, assess, refine
from worker.calibration.judge.quality import (
    CameraQuality,
    Gate,
    Movement,
    Sigma,
    believable,
    markings_iou,
    rejection,
    ridge_rejection,
)
from worker.calibration.judge.registration import pairs_in_common, stitch_error_px
from worker.calibration.scene.camera import Array, Camera, Frame, Intrinsics, Pose
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
from worker.calibration.see.sampling import median
from worker.calibration.see.segmentation import Region, reachable_regions
from worker.calibration.see.view import ViewCondition, look_at

Response = NDArray[np.float32]
Preset = Literal["esc", "paper", "scpr"]
Stage = Literal["segmentation", "evolution", "refinement", "preview"]

CAPTURE_RAD = 0.1
"""How far a line may be from where the stored pose expects it: 4 degrees of rotation and 0.3 m at 15 m."""
FEWEST_VISIBLE_POINTS = 60
"""Line points (25 cm apart) a stored pose has to see; less cannot fix a pose."""
SHARE_OF_JOB = {"segmentation": (0.0, 0.65), "evolution": (0.65, 0.85), "refinement": (0.85, 0.92)}
"""Where on the way of a whole job each stage begins and ends; the pictures are the rest."""


class Segment(Protocol):
    """Probability (H, W) in 0..255 of a marking, see `segmentation.Segmenter`."""

    def __call__(self, frame: Frame, regions: Sequence[Region]) -> NDArray[np.uint8]:
        """Look at regions of a frame; 0 outside them."""


@dataclass(frozen=True)
class Options:
    """What a caller may choose; in the paper mu, lambda, G and the trade-off lambda of section III.

    `fit_focal_length`: of each camera, as heat changes it; `fit_ridge`: its height. Both are for preset `esc`.
    """

    preset: Preset = "esc"
    seed: int = 0
    generations: int = 100
    parents: int = 64
    offspring: int = 128
    stitch_weight: float = 0.5
    flat: bool = False
    fit_focal_length: bool = False
    fit_ridge: bool = False


@dataclass(frozen=True)
class Method:
    """What a preset does: the levels of its search, the shape of the ground, and how it ends."""

    levels: Sequence[Level]
    flat: bool
    finish: Callable[..., Refined]


METHODS: Mapping[Preset, Method] = {
    "esc": Method(COARSE_TO_FINE, flat=False, finish=refine),
    "paper": Method(ON_THE_GROUND, flat=False, finish=assess),
    "scpr": Method(ALONE_ON_THE_GROUND, flat=True, finish=assess),
}
"""`esc`: the default. `paper`: the paper to the letter. `scpr`: its predecessor, flat and without a stitch term."""


@dataclass(frozen=True)
class Progress:
    """How far a calibration has come: `fraction` 0..1 of the whole job; the rest during the evolution."""

    stage: Stage
    fraction: float
    generation: int | None = None
    loss: float | None = None


@dataclass(frozen=True)
class CameraResult:
    """One camera's answer. `sigma`, `repeatability` and `residual_px` are None where too few lines could be measured.

    `view`: whether its frame could be used, and what is wrong with it if not.
    `found`: share 0..1 of the markings' length in view that is seen where the pose puts it; `by_chance`: that is as
    likely seen anywhere. `repeatability`: the part of sigma that is not owed to lens and field, which do not change.
    `intrinsics`: those that the pose belongs to, which are the given ones unless the focal length was to be found.
    """

    id: str
    intrinsics: Intrinsics
    pose: Pose
    view: ViewCondition
    sigma: Sigma | None
    repeatability: Sigma | None
    moved: Movement
    iou: float
    found: float
    by_chance: float
    residual_px: float | None


@dataclass(frozen=True)
class Calibration:
    """The answer of the engine. `rejected_because`: None when accepted.

    `pitch`: the given one unless its ridge was to be found. `suspicions`: what the lines contradict of what was given.
    """

    pitch: Field
    cameras: Sequence[CameraResult]
    rejected_because: str | None
    stitch_error_px: float | None
    stitch_error_before_px: float | None
    loss: float
    generations: int
    suspicions: Sequence[Suspicion]
    timings_s: Mapping[str, float] = field(default_factory=dict)

    @property
    def accepted(self) -> bool:
        """Whether the gate lets the new poses replace the stored ones."""
        return self.rejected_because is None


class CalibrationError(Exception):
    """The frames cannot be calibrated at all: names the camera and says what to do."""

    def __init__(self, camera: str, kind: str, detail: str) -> None:
        super().__init__(detail)
        self.camera = camera
        self.kind = kind
        self.detail = detail


class Stopped(Exception):  # noqa: N818  (a request, not an error)
    """The caller asked to stop."""


def calibrate(
    pitch: Field,
    cameras: Sequence[Camera],
    frames: Mapping[str, Sequence[Frame]],
    segment: Segment,
    options: Options,
    report: Callable[[Progress], None] = lambda _: None,
    stop: Callable[[], bool] = lambda: False,
) -> Calibration:
    """Find the poses of all cameras at once.

    `cameras` carry their stored poses; `frames[camera.id]` are one or more BGR frames (height, width, 3) of the size of
    the intrinsics. Deterministic for `options.seed`, whatever the number of threads. Raises `CalibrationError` when a
    stored pose sees no markings, `Stopped` soon after `stop()` turns true.
    """
    method = METHODS[options.preset]
    pitch = pitch.flat() if options.flat or method.flat else pitch
    clock = Clock()
    journey = Journey(report, stop)
    require_markings_in_view(pitch, cameras)
    with clock.measuring("view"):
        views = [view_of(frames[camera.id], pitch, camera) for camera in cameras]
        usable = all(view.usable for view in views)
    with clock.measuring("segmentation"):
        responses = segment_all(pitch, cameras, frames, segment, journey)
    with clock.measuring("evolution"):
        strategy = Strategy(options.parents, options.offspring, options.generations, options.stitch_weight)
        rng = np.random.default_rng(options.seed)
        # What cannot be seen is not searched for: the stored poses are judged as they are, beside what is wrong.
        found = (
            search(pitch, cameras, responses, method.levels, strategy, rng, journey.evolution(options.generations))
            if usable
            else Found(list(cameras), np.inf, 0)
        )
    with clock.measuring("refinement"):
        journey.at("refinement", 0.0)
        sight = Sight([Channels(frames[camera.id]) for camera in cameras], responses)
        finish = method.finish if usable else assess
        refined = finish(pitch, found.cameras, sight, options.stitch_weight, _free(options, pitch, cameras))
    with clock.measuring("quality"):
        journey.at("refinement", 0.6)
        by_id = {camera.id: response for camera, response in zip(cameras, responses, strict=True)}
        stitch = stitch_error_px(refined.pitch, refined.cameras, by_id)
        stitch_before = stitch_error_px(pitch, cameras, by_id)
        qualities = qualities_of(pitch, cameras, refined, sight, views)
        journey.at("refinement", 1.0)
    return Calibration(
        refined.pitch,
        [camera_result(quality) for quality in qualities],
        rejection(qualities, pairs_in_common(refined.pitch, refined.cameras), stitch, Gate())
        or ridge_rejection(refined.pitch, Gate()),
        stitch,
        stitch_before,
        found.loss,
        found.generations,
        suspicions(believable(refined.deviations, qualities, Gate())),
        clock.seconds,
    )


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


def camera_result(quality: CameraQuality) -> CameraResult:
    """What is answered of what the gate looked at."""
    return CameraResult(
        quality.camera.id,
        quality.camera.intrinsics,
        quality.camera.pose,
        quality.view,
        quality.sigma,
        quality.repeatability,
        quality.moved,
        quality.iou,
        quality.evidence.share,
        quality.evidence.by_chance,
        quality.residual_px,
    )


def view_of(frames: Sequence[Frame], pitch: Field, camera: Camera) -> ViewCondition:
    """The view of the first frame that can be used, or what is wrong with the first."""
    first = look_at(frames[0], pitch, camera)
    later = (look_at(frame, pitch, camera) for frame in frames[1:])
    return first if first.usable else next((view for view in later if view.usable), first)


def qualities_of(
    pitch: Field, stored: Sequence[Camera], refined: Refined, sight: Sight, views: Sequence[ViewCondition]
) -> list[CameraQuality]:
    """What the gate looks at: the finished cameras beside the `stored` ones on the pitch they were stored for."""
    lines = pitch.line_points()
    return [
        CameraQuality(
            after,
            view,
            markings_iou(refined.pitch, after, response),
            evidence,
            evidence_of(lines, before, channels, response),
            residual,
            _sigma(covariance),
            _sigma(repeatability),
            Movement.between(pitch, before, after),
        )
        for before, after, view, channels, response, evidence, residual, covariance, repeatability in zip(
            stored,
            refined.cameras,
            views,
            sight.channels,
            sight.responses,
            refined.evidence,
            refined.residual_px,
            refined.covariance,
            refined.repeatability,
            strict=True,
        )
    ]


def _sigma(covariance: Array | None) -> Sigma | None:
    return None if covariance is None else Sigma.from_covariance(covariance)


class Clock:
    """Seconds per stage."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    @contextmanager
    def measuring(self, stage: str) -> Iterator[None]:
        """Measure what is done inside."""
        begin = time.perf_counter()
        yield
        self.seconds[stage] = time.perf_counter() - begin


class Journey:
    """Reports where a job stands, and ends it when its caller wants it to stop."""

    def __init__(self, report: Callable[[Progress], None], stop: Callable[[], bool]) -> None:
        self.report = report
        self.stop = stop

    def at(self, stage: Stage, share: float, generation: int | None = None, loss: float | None = None) -> None:
        """Report `share` 0..1 of `stage`; raise `Stopped` when asked to stop."""
        if self.stop():
            raise Stopped
        begin, end = SHARE_OF_JOB[stage]
        self.report(Progress(stage, begin + share * (end - begin), generation, loss))

    def evolution(self, total: int) -> Callable[[int, float], None]:
        """What a search of at most `total` generations calls after each one."""
        return lambda number, loss: self.at("evolution", number / total, number, loss)
