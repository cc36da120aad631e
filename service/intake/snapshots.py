"""Frames from the sources of cameras, fetched by a program of the worker's: one that hangs is ended with it."""

import subprocess
import tempfile
import threading
from collections.abc import Callable, Collection, Mapping, Sequence
from math import inf

import structlog
from pydantic import ValidationError

from service import child_process
from service.intake import image_checks
from service.schemas.problems import Problem
from service.schemas.programs.sources import SourceAnswer, SourceTask, frame_file, longest_s
from service.schemas.source_urls import SourceSecrets
from service.schemas.venue import Camera
from service.settings import Settings

# Beyond the time that the sources have: to start, and to encode.
STARTING_S = 10.0
# In this process: each keeps a thread busy.
AT_ONCE = 8
# Part of the time that a source had: a fetch that took as much was ended by the limit.
LATE = 0.9
log = structlog.get_logger()


class SourceLate(Problem):
    """Problem of a source that gave no frame within its time; with more time it might have."""


class Snapshots:
    """Fetches frames of a venue's cameras at once; `count` is called with the duration of each fetch."""

    def __init__(self, settings: Settings, count: Callable[[Collection[SourceAnswer]], None]) -> None:
        self._settings = settings
        self._count = count
        self._turns = threading.BoundedSemaphore(AT_ONCE)

    def take(self, camera: Camera, credentials: Mapping[str, str]) -> bytes:
        """Return a checked frame of a camera. Raises a `Problem` if it gives none."""
        return self.take_of_all([camera], credentials)[camera.id][0]

    def take_of_all(
        self,
        cameras: Sequence[Camera],
        credentials: Mapping[str, str],
        frames: int = 1,
        spacing_s: float = 0.0,
        within_s: float | None = None,
    ) -> dict[str, list[bytes]]:
        """Return checked frames of each camera by its id, so many and so far apart.

        `within_s`: the time that sources have, beyond what lies between frames; None: what the settings say. Raises a
        `Problem` that names the first camera that gave none, `SourceLate` if it was not quick enough.
        """
        for camera in cameras:
            if camera.source is None:
                raise Problem(
                    "missing-camera",
                    f"Send a frame of camera {camera.id}, or give it a source: PUT the venue with one.",
                    camera=camera.id,
                )
        if not self._turns.acquire(blocking=False):
            raise Problem("unavailable", "Other frames are being fetched.", headers={"Retry-After": "5"})
        try:
            with tempfile.TemporaryDirectory(prefix="esc-frames-") as folder:
                task = self._task(cameras, credentials, folder, within_s).model_copy(
                    update={"frames": frames, "spacing_s": spacing_s}
                )
                why = f"it gave no frame within {task.seconds:g} s"
                silent = {one.id: SourceAnswer(camera=one.id, why=why, seconds=task.seconds) for one in cameras}
                answers = silent | self._ask(task, credentials)
                self._count(answers.values())
                budget = image_checks.PixelBudget(self._settings)
                return {camera.id: self._checked(camera, answers[camera.id], task, budget) for camera in cameras}
        finally:
            self._turns.release()

    def _task(
        self, cameras: Sequence[Camera], credentials: Mapping[str, str], folder: str, within_s: float | None
    ) -> SourceTask:
        return SourceTask(
            sources={camera.id: (camera.source or "", credentials.get(camera.id)) for camera in cameras},
            allowed=self._settings.sources,
            folder=folder,
            seconds=min(within_s or inf, self._settings.source_timeout_s),
            most_bytes=int(self._settings.max_frame_mb * 1e6),
            most_pixels=self._settings.max_frame_pixels,
        )

    def _ask(self, task: SourceTask, credentials: Mapping[str, str]) -> dict[str, SourceAnswer]:
        try:
            done = subprocess.run(
                self._settings.source_program,
                input=task.model_dump_json().encode(),
                env=child_process.without_secrets() | self._settings.native_environment,
                capture_output=True,
                timeout=longest_s(task) + STARTING_S,
            )
            output, errors = done.stdout, done.stderr
        except subprocess.TimeoutExpired as late:
            output, errors = late.stdout or b"", late.stderr or b""
        if errors:
            log.warning("fetching frames", stderr=_without(credentials, errors.decode(errors="replace"))[-2000:])
        return {
            answer.camera: answer.model_copy(update={"why": answer.why and _without(credentials, answer.why)})
            for line in output.splitlines()
            if (answer := _understood(line))
        }

    def _checked(
        self, camera: Camera, answer: SourceAnswer, task: SourceTask, budget: image_checks.PixelBudget
    ) -> list[bytes]:
        if answer.why is not None:
            problem = SourceLate if answer.seconds >= LATE * task.seconds else Problem
            raise problem(
                "source-failed",
                f"No frame of camera {camera.id} from {camera.source}: {answer.why}.",
                camera=camera.id,
                source=camera.source,
            )
        files = [frame_file(task, camera.id, number).read_bytes() for number in range(task.frames)]
        for data in files:
            image_checks.check(camera, data, self._settings, budget)
        return files


def _without(credentials: Mapping[str, str], text: str) -> str:
    """Return text of native code without secrets: it may repeat an address whole."""
    for secrets in credentials.values():
        text = SourceSecrets.decoded(secrets).redact(text)
    return text


def _understood(line: bytes) -> SourceAnswer | None:
    try:
        return SourceAnswer.model_validate_json(line)
    except ValidationError:
        return None
