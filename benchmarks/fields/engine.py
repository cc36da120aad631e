"""The product's engine as the benchmark calls it, and what it answers as a row."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.rows import Rows
from worker.calibration.calibrate import NOTHING_USUAL, calibrate
from worker.calibration.detection.segmentation import Segmenter
from worker.calibration.detection.view_condition import UsualView
from worker.calibration.gate.quality import CameraResult
from worker.calibration.geometry.camera import Camera, Frame
from worker.calibration.geometry.field import Field
from worker.calibration.records import Calibration, CalibrationError, Options, Recover

THREADS = 2


@dataclass(frozen=True)
class Answer:
    """`said`: None where the engine gave none; `why`: of a refusal, else empty."""

    said: Calibration | None
    why: str
    seconds: float
    core_seconds: float

    @property
    def accepted(self) -> bool:
        """True if the gate accepted it."""
        return self.said is not None and self.said.accepted

    @property
    def row(self) -> dict:
        """The answer as a row, without its cameras."""
        return {
            "accepted": self.accepted,
            "why": self.why,
            "seconds": self.seconds,
            "core_seconds": self.core_seconds,
            "in_full": 0 if self.said is None else len(self.said.in_full),
        }


class Engine:
    """A network, the engine behind it, and the rows of what they have answered."""

    def __init__(self, model: Path, rows: Rows) -> None:
        self.segment = Segmenter(model, THREADS)
        self.name = hashlib.sha256(model.read_bytes()).hexdigest()[:12]
        self.rows = rows

    def __call__(
        self,
        pitch: Field,
        cameras: Sequence[Camera],
        frames: Mapping[str, Sequence[Frame]],
        seed: int,
        usual: Mapping[str, UsualView] = NOTHING_USUAL,
        recover: Recover = "propose",
    ) -> Answer:
        """A calibration of cameras at their stored poses, with all that it costs."""
        wall, cpu = time.perf_counter(), time.process_time()
        try:
            said = calibrate(pitch, cameras, frames, self.segment, Options(seed=seed, recover=recover), usual=usual)
            why = said.rejected_because or ""
        except CalibrationError as error:
            said, why = None, error.detail
        return Answer(said, why, time.perf_counter() - wall, time.process_time() - cpu)


def camera_row(result: CameraResult) -> dict:
    """Return the result of one camera as a row."""
    return {
        "rotation": result.camera.pose.rotation.tolist(),
        "position": result.camera.pose.position.tolist(),
        "found": result.evidence.share,
        "by_chance": result.evidence.by_chance,
        "cause": result.view.cause,
        "residual_px": result.residual_px,
        "sigma_m": result.sigma.position_m if result.sigma else None,
        "sigma_deg": result.sigma.rotation_deg if result.sigma else None,
    }
