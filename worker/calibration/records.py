"""Inputs and outputs of the engine: options, progress, results, errors."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field, replace
from typing import Literal, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from worker.calibration.detection.segmentation import Region
from worker.calibration.detection.view_condition import ViewCondition
from worker.calibration.diagnostics.seam import Seam
from worker.calibration.gate.pairs import Pair
from worker.calibration.gate.quality import CameraResult, in_one_sentence
from worker.calibration.geometry.camera import Array, Camera, Frame
from worker.calibration.geometry.field import Field
from worker.calibration.memory.camera_memory import CameraMemory
from worker.calibration.refinement.diagnosis import Suspicion
from worker.calibration.stitching.photometry import Light

Stage = Literal["segmentation", "evolution", "refinement", "preview"]
Search = Literal["auto", "wide", "anywhere"]
Recover = Literal["propose", "accept", "never"]
Path = Literal["near", "wide", "anywhere"]
Verdict = Literal["accepted", "partly", "rejected"]

SHARE_OF_JOB = {"segmentation": (0.0, 0.65), "evolution": (0.65, 0.85), "refinement": (0.85, 0.92)}
"""Share of a whole job at which each stage begins and ends; drawing the pictures is the rest."""


class Segment(Protocol):
    """Probability (H, W) in 0..255 of a marking, see `segmentation.Segmenter`."""

    def __call__(self, frame: Frame, regions: Sequence[Region]) -> NDArray[np.uint8]:
        """Return the response (H, W) of the network in regions of a frame, 0 outside them."""


@dataclass(frozen=True)
class Options:
    """Options of a calibration; `parents`, `offspring`, `generations` and `stitch_weight` are mu, lambda, G and the
    trade-off lambda of section III of the paper.

    `search`: `auto` tries the near path before it searches, and last searches for cameras whose lines are elsewhere
    where they stood, turned by any angle; `wide` always searches around the stored poses, and nowhere else; `anywhere`
    searches for all cameras, where they stood and then anywhere.
    `recover`: whether a camera that was knocked and found is proposed to a person or accepted; `never`: it is not
    searched for. `fit_focal_length`: solve for the focal length of each camera, which heat changes; `fit_ridge`: for
    the ridge's height; `lens_may_drift`: whether a pose may be accepted with another focal length than the stored one.
    `found`: the cameras whose stored poses were found in these frames, and say nothing of how far they have moved.
    """

    search: Search = "auto"
    seed: int = 0
    generations: int = 100
    parents: int = 64
    offspring: int = 128
    stitch_weight: float = 0.5
    flat: bool = False
    fit_focal_length: bool = False
    fit_ridge: bool = False
    lens_may_drift: bool = False
    recover: Recover = "propose"
    found: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Progress:
    """Progress of a calibration: `fraction` 0..1 of the whole job; `generation` and `loss` during the evolution.

    `remaining_s`: an estimate, None where there is nothing to go by.
    """

    stage: Stage
    fraction: float
    generation: int | None = None
    loss: float | None = None
    remaining_s: float | None = None


class StageTimings:
    """Times of the stages by name: `seconds` of wall clock, and `core_seconds` of all threads of the process."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.core_seconds: dict[str, float] = {}

    @contextmanager
    def timed(self, stage: str) -> Iterator[None]:
        """Add the time of the `with` block to a stage."""
        begun, cores_begun = time.perf_counter(), time.process_time()
        yield
        self.seconds[stage] = self.seconds.get(stage, 0.0) + time.perf_counter() - begun
        self.core_seconds[stage] = self.core_seconds.get(stage, 0.0) + time.process_time() - cores_begun

    def ensure(self, stage: str) -> None:
        """Count a stage that may have been left out as 0 s."""
        self.seconds.setdefault(stage, 0.0)
        self.core_seconds.setdefault(stage, 0.0)

    def add(self, other: "StageTimings") -> None:
        """Append the stages of other timings."""
        self.seconds |= other.seconds
        self.core_seconds |= other.core_seconds


