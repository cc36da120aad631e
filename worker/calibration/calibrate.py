"""The whole method on one page: frames and stored poses in, new poses and what they are worth out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from worker.calibration.camera import Camera, Pose
from worker.calibration.field import Field

Frame = NDArray[np.uint8]
Preset = Literal["esc", "paper", "scpr"]
Stage = Literal["segmentation", "evolution", "refinement", "preview"]


@dataclass(frozen=True)
class Options:
    """What a caller may choose; in the paper mu, lambda, G and the trade-off lambda of section III."""

    preset: Preset = "esc"
    seed: int = 0
    generations: int = 100
    parents: int = 64
    offspring: int = 128
    stitch_weight: float = 0.5
    flat: bool = False


@dataclass(frozen=True)
class Progress:
    """How far a calibration has come: `fraction` 0..1 of the whole job; the rest during the evolution."""

    stage: Stage
    fraction: float
    generation: int | None = None
    loss: float | None = None


@dataclass(frozen=True)
class Sigma:
    """One standard deviation of a pose: degrees and metres, None where it could not be told."""

    rotation_deg: float
    position_m: float


@dataclass(frozen=True)
class Movement:
    """From the stored pose to the new one: degrees, metres, and the mean shift of the visible pitch in pixels."""

    rotation_deg: float
    position_m: float
    pixels: float


@dataclass(frozen=True)
class CameraResult:
    """One camera's answer."""

    id: str
    pose: Pose
    sigma: Sigma | None
    moved: Movement
    iou: float
    residual_px: float | None


@dataclass(frozen=True)
class Calibration:
    """The answer of the engine. `rejected_because`: None when accepted."""

    cameras: Sequence[CameraResult]
    rejected_because: str | None
    stitch_error_px: float | None
    stitch_error_before_px: float | None
    loss: float
    generations: int
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
    segment: Callable[..., NDArray[np.float32]],
    options: Options,
    report: Callable[[Progress], None] = lambda _: None,
    stop: Callable[[], bool] = lambda: False,
) -> Calibration:
    """Find the poses of all cameras at once.

    `cameras` carry their stored poses; `frames[camera.id]` are one or more BGR frames (height, width, 3) of the size of
    the intrinsics. Deterministic for `options.seed`, whatever the number of threads.
    """
    raise NotImplementedError
