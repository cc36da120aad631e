"""What goes into the engine and what comes out of it: options, progress, answers, errors."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from worker.calibration.finish.diagnosis import Suspicion
from worker.calibration.judge.pairs import Pair
from worker.calibration.judge.quality import CameraResult
from worker.calibration.judge.seam import Seam
from worker.calibration.memory.camera_memory import CameraMemory
from worker.calibration.scene.camera import Frame
from worker.calibration.scene.field import Field
from worker.calibration.see.segmentation import Region
from worker.calibration.stitch.light import Light

Preset = Literal["esc", "paper", "scpr"]
Stage = Literal["segmentation", "evolution", "refinement", "preview"]
Search = Literal["auto", "wide"]
Path = Literal["near", "wide"]
Verdict = Literal["accepted", "partly", "rejected"]

SHARE_OF_JOB = {"segmentation": (0.0, 0.65), "evolution": (0.65, 0.85), "refinement": (0.85, 0.92)}
"""Where on the way of a whole job each stage begins and ends; the pictures are the rest."""


class Segment(Protocol):
    """Probability (H, W) in 0..255 of a marking, see `segmentation.Segmenter`."""

    def __call__(self, frame: Frame, regions: Sequence[Region]) -> NDArray[np.uint8]:
        """Look at regions of a frame; 0 outside them."""


@dataclass(frozen=True)
class Options:
    """What a caller may choose; in the paper mu, lambda, G and the trade-off lambda of section III.

    `search`: `auto` looks first whether the cameras stand almost where they stood, `wide` searches in any case.
    `fit_focal_length`: of each camera, as heat changes it; `fit_ridge`: its height; `lens_may_drift`: whether a pose
    may be accepted with another focal length than the stored one. All are for preset `esc`.
    """

    preset: Preset = "esc"
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


@dataclass(frozen=True)
class Progress:
    """How far a calibration has come: `fraction` 0..1 of the whole job; the rest during the evolution."""

    stage: Stage
    fraction: float
    generation: int | None = None
    loss: float | None = None


class Spent:
    """What stages took: `seconds` by a clock, and `core_seconds` of all threads of the process."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.core_seconds: dict[str, float] = {}

    @contextmanager
    def measuring(self, stage: str) -> Iterator[None]:
        """Measure what that takes which is done inside."""
        begun, spent = time.perf_counter(), time.process_time()
        yield
        self.seconds[stage] = self.seconds.get(stage, 0.0) + time.perf_counter() - begun
        self.core_seconds[stage] = self.core_seconds.get(stage, 0.0) + time.process_time() - spent

    def name(self, stage: str) -> None:
        """Say of a stage that may have been left out that it took nothing."""
        self.seconds.setdefault(stage, 0.0)
        self.core_seconds.setdefault(stage, 0.0)

    def add(self, other: Spent) -> None:
        """What was measured elsewhere, behind what was measured here."""
        self.seconds |= other.seconds
        self.core_seconds |= other.core_seconds


@dataclass(frozen=True)
class Answer:
    """What the engine says of cameras around a pitch. `rejected_because`: all reasons in a sentence, None without any.

    `pitch`: the given one but for what of it was to be found; `spent`: on each stage; `pairs`: of cameras that were
    compared, each with its seam.
    """

    pitch: Field
    cameras: Sequence[CameraResult]
    rejected_because: str | None
    stitch_error_px: float | None
    spent: Spent
    pairs: Sequence[tuple[Pair, Seam]] = field(default=(), kw_only=True)

    @property
    def accepted(self) -> bool:
        """Whether the gate lets all that was found replace what is stored."""
        return self.rejected_because is None

    @property
    def verdict(self) -> Verdict:
        """Whether it lets the poses of all cameras, of some or of none."""
        accepted = [camera.accepted for camera in self.cameras]
        return "accepted" if all(accepted) else "partly" if any(accepted) else "rejected"


@dataclass(frozen=True)
class Calibration(Answer):
    """The answer to frames: new poses. `suspicions`: what the lines contradict of what was given.

    `path`: whether they were found `near` their stored poses, or by a search (`wide`). `lights`: of accepted cameras
    that overlap, by camera. `memories`: of cameras whose poses are accepted, with this job in them, by camera.
    """

    stitch_error_before_px: float | None
    loss: float
    generations: int
    suspicions: Sequence[Suspicion]
    path: Path
    lights: Mapping[str, Light]
    memories: Mapping[str, CameraMemory]


class CalibrationError(Exception):
    """The frames cannot be calibrated at all: names the camera and says what to do."""

    def __init__(self, camera: str, kind: str, detail: str) -> None:
        super().__init__(detail)
        self.camera = camera
        self.kind = kind
        self.detail = detail


class Stopped(Exception):  # noqa: N818  (a request, not an error)
    """The caller asked to stop."""


class Journey:
    """Where a job stands: what each stage took, how far it is, and whether its caller wants it to stop."""

    def __init__(self, report: Callable[[Progress], None], stop: Callable[[], bool]) -> None:
        self.spent = Spent()
        self.report = report
        self.stop = stop
        self.fraction = 0.0

    def unreported(self) -> Journey:
        """The same journey for what may be done in vain: its time counts, and nobody is told of it."""
        aside = Journey(lambda _: None, self.stop)
        aside.spent = self.spent
        return aside

    def measuring(self, stage: str) -> AbstractContextManager[None]:
        """Measure what that takes which is done inside."""
        return self.spent.measuring(stage)

    def at(self, stage: Stage, share: float, generation: int | None = None, loss: float | None = None) -> None:
        """Report `share` 0..1 of `stage`; raise `Stopped` when asked to stop."""
        if self.stop():
            raise Stopped
        begin, end = SHARE_OF_JOB[stage]
        # A second search does not take back what has been reported.
        self.fraction = max(self.fraction, begin + share * (end - begin))
        self.report(Progress(stage, self.fraction, generation, loss))

    def evolution(self, total: int) -> Callable[[int, float], None]:
        """What a search of at most `total` generations calls after each one."""
        return lambda number, loss: self.at("evolution", number / total, number, loss)