@dataclass(frozen=True)
class EngineResult:
    """Cameras around a pitch with the verdicts of the gate. `rejected_because`: all reasons in a sentence, or None.

    `pitch`: the given one, with the measures that were solved for; `timings` of the stages; `pairs`: of
    cameras that were compared, each with its seam.
    """

    pitch: Field
    cameras: Sequence[CameraResult]
    rejected_because: str | None
    stitch_error_px: float | None
    timings: StageTimings
    pairs: Sequence[tuple[Pair, Seam]] = field(default=(), kw_only=True)

    def with_results(self, cameras: Sequence[CameraResult]) -> Self:
        """Return the result with other results of its cameras, whose refusals are all that it is rejected for."""
        reasons = [f"camera {one.camera.id}: {one.rejected_because}" for one in cameras if one.rejected_because]
        return replace(self, cameras=cameras, rejected_because=in_one_sentence(reasons) or None)

    def accepts_all_of(self, before: "EngineResult") -> bool:
        """True if every camera that the result `before` accepts is accepted here."""
        both = zip(before.cameras, self.cameras, strict=True)
        return all(now.accepted or not then.accepted for then, now in both)

    @property
    def accepted(self) -> bool:
        """True if the gate accepts all that was found."""
        return self.rejected_because is None

    @property
    def verdict(self) -> Verdict:
        """`accepted` if the gate accepts the poses of all cameras, `partly` if of some, else `rejected`."""
        accepted = [camera.accepted for camera in self.cameras]
        return "accepted" if all(accepted) else "partly" if any(accepted) else "rejected"


@dataclass(frozen=True)
class Calibration(EngineResult):
    """New poses from frames. `suspicions`: given numbers of lenses and field that the lines contradict.

    `path`: whether they were found `near` their stored poses, by a search around these (`wide`), or one of them by a
    search `anywhere`. `lights`: of accepted cameras
    that overlap, by camera. `memories`: of cameras whose poses are accepted, with this job in them, by camera.
    `responses`: what the network saw of each frame, (h, w) in 0..1, by camera; `in_full`: the cameras at whose frames
    it looked in full, and not only at an overview.
    """

    stitch_error_before_px: float | None
    loss: float
    generations: int
    suspicions: Sequence[Suspicion]
    path: Path
    lights: Mapping[str, Light]
    memories: Mapping[str, CameraMemory]
    responses: Mapping[str, NDArray[np.float32]]
    in_full: Sequence[str]


class Recorder:
    """Receives what the stages of a calibration saw, as arrays, for debugging; this one keeps nothing of it."""

    def observed(
        self,
        cameras: Sequence[Camera],
        frames: Mapping[str, Sequence[Frame]],
        views: Sequence[ViewCondition],
        responses: Sequence[NDArray[np.float32]],
    ) -> None:
        """Receive the view condition and the network's response (H, W) in 0..1 of each camera."""

    def searched(self, cameras: Sequence[Camera], level: int, genomes: Array, best: Sequence[Camera]) -> None:
        """Receive the poses (P, 6 N) at the end of a level of a search, and the `best` of them."""

    def judged(self, pitch: Field, stored: Sequence[Camera], results: Sequence[CameraResult]) -> None:
        """Receive the results of the cameras beside their `stored` poses, with the measured lines."""


NOT_RECORDED = Recorder()


class CalibrationError(Exception):
    """The frames cannot be calibrated at all: names the camera and says what to do."""

    def __init__(self, camera: str, kind: str, detail: str) -> None:
        super().__init__(detail)
        self.camera = camera
        self.kind = kind
        self.detail = detail


class Stopped(Exception):  # noqa: N818  (a request, not an error)
    """The caller asked to stop."""


class ProgressReporter:
    """Times the stages of a job, reports its progress, and stops it when its caller asks to."""

    def __init__(self, report: Callable[[Progress], None], stop: Callable[[], bool]) -> None:
        self.timings = StageTimings()
        self.report = report
        self.stop = stop
        self.fraction = 0.0

    def muted(self) -> "ProgressReporter":
        """Return a reporter for an attempt that may fail: its time counts, its progress is not reported."""
        muted = ProgressReporter(lambda _: None, self.stop)
        muted.timings = self.timings
        return muted

    def timed(self, stage: str) -> AbstractContextManager[None]:
        """Add the time of the `with` block to a stage."""
        return self.timings.timed(stage)

    def at(self, stage: Stage, share: float, generation: int | None = None, loss: float | None = None) -> None:
        """Report `share` 0..1 of `stage`; raise `Stopped` when asked to stop."""
        begin, end = SHARE_OF_JOB[stage]
        self.at_fraction(stage, begin + share * (end - begin), generation, loss)

    def at_fraction(
        self,
        stage: Stage,
        fraction: float,
        generation: int | None = None,
        loss: float | None = None,
        remaining_s: float | None = None,
    ) -> None:
        """Report a `fraction` 0..1 of the whole, where stages have other shares; raise `Stopped` when asked to stop."""
        if self.stop():
            raise Stopped
        # A second search does not take back what has been reported.
        self.fraction = max(self.fraction, fraction)
        self.report(Progress(stage, self.fraction, generation, loss, remaining_s))

    def evolution(self, total: int) -> Callable[[int, float], None]:
        """Return the callback that a search of at most `total` generations calls after each one."""
        return lambda number, loss: self.at("evolution", number / total, number, loss)
