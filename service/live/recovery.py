"""What `esc live` does about tracked cameras that are lost: it asks the service for a calibration by their pictures.

An accepted job moves the stored poses, which tracking begins anew from; a refused one changes nothing. Jobs take a
worker for seconds to minutes and a picture may show what no job can find: the pause between two of them doubles.
"""

from __future__ import annotations

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

# Between two looks whether a camera is lost.
LOOK_EVERY_S = 1.0
# A camera whose lines were not seen for so long is lost; players and a hand before the lens are gone by then.
LOST_AFTER_S = 10.0
# A camera of which no picture comes is waited for: its stream may have broken off for a moment.
FRAMES_WITHIN_S = 30.0
# From the end of a calibration until the next one begins, doubled each time that a camera is lost still.
FIRST_PAUSE_S, LONGEST_PAUSE_S = 180.0, 3600.0


class LiveCameras(Protocol):
    """The cameras that are tracked."""

    def lost(self, for_s: float) -> Sequence[str]:
        """Ids of cameras whose pictures come without their lines where expected, for longer than `for_s` seconds."""

    def frames(self) -> Mapping[str, bytes] | None:
        """Files of the newest pictures, by camera; none where not all cameras of the venue are tracked.

        None while there is none of a camera that is tracked.
        """


class RecoveryLog(Protocol):
    """Is told how calibrations go, of which each names the cameras that were `lost`."""

    def asked(self, lost: Sequence[str], job: Job) -> None:
        """Take a job that was submitted."""

    def ended(self, lost: Sequence[str], job: Job) -> None:
        """Take the end of that job."""

    def failed(self, lost: Sequence[str], error: Exception) -> None:
        """Take why there is no job: the service refused it, or cannot be reached."""


@dataclass(frozen=True)
class Recovery:
    """Has the service calibrate a venue where cameras are lost."""

    venue: str
    cameras: LiveCameras
    log: RecoveryLog

    def run(self, client: Client, stop: threading.Event) -> None:
        """Look after them until `stop`."""
        ended_s, pause_s, lost_s = -math.inf, FIRST_PAUSE_S, math.inf
        while not stop.wait(LOOK_EVERY_S):
            now = time.monotonic()
            if now - ended_s < pause_s:
                continue
            lost = self.cameras.lost(LOST_AFTER_S)
            if not lost:
                # Nothing was lost when the pause was over: it begins anew.
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
                # Without frames the service fetches them from the sources of the cameras, if they have any.
                job = client.calibrate(self.venue, files, {}, f"live-{uuid.uuid4()}")
            self.log.asked(lost, job)
            self.log.ended(lost, client.follow(job, lambda _: None, every_s=5.0))
        except (Refused, NotUnderstood, httpx.HTTPError) as error:
            self.log.failed(lost, error)
