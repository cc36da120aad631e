"""Recovery of lost cameras in `esc live`: it submits a calibration with their newest pictures.

An accepted job moves the stored poses, from which tracking starts again; a rejected one changes nothing. A job keeps a
worker busy for seconds to minutes and may never succeed: the pause between two jobs doubles.
"""

import math
import tempfile
import threading
import time
import uuid
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import httpx

from service.client import Client, NotUnderstood, Refused

if TYPE_CHECKING:
    from service.schemas.job import Job

# Interval of the check for lost cameras.
LOOK_EVERY_S = 1.0
# A camera whose lines were not seen for this long is lost; players and a hand before the lens are gone by then.
LOST_AFTER_S = 10.0
# Time to wait for a camera without pictures: its stream may have broken off for a moment.
FRAMES_WITHIN_S = 30.0
# Pause between two calibrations, doubled each time that a camera is still lost.
FIRST_PAUSE_S, LONGEST_PAUSE_S = 180.0, 3600.0


class LiveCameras(Protocol):
    """The tracked cameras."""

    def lost(self, for_s: float) -> Sequence[str]:
        """Return the ids of cameras whose pictures did not show the expected lines for `for_s` seconds."""

    def frames(self) -> Mapping[str, bytes] | None:
        """Return the newest picture of each camera as a file; {} if not all cameras of the venue are tracked.

        None while a tracked camera has no picture.
        """


class RecoveryLog(Protocol):
    """Log of the calibrations; `lost`: ids of the cameras that were lost."""

    def asked(self, lost: Sequence[str], job: "Job") -> None:
        """Log a submitted job."""

    def ended(self, lost: Sequence[str], job: "Job") -> None:
        """Log the end of a job."""

    def failed(self, lost: Sequence[str], error: Exception) -> None:
        """Log that the service refused a job, or cannot be reached."""


@dataclass(frozen=True)
class Recovery:
    """Calibrates a venue while cameras are lost."""

    venue: str
    cameras: LiveCameras
    log: RecoveryLog

    def run(self, client: Client, stop: threading.Event) -> None:
        """Submit calibrations of lost cameras until `stop`."""
        ended_s, pause_s, lost_s = -math.inf, FIRST_PAUSE_S, math.inf
        while not stop.wait(LOOK_EVERY_S):
            now = time.monotonic()
            if now - ended_s < pause_s:
                continue
            lost = self.cameras.lost(LOST_AFTER_S)
            if not lost:
                # No camera is lost after the pause: the next pause is the first one again.
                ended_s, pause_s, lost_s = -math.inf, FIRST_PAUSE_S, math.inf
                continue
            lost_s = min(lost_s, now)
            frames = self.cameras.frames()
            if frames is None and now - lost_s < FRAMES_WITHIN_S:
                continue
            if ended_s > -math.inf:
                pause_s = min(2 * pause_s, LONGEST_PAUSE_S)
            self._calibrate(client, lost, frames or {})
            ended_s, lost_s = time.monotonic(), math.inf

    def _calibrate(self, client: Client, lost: Sequence[str], frames: Mapping[str, bytes]) -> None:
        try:
            with tempfile.TemporaryDirectory() as folder:
                files = {}
                for camera, content in frames.items():
                    files[camera] = Path(folder, f"{camera}.jpg")
                    files[camera].write_bytes(content)
                # Without files the service fetches frames from the sources of the cameras, if they have any.
                job = client.calibrate(self.venue, files, {}, f"live-{uuid.uuid4()}")
            self.log.asked(lost, job)
            self.log.ended(lost, client.follow(job, lambda _: None, every_s=5.0))
        except (Refused, NotUnderstood, httpx.HTTPError) as error:
            self.log.failed(lost, error)
